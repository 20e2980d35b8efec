"""The list of nodes that moved."""

import numpy as np
import pytest

from tissue.mesh.node_motion import forget_moved, none_moved, note_moved

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
