"""The broad phase finds all pairs that are near, and updates only what moved or changed."""

import itertools

import numpy as np
import pytest

from tests import bodies, naive
from tissue import TetrahedralMesh, block
from tissue.contact.candidate_update import update_candidates
from tissue.contact.candidates import is_stale_edge, is_stale_point, new_candidates
from tissue.contact.faces import (
    collect_faces,
    count_faces,
    new_faces,
    with_pieces,
    with_room,
)
from tissue.contact.motion_bounds import new_motion_bounds
from tissue.contact.pairs import nodes_of_pair
from tissue.mesh.body import CUT, build_body
from tissue.mesh.faces import OUTWARD

pytestmark = pytest.mark.kernel

MARGIN = 0.004
CELL = 0.005


def two_bodies(offset):
    """Return two small bodies that share no node."""
    first, second = block((2, 2, 1), (0.02, 0.02, 0.01)), bodies.unit_tetrahedron()
    return TetrahedralMesh(
        np.vstack([first.positions, 0.01 * second.positions + offset]),
        np.vstack([first.tetrahedra, second.tetrahedra + len(first.positions)]),
    )


class BroadPhase:
    """The candidates of a body in two pieces, of the tetrahedra before and from number `first`."""

    def __init__(self, mesh, first=24, capacity=256):
        self.body = build_body(mesh, None, None)
        faces = with_room(new_faces(len(mesh.tetrahedra)), count_faces(self.body, True))
        faces.has_skin = 1
        piece = (np.arange(len(mesh.tetrahedra)) >= first).astype(np.int64)
        self.faces = with_pieces(faces, piece, 2)
        collect_faces(self.faces, self.body)
        n = len(mesh.positions)
        self.found, self.motion = new_candidates(n, capacity, CELL), new_motion_bounds(n, 1e-4)

    def update(self, has_changed=True):
        body = self.body
        rest = (self.faces, body, body.positions.copy(), 0.0, has_changed, MARGIN)
        return update_candidates(self.found, self.motion, *rest)

    def pairs(self, name):
        pairs = getattr(self.found, name)
        is_dead = is_stale_point if name == "point_triangle" else is_stale_edge
        rows = range(pairs.n_pairs)
        alive = [
            tuple(int(node) for node in nodes_of_pair(pairs, k))
            for k in rows
            if not is_dead(self.found, k)
        ]
        assert len(set(alive)) == len(alive)
        return set(alive)

    def near(self, reach):
        """Return the pairs between the two pieces within `reach` [m], by testing every pair."""
        x, triangles = self.body.positions, self.triangles()
        piece_of = {node: triangle[-1] for triangle in triangles for node in triangle[:3]}
        points = {
            (node, *t[:3])
            for node, t in itertools.product(piece_of, triangles)
            if piece_of[node] != t[3]
            and naive.distance_to_triangle(x[node], x[list(t[:3])]) <= reach
        }
        edges = {(a, b, t[3]) for t in triangles for a, b in sides(t) if a < b}
        return points, {
            (*p[:2], *q[:2])
            for p, q in itertools.product(edges, edges)
            if p[2] != q[2] and p[0] < q[0] and distance(x[list(p[:2])], x[list(q[:2])]) <= reach
        }

    def triangles(self):
        rows = [face for face in self.faces.face[: self.faces.n_places].tolist() if face >= 0]
        return [
            (*self.body.tetrahedra[r // 4][OUTWARD[r % 4]].tolist(), int(self.faces.piece[r // 4]))
            for r in rows
        ]


def sides(triangle):
    a, b, c = triangle[:3]
    return (a, b), (b, c), (c, a)


def distance(first, second):
    """Return the distance of two segments [m] by sampling, so at most slightly too large."""
    s = np.linspace(0.0, 1.0, 41)[:, None]
    p, q = (ends[0] + s * (ends[1] - ends[0]) for ends in (first, second))
    return float(np.linalg.norm(p[:, None] - q[None], axis=2).min())


def expect_complete(broad_phase, reach=MARGIN):
    points, edges = broad_phase.near(reach)
    assert points <= broad_phase.pairs("point_triangle")
    assert edges <= broad_phase.pairs("edge_edge")
    return len(points), len(edges)


@pytest.mark.parametrize("height", [0.0101, 0.012, 0.0135])
def test_all_near_pairs_are_found_once(height):
    broad_phase = BroadPhase(two_bodies([0.008, 0.007, height]))
    assert broad_phase.update()
    n_points, n_edges = expect_complete(broad_phase)
    assert n_points > 0 and n_edges > 0


def test_far_pairs_are_not_listed():
    broad_phase = BroadPhase(two_bodies([0.008, 0.007, 0.0101]))
    broad_phase.update()
    x = broad_phase.body.positions
    for node, *corners in broad_phase.pairs("point_triangle"):
        assert naive.distance_to_triangle(x[node], x[corners]) <= 1.1 * MARGIN
    for a, b, c, d in broad_phase.pairs("edge_edge"):
        assert distance(x[[a, b]], x[[c, d]]) <= 1.1 * MARGIN


def test_skin_that_is_far_from_every_other_piece_is_omitted():
    broad_phase = BroadPhase(two_bodies([0.0, 0.0, 0.1]))
    broad_phase.update()
    assert not broad_phase.found.node.any() and not broad_phase.pairs("edge_edge")


def test_too_little_capacity_is_reported():
    assert not BroadPhase(two_bodies([0.008, 0.007, 0.0105]), capacity=4).update()


def test_pairs_of_a_node_are_updated_once_it_has_moved_by_half_the_margin():
    broad_phase = BroadPhase(two_bodies([0.008, 0.007, 0.0105]))
    broad_phase.update()
    moved = len(broad_phase.body.positions) - 1
    for displacement, n_faces in ((0.49 * MARGIN, 0), (0.02 * MARGIN, 3)):
        broad_phase.body.positions[moved, 0] += displacement
        broad_phase.found.n_dirty = 0
        broad_phase.update(has_changed=False)
        assert broad_phase.found.n_dirty == n_faces


def test_pairs_stay_complete_while_a_piece_moves_over_another():
    """Nodes stay within half the margin of their reference, so pairs are complete to the rest."""
    broad_phase = BroadPhase(two_bodies([-0.01, 0.007, 0.0112]))
    for i in range(40):
        broad_phase.update(has_changed=False)
        if i % 5 == 0:
            expect_complete(broad_phase, 0.5 * MARGIN)
        broad_phase.body.positions[-4:, 0] += 0.2 * MARGIN
        broad_phase.found.path_since_check += 0.2 * MARGIN


def test_pairs_of_new_faces_are_added_and_those_of_removed_faces_are_dropped():
    """The tetrahedron of the second piece is removed from the list and added, as in a split."""
    broad_phase = BroadPhase(two_bodies([0.008, 0.007, 0.0105]))
    broad_phase.update()
    complete = expect_complete(broad_phase)
    body, last = broad_phase.body, len(broad_phase.body.tetrahedra) - 1
    body.links[last] = 0
    collect_faces(broad_phase.faces, body)
    broad_phase.update()
    assert not any(
        max(pair) >= len(body.positions) - 4 for pair in broad_phase.pairs("point_triangle")
    )
    body.links[last] = CUT
    collect_faces(broad_phase.faces, body)
    broad_phase.update()
    assert expect_complete(broad_phase) == complete
