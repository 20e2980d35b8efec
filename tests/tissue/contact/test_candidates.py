"""The broad phase leaves out nothing that is near."""

import itertools

import numpy as np
import pytest

from tests import bodies, naive
from tissue.body import build_body
from tissue.contact.candidates import (
    N_EDGE_EDGE,
    N_EDGES,
    N_POINT_TRIANGLE,
    N_TRIANGLES,
    SAME_WAY,
    find_candidates,
    have_moved,
    new_candidates,
)
from tissue.contact.faces import (
    WITH_SKIN,
    collect_faces,
    count_faces,
    in_pieces,
    new_faces,
    with_room,
)
from tissue.shapes import grid
from tissue.types import TetrahedralMesh

pytestmark = pytest.mark.kernel

MARGIN = 0.004


def two_bodies(offset):
    """Return two small bodies that share no node."""
    first, second = grid((2, 2, 1), (0.02, 0.02, 0.01)), bodies.unit_tetrahedron()
    return TetrahedralMesh(
        np.vstack([first.positions, 0.01 * second.positions + offset]),
        np.vstack([first.tetrahedra, second.tetrahedra + len(first.positions)]),
    )


def candidates_of(mesh, margin=MARGIN, capacity=64):
    body = build_body(mesh, None, None)
    faces = with_room(new_faces(len(mesh.tetrahedra)), count_faces(body, True))
    faces.counts[WITH_SKIN] = 1
    faces = in_pieces(faces, (np.arange(len(mesh.tetrahedra)) >= 24).astype(np.int64), 2)
    collect_faces(faces, body)
    found = new_candidates(len(mesh.positions), capacity)
    if not find_candidates(found, faces, body, body.positions, margin):
        return None
    return body, found


def pairs(found, name, place):
    return {tuple(row) for row in getattr(found, name)[: found.counts[place]].tolist()}


@pytest.mark.parametrize("height", [0.0101, 0.012, 0.0135])
def test_every_node_near_a_triangle_is_paired_with_it_once(height):
    body, found = candidates_of(two_bodies([0.008, 0.007, height]))
    n = found.counts[N_TRIANGLES]
    point_triangle = pairs(found, "point_triangle", N_POINT_TRIANGLE)
    assert len(point_triangle) == found.counts[N_POINT_TRIANGLE] > 0
    for row, node in itertools.product(range(n), found.node[: found.counts[0]].tolist()):
        corners = found.triangle[row]
        near = naive.distance_to_triangle(body.positions[node], body.positions[corners]) <= MARGIN
        if near and node not in corners:
            assert (node, row) in point_triangle


def test_edges_of_two_bodies_that_face_each_other_are_paired_once():
    body, found = candidates_of(two_bodies([0.008, 0.007, 0.0105]))
    edge_edge = pairs(found, "edge_edge", N_EDGE_EDGE)
    assert len(edge_edge) == found.counts[N_EDGE_EDGE]
    n_facing = 0
    for i, j in itertools.combinations(range(found.counts[N_EDGES]), 2):
        first, second = found.edge[i], found.edge[j]
        x, y = body.positions[first], body.positions[second]
        near = (x.min(axis=0) <= y.max(axis=0) + MARGIN) & (y.min(axis=0) <= x.max(axis=0) + MARGIN)
        n, m = (found.normal[pair].sum(axis=0) for pair in (first, second))
        facing = n @ m <= SAME_WAY * np.linalg.norm(n) * np.linalg.norm(m)
        apart = not set(first.tolist()) & set(second.tolist())
        assert ((i, j) in edge_edge) == bool(near.all() and facing and apart)
        n_facing += (i, j) in edge_edge
    assert n_facing > 10


def test_skin_that_is_far_from_every_other_piece_is_left_out():
    _, found = candidates_of(two_bodies([0.0, 0.0, 0.1]))
    assert not found.counts.any()


def test_too_little_room_is_said_and_nothing_is_written_beyond_it():
    assert candidates_of(two_bodies([0.008, 0.007, 0.0105]), capacity=4) is None


def test_candidates_are_out_of_date_when_a_node_has_moved_by_half_the_margin():
    body, found = candidates_of(two_bodies([0.008, 0.007, 0.0105]))
    assert not have_moved(found, body, MARGIN)
    body.positions[20] += [0.49 * MARGIN, 0.0, 0.0]
    assert not have_moved(found, body, MARGIN)
    body.positions[20] += [0.02 * MARGIN, 0.0, 0.0]
    assert have_moved(found, body, MARGIN)
    body.positions[20] = np.nan
    assert have_moved(found, body, MARGIN)
