"""Eight pairs of edges at a time are what the functions of one pair say."""

import numpy as np
import pytest

from tissue.contact.geometry.edges import Edges, crossing_of, distance_of_edges, is_inner
from tissue.contact.geometry.eight_contacts import (
    crossing_bits,
    points_of_contacts,
    squared_distances,
)
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, aligned, room_for_points, store_lanes
from tissue.core.vec3 import cross, norm, sub, vec3

pytestmark = pytest.mark.kernel

N = 400
SINE = 0.1


@kernel
def measure(end, x, distance, crosses):
    """Write the squared distance of each pair [m2], and 1 if it crosses."""
    for k in range(0, len(end), WIDTH):
        at = points_of_contacts(end, x, k)
        store_lanes(distance, k, squared_distances(at))
        bits = crossing_bits(at, SINE)
        for q in range(WIDTH):
            crosses[k + q] = bits >> q & 1


def measured(segments):
    """Return distance and crossing of pairs of segments, given by ends of shape (n, 4, 3)."""
    n = len(segments)
    x, end = room_for_points(4 * n), np.arange(4 * n).reshape(n, 4)
    x[:] = segments.reshape(-1, 3)
    distance, crosses = aligned(n), np.zeros(n, np.int64)
    measure(end, x, distance, crosses)
    edges = [Edges(*(vec3(x, node) for node in row)) for row in end]
    return np.sqrt(distance), crosses, edges


@pytest.mark.parametrize("seed", range(3))
def test_distances_are_those_of_one_pair(seed):
    random = np.random.default_rng(seed)
    segments = random.normal(size=(N, 4, 3))
    segments[:100, :, 2] *= 1e-3  # nearly in a plane: many cross
    segments[100:140, 3] = segments[100:140, 2] + segments[100:140, 1] - segments[100:140, 0]
    segments[140:150, 1] = segments[140:150, 0]  # points
    segments[150:160, 3] = segments[150:160, 2]
    segments[155:165, [1, 3]] = segments[155:165, [0, 2]]
    segments[165:175, 3] = segments[165:175, 0]  # a common end
    distance, _, edges = measured(segments)
    wanted = [distance_of_edges(at) for at in edges]
    np.testing.assert_allclose(distance, wanted, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_that_cross_inside_and_steeply_are_kept(seed):
    random = np.random.default_rng(seed)
    segments = random.normal(size=(N, 4, 3))
    segments[:100, :, 2] *= 0.05
    _, crosses, edges = measured(segments)
    for at, does in zip(edges, crosses, strict=True):
        u, v, crossing = sub(at.b, at.a), sub(at.d, at.c), crossing_of(at)
        is_steep = norm(cross(u, v)) > SINE * norm(u) * norm(v)
        assert does == (is_steep and is_inner(crossing.s) and is_inner(crossing.t))
    assert 20 < crosses.sum() < N // 2
