"""The list of nodes that moved."""

import numpy as np
import pytest

from tests.support import bodies
from tissue.mesh.body import build_body
from tissue.mesh.node_motion import forget_moved, is_motion_finite, none_moved, note_moved

pytestmark = pytest.mark.kernel


def nodes(moved):
    return moved.nodes[: moved.n_nodes].tolist()


def test_each_node_is_listed_once_in_the_order_of_its_first_note():
    moved = none_moved(10)
    note_moved(moved, np.array([7, 3, 7, 1]), 3)
    note_moved(moved, np.array([3, 2]), 2)
    assert nodes(moved) == [7, 3, 2]


def test_a_forgotten_list_is_empty_and_can_be_filled_again():
    moved = none_moved(10)
    note_moved(moved, np.array([7, 3]), 2)
    forget_moved(moved)
    assert nodes(moved) == []
    note_moved(moved, np.array([3]), 1)
    assert nodes(moved) == [3]


MESH = bodies.jittered(2, 0)
N = len(MESH.positions)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308])
@pytest.mark.parametrize("array", ["positions", "velocities"])
def test_a_number_is_found_if_it_is_not_finite(array, value):
    body = build_body(MESH, MESH.positions, np.zeros(N, np.bool_))
    assert is_motion_finite(body)
    numbers = getattr(body, array)
    for node in range(N):
        kept, numbers[node, node % 3] = numbers[node, node % 3], value
        assert is_motion_finite(body) == np.isfinite(value)
        numbers[node, node % 3] = kept


def test_what_is_behind_the_nodes_does_not_count():
    body = build_body(MESH, MESH.positions, np.zeros(N, np.bool_))
    body.n_nodes = N - 1
    body.velocities[N - 1] = np.nan
    assert is_motion_finite(body)
