"""Which tetrahedron holds a place, and where a line enters a surface: beside independent twins."""

import numpy as np
import pytest

from tests.support import bodies
from tissue import boundary_faces
from tissue.geometry.line_entries import write_entries
from tissue.geometry.surface_places import place_tree, write_holders

pytestmark = pytest.mark.kernel

LEAST = -1e-9


def holders_of(positions, tetrahedra, places):
    holders, weights = np.full(len(places), -1), np.zeros((len(places), 4))
    write_holders(place_tree(places), positions, tetrahedra, LEAST, holders, weights)
    return holders, weights


def all_weights(positions, tetrahedra, places):
    """Return the weights of each place in each tetrahedron, shape (n_places, n_tets, 4)."""
    ones = np.ones((len(tetrahedra), 4, 1))
    corners = np.concatenate([positions[tetrahedra], ones], axis=2)
    at = np.concatenate([places, np.ones((len(places), 1))], axis=1)
    return np.einsum("pi,tij->ptj", at, np.linalg.inv(corners))


@pytest.mark.parametrize("seed", range(3))
def test_a_place_is_in_the_last_of_the_tetrahedra_that_hold_it(seed):
    mesh = bodies.jittered(3, seed)
    rng, (low, high) = np.random.default_rng(seed), (mesh.positions.min(0), mesh.positions.max(0))
    anywhere = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (200, 3))
    # Nodes, and the middles of faces, are in several.
    faces = mesh.positions[mesh.tetrahedra[:20, :3]].mean(axis=1)
    places = np.concatenate([anywhere, mesh.positions[:30], faces])
    expected = all_weights(mesh.positions, mesh.tetrahedra, places)
    is_in = expected.min(axis=2) >= LEAST
    holders, weights = holders_of(mesh.positions, mesh.tetrahedra, places)
    last = np.where(is_in.any(1), is_in.shape[1] - 1 - is_in[:, ::-1].argmax(1), -1)
    np.testing.assert_array_equal(holders, last)
    held = holders >= 0
    assert held[200:].all()
    assert not held.all()
    np.testing.assert_allclose(weights[held], expected[held, holders[held]], atol=1e-9)
    assert not weights[~held].any()


def test_a_tetrahedron_without_volume_holds_nothing():
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    holders, _ = holders_of(flat, np.array([[0, 1, 2, 3]]), flat[:2] * 0.25)
    assert (holders == -1).all()


def entries_of(corners, starts, direction, is_ahead):
    n = len(starts)
    found = np.empty(n, np.int64), np.zeros((n, 3)), np.empty(n)
    write_entries(corners.reshape(-1, 3), starts, direction, is_ahead, *found)
    return found


@pytest.mark.parametrize("is_ahead", [False, True])
def test_a_line_enters_where_it_passes_a_face_from_outside(is_ahead):
    mesh = bodies.jittered(4, 2)
    corners = mesh.positions[boundary_faces(mesh.tetrahedra)]
    rng = np.random.default_rng(4)
    direction = np.array([0.3, -0.2, -1.0]) / np.linalg.norm([0.3, -0.2, -1.0])
    low, high = mesh.positions.min(0), mesh.positions.max(0)
    starts = rng.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (60, 3))
    faces, weights, ways = entries_of(corners, starts, direction, is_ahead)
    for i, start in enumerate(starts):
        # start + way * direction = (1 - u - v) a + u b + v c, solved face by face
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        matrix = np.stack([b - a, c - a, np.broadcast_to(-direction, a.shape)], axis=2)
        u, v, way = np.linalg.solve(matrix, (start - a)[:, :, None])[:, :, 0].T
        enters = (np.cross(b - a, c - a) @ direction < 0.0) & (np.minimum(u, v) >= -1e-9)
        enters &= u + v <= 1.0 + 1e-9
        if is_ahead:
            enters &= way > 0.0
        if not enters.any():
            assert (faces[i], ways[i]) == (-1, np.inf)
            continue
        nearest = np.flatnonzero(enters)[np.abs(way[enters]).argmin()]
        assert faces[i] == nearest
        assert ways[i] == pytest.approx(way[nearest], abs=1e-12)
        expected = (1.0 - u[nearest] - v[nearest], u[nearest], v[nearest])
        np.testing.assert_allclose(weights[i], expected, atol=1e-9)
    assert (faces >= 0).any()
    assert (faces < 0).any()
