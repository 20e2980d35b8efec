"""The prefilter of eight pairs at once keeps every pair that the scalar test finds."""

import numpy as np
import pytest

from tissue.contact.edge_edge import Edges, crossing_of, is_inner, lines_overlap
from tissue.contact.pairs import add_pair, make_near, new_pairs, nodes_of_pair
from tissue.contact.point_triangle import Corners, project_to_plane
from tissue.contact.simd_prefilter import (
    may_be_crossed,
    may_be_under,
    prefilter_edges,
    prefilter_points,
)
from tissue.core.simd import aligned, room_for_points
from tissue.core.vec3 import Vec3, add, dot, sub, vec3

pytestmark = [pytest.mark.kernel, pytest.mark.filterwarnings("ignore:invalid value")]

N_NODES, N_PAIRS = 30, 203
TOLERANCE = 1e-3


def near_pairs(seed):
    """Return random points and pairs of any four of them; their number is no multiple of eight."""
    random = np.random.default_rng(seed)
    x, normal = room_for_points(N_NODES), room_for_points(N_NODES)
    x[:], normal[:] = random.normal(size=(2, N_NODES, 3))
    pairs = new_pairs(N_PAIRS)
    for k in range(N_PAIRS):
        nodes = tuple(random.choice(N_NODES, 4, replace=False).tolist())
        assert add_pair(pairs, nodes, 0, 0, 0)
        make_near(pairs, k)
    return x, normal, pairs, aligned(len(pairs.node))


def ends(x, pairs, k):
    return [vec3(x, node) for node in nodes_of_pair(pairs, k)]


@pytest.mark.parametrize("seed", range(3))
def test_nodes_below_a_triangle_by_more_than_the_tolerance_are_kept(seed):
    x, _, pairs, signs = near_pairs(seed)
    prefilter_points(pairs, x, signs)
    n_under = 0
    for k in range(N_PAIRS):
        at = Corners(*ends(x, pairs, k))
        height = dot(project_to_plane(at).normal, sub(at.p, at.a))
        assert signs[k] == pytest.approx(height, rel=1e-9)
        assert may_be_under(signs, k, TOLERANCE) or not height < -TOLERANCE
        n_under += may_be_under(signs, k, TOLERANCE)
    assert 50 < n_under < 150


@pytest.mark.parametrize("seed", range(3))
def test_edges_that_overlap_are_kept(seed):
    x, normal, pairs, signs = near_pairs(seed)
    prefilter_edges(pairs, x, normal, signs)
    n_crossed = 0
    for k in range(N_PAIRS):
        at = Edges(*ends(x, pairs, k))
        a, b, c, d = ends(normal, pairs, k)
        outward, other = add(a, b), add(c, d)
        now = crossing_of(at)
        is_one = lines_overlap(at, outward, other) and is_inner(now.s) and is_inner(now.t)
        assert may_be_crossed(signs, k) == is_one
        n_crossed += is_one
    assert n_crossed > 2


def test_flat_triangles_and_parallel_edges_are_omitted():
    x, normal = room_for_points(4), room_for_points(4)
    x[:] = [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    pairs, signs = new_pairs(8), aligned(32)
    add_pair(pairs, (0, 1, 2, 3), 0, 0, 0)
    make_near(pairs, 0)
    prefilter_points(pairs, x, signs)
    assert not may_be_under(signs, 0, TOLERANCE)
    x[:] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]
    normal[:] = Vec3(0.0, 0.0, 1.0)
    prefilter_edges(pairs, x, normal, signs)
    assert not may_be_crossed(signs, 0)
