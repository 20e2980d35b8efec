"""Feature edges of simple bodies: those of a box, and none inside its sides."""

import numpy as np
import pytest

from tissue import TetrahedralMesh, block
from tissue.contact.geometry.edges import (
    Edges,
    crossing_of,
    distance_of_edges,
    face_across,
    is_feature_edge,
    is_inner,
    separation,
)
from tissue.contact.geometry.eight_contacts import (
    crossing_bits,
    points_of_contacts,
    squared_distances,
)
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, aligned, room_for_points, store_lanes
from tissue.core.vec3 import Vec3, cross, norm, sub, vec3
from tissue.mesh.body import OUTER, build_body
from tissue.mesh.faces import OUTWARD

pytestmark = pytest.mark.kernel


def boundary_edges(body):
    """Return every edge of every boundary face: tetrahedron, face, edge, and its two ends."""
    return [
        (t, f, k, *(int(body.tetrahedra[t, OUTWARD[f, (k + q) % 3]]) for q in (0, 1)))
        for t, f in zip(*np.nonzero(body.links == OUTER), strict=True)
        for k in range(3)
    ]


def without(mesh, low):
    """Return a mesh without the tetrahedra whose centroid is beyond `low` [m] along every axis."""
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    kept = mesh.tetrahedra[~(middles > low).all(axis=1)]
    nodes, renamed = np.unique(kept, return_inverse=True)
    return TetrahedralMesh(mesh.positions[nodes], renamed.reshape(-1, 4))


def test_the_face_across_an_edge_is_the_other_face_with_that_edge():
    body = build_body(block((2, 2, 1), (0.02, 0.02, 0.01)), None, None)
    edges = boundary_edges(body)
    for t, f, k, a, b in edges:
        (beyond,) = ((u, g, m) for u, g, m, c, d in edges if (c, d) == (b, a))
        face, tip = face_across(body, t, f, k)
        assert face == 4 * beyond[0] + beyond[1]
        assert tip == body.tetrahedra[beyond[0], OUTWARD[beyond[1], (beyond[2] + 2) % 3]]


def test_only_the_box_edges_of_a_block_are_feature_edges():
    size = np.array([0.02, 0.02, 0.01])
    body = build_body(block((2, 2, 1), size), None, None)
    for t, f, k, a, b in boundary_edges(body):
        ends = body.rest[[a, b]]
        n_sides = sum((ends[:, x] == side).all() for x in range(3) for side in (0.0, size[x]))
        assert is_feature_edge(body, t, f, k) == (n_sides == 2)


def test_the_inner_edge_of_an_l_shape_is_no_feature_edge():
    mesh = without(block((2, 1, 2), (0.02, 0.01, 0.02)), [0.01, 0.0, 0.01])
    body = build_body(mesh, None, None)
    inner = outer = 0
    for t, f, k, a, b in boundary_edges(body):
        ends = body.rest[[a, b]]
        if (ends[:, [0, 2]] == 0.01).all():
            assert not is_feature_edge(body, t, f, k)
            inner += 1
        elif (ends[:, [0, 2]] == 0.0).all():
            assert is_feature_edge(body, t, f, k)
            outer += 1
    assert inner == 2 and outer == 2


def test_the_edge_of_a_thin_wedge_is_a_feature_edge():
    """The two faces at the edge are only two degrees apart."""
    thin = 0.0175
    wedge = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, thin], [1.0, 0.5, -thin]])
    body = build_body(TetrahedralMesh(0.01 * wedge, np.array([[0, 1, 2, 3]])), None, None)
    edges = [row for row in boundary_edges(body) if {row[3], row[4]} == {0, 1}]
    assert len(edges) == 2
    assert all(is_feature_edge(body, t, f, k) for t, f, k, _, _ in edges)


@pytest.mark.parametrize("seed", range(3))
def test_the_distance_of_edges_is_the_least_of_their_points_and_lines_cross_at_it(seed):
    random, share = np.random.default_rng(seed), np.linspace(0.0, 1.0, 101)
    n_inner = 0
    for a, b, c, d in random.normal(size=(40, 4, 3)):
        at = Edges(*(Vec3(*x) for x in (a, b, c, d)))
        one, other = a + share[:, None] * (b - a), c + share[:, None] * (d - c)
        sampled = np.linalg.norm(one[:, None] - other[None], axis=2).min()
        longest = max(np.linalg.norm(b - a), np.linalg.norm(d - c))
        assert sampled - 0.01 * longest <= distance_of_edges(at) <= sampled + 1e-12
        crossing = crossing_of(at)
        apart = np.array(separation(at, crossing.s, crossing.t))
        np.testing.assert_allclose(apart, crossing.gap * np.array(crossing.normal), atol=1e-9)
        if is_inner(crossing.s) and is_inner(crossing.t):
            assert distance_of_edges(at) == pytest.approx(abs(crossing.gap))
            n_inner += 1
    assert n_inner > 3


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
