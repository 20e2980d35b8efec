"""One number that is not finite is found, wherever it is."""

import numpy as np
import pytest

from tests.support import bodies
from tissue.mesh.body import build_body
from tissue.mesh.node_motion import is_motion_finite

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
