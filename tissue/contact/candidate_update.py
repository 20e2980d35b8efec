"""Update of the candidates: only what moved or changed is paired again.

A cut, or a lip that the blade drags along, costs its neighbourhood and not the body.
"""

import math

from tissue.contact.candidates import (
    Candidates,
    is_marked,
    is_stale_edge,
    is_stale_point,
    mark_node,
)
from tissue.contact.faces import NO_FACE, Faces, is_face_of_cut
from tissue.contact.feature_edges import face_across, is_ridge
from tissue.contact.motion_bounds import MotionBounds, begin_measuring
from tissue.contact.pairing import owns_edge, pair_dirty
from tissue.contact.pairs import CLOSING, drop_pair
from tissue.contact.piece_boxes import may_touch, update_piece_boxes
from tissue.contact.point_triangle import rim_width
from tissue.contact.spatial_hash import remove_box
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, store, sub, vec3
from tissue.geometry.aabb import Aabb, box_at, store_box, widened, with_point
from tissue.mesh.body import Body
from tissue.mesh.faces import OUTWARD

LARGEST_MOVE = 1.0
"""Displacement in a Runge-Kutta step [m] above which a body has exploded, and no contacts are
searched for; the cells of its nodes could not be counted."""

PIECE_PATH = 4.0
"""Path of nodes, in margins, after which it is tested again which skin is near another piece.
Larger: more skin is paired; smaller: all skin is tested more often."""


@kernel
def moves_are_plausible(body: Body, start: FloatArray) -> bool:
    """Whether no node has moved by more than `LARGEST_MOVE`, or to nowhere, since `start`."""
    for node in range(body.n_nodes):
        d = sub(vec3(body.positions, node), vec3(start, node))
        if not dot(d, d) <= LARGEST_MOVE * LARGEST_MOVE:
            return False
    return True


@kernel
def update_candidates(
    candidates: Candidates,
    motion: MotionBounds,
    faces: Faces,
    body: Body,
    start: FloatArray,
    move: float,
    has_changed: bool,
    margin: float,
) -> bool:
    """Pair again what has moved or changed; return False if there is no room.

    Args:
        candidates: Written.
        motion: Nodes of new faces are measured from now on.
        faces: The faces that may touch.
        body: Where the nodes are.
        start: Where they were before the Runge-Kutta step [m], shape (node capacity, 3).
        move: Largest displacement in that step [m].
        has_changed: Whether faces have changed since the last call.
        margin: Distance up to which faces are paired [m].
    """
    candidates.path_since_check += move
    if not candidates.path_since_check <= PIECE_PATH * margin:
        update_piece_boxes(faces, body, margin)
        candidates.path_since_check = 0.0
        has_changed = True
    candidates.n_updates += 1
    if not _mark_moved(candidates, body, margin) and not has_changed:
        return True
    if faces.n_places > len(candidates.triangle):
        return False
    _drop_stale_pairs(candidates)
    _list_dirty(candidates, faces, body, (1.0 + 2.0 * PIECE_PATH) * margin)
    for i in range(candidates.n_dirty):
        _remove_face(candidates, faces, candidates.dirty[i])
    for i in range(candidates.n_dirty):
        _add_face(candidates, motion, faces, body, candidates.dirty[i])
    move = max(move, _update_references(candidates, body, start))
    for i in range(candidates.n_dirty):
        _update_boxes(candidates, faces, body, candidates.dirty[i])
    return pair_dirty(candidates, faces, body, margin + CLOSING * move)


@kernel
def _mark_moved(candidates: Candidates, body: Body, margin: float) -> bool:
    """Mark the nodes that have left their reference by half the margin; return whether any has."""
    most = 0.25 * margin * margin
    any_moved = False
    for i in range(candidates.n_nodes):
        node = candidates.node[i]
        d = sub(vec3(body.positions, node), vec3(candidates.reference, node))
        if not dot(d, d) <= most:
            mark_node(candidates, node)
            any_moved = True
    return any_moved


@kernel
def _has_marked(candidates: Candidates, at: int) -> bool:
    """Whether a node of the triangle in place `at` is marked."""
    node = candidates.triangle
    return (
        is_marked(candidates, node[at, 0])
        or is_marked(candidates, node[at, 1])
        or is_marked(candidates, node[at, 2])
    )


@kernel
def _drop_stale_pairs(candidates: Candidates) -> None:
    """Drop pairs that are out of date, where half the room is taken."""
    pairs = candidates.point_triangle
    if 2 * pairs.n_pairs > len(pairs.wake):
        for k in range(pairs.n_pairs - 1, -1, -1):
            if is_stale_point(candidates, k):
                drop_pair(pairs, k)
    pairs = candidates.edge_edge
    if 2 * pairs.n_pairs > len(pairs.wake):
        for k in range(pairs.n_pairs - 1, -1, -1):
            if is_stale_edge(candidates, k):
                drop_pair(pairs, k)


@kernel
def _list_dirty(candidates: Candidates, faces: Faces, body: Body, reach: float) -> None:
    """List the faces that are new, changed or moved, or that came near another piece or left it."""
    dirty = candidates.dirty
    candidates.n_dirty = 0
    has_checked_pieces = candidates.path_since_check == 0.0
    for at in range(faces.n_places):
        has_changed = candidates.seen_generation[at] != faces.generation[at]
        if has_changed or has_checked_pieces:
            face = faces.face[at]
            is_wanted = face != NO_FACE and may_touch(faces, body, at, reach, False)
            has_changed = has_changed or is_wanted != (candidates.is_active[at] == 1)
            candidates.should_be_active[at] = is_wanted
        if has_changed or (candidates.is_active[at] == 1 and _has_marked(candidates, at)):
            _list_face(candidates, at)
    for i in range(candidates.n_dirty):
        at = dirty[i]
        if candidates.seen_generation[at] != faces.generation[at] and faces.face[at] != NO_FACE:
            _list_neighbours(candidates, faces, body, faces.face[at])


@kernel
def _list_face(candidates: Candidates, at: int) -> None:
    """Add the face in place `at` to the dirty ones."""
    candidates.dirty[candidates.n_dirty] = at
    candidates.n_dirty += 1
    candidates.listed[at] = candidates.n_updates


@kernel
def _list_neighbours(candidates: Candidates, faces: Faces, body: Body, face: int) -> None:
    """List the faces beside one that changed, too: their edges may have become ridges or flat."""
    for k in range(3):
        other = face_across(body, face // 4, face % 4, k)[0]
        at = faces.place[other // 4, other % 4] if other >= 0 else -1
        if (
            at >= 0
            and candidates.is_active[at] == 1
            and candidates.listed[at] != candidates.n_updates
        ):
            _list_face(candidates, at)


@kernel
def _remove_face(candidates: Candidates, faces: Faces, at: int) -> None:
    """Remove a face from the grids; and from the counts of its nodes, unless it only moved."""
    candidates.generation[at] += 1
    if candidates.is_active[at] == 0:
        return
    box = box_at(candidates.triangle_low, candidates.triangle_high, at)
    remove_box(candidates.triangles, at, box)
    for k in range(3):
        edge = 3 * at + k
        if candidates.has_edge[edge] == 1:
            edge_box = box_at(candidates.edge_low, candidates.edge_high, edge)
            remove_box(candidates.edges, edge, edge_box)
    only_moved = candidates.seen_generation[at] == faces.generation[at]
    if only_moved and candidates.should_be_active[at] == 1:
        return
    candidates.is_active[at] = 0
    for k in range(3):
        node = candidates.triangle[at, k]
        candidates.n_around[node] -= 1
        candidates.n_cut_around[node] -= candidates.is_of_cut[at]


@kernel
def _add_face(
    candidates: Candidates, motion: MotionBounds, faces: Faces, body: Body, at: int
) -> None:
    """Make the face in place `at` active, if it should be and is not yet."""
    candidates.seen_generation[at] = faces.generation[at]
    if candidates.should_be_active[at] == 0 or candidates.is_active[at] == 1:
        return
    candidates.is_active[at] = 1
    candidates.is_of_cut[at] = is_face_of_cut(faces, body, at)
    t, f = faces.face[at] // 4, faces.face[at] % 4
    for k in range(3):
        node = body.tetrahedra[t, OUTWARD[f, k]]
        candidates.triangle[at, k] = node
        if candidates.place[node] < 0:
            candidates.place[node] = candidates.n_nodes
            candidates.node[candidates.n_nodes] = node
            candidates.n_nodes += 1
            begin_measuring(motion, body, node)
            candidates.n_around[node] = 0
            candidates.n_cut_around[node] = 0
            mark_node(candidates, node)
        elif candidates.n_cut_around[node] == 0 and candidates.is_of_cut[at] == 1:
            mark_node(candidates, node)
        candidates.n_around[node] += 1
        candidates.n_cut_around[node] += candidates.is_of_cut[at]


@kernel
def _update_references(candidates: Candidates, body: Body, start: FloatArray) -> float:
    """Move the references of marked nodes to where they are, and remove nodes without faces.

    Return the largest displacement of a marked node since `start` [m].
    """
    points, reference = candidates.points, candidates.reference
    most = 0.0
    i = 0
    while i < candidates.n_nodes:
        node = candidates.node[i]
        if candidates.n_around[node] > 0:
            if is_marked(candidates, node):
                remove_box(points, node, box_at(reference, reference, node))
                candidates.node_generation[node] += 1
                store(reference, node, vec3(body.positions, node))
                moved = sub(vec3(reference, node), vec3(start, node))
                most = max(most, math.sqrt(dot(moved, moved)))
            i += 1
            continue
        remove_box(points, node, box_at(reference, reference, node))
        candidates.node_generation[node] += 1
        candidates.place[node] = -1
        candidates.n_nodes -= 1
        last = candidates.node[candidates.n_nodes]
        candidates.node[i] = last
        if last != node:
            candidates.place[last] = i
    return most


@kernel
def _update_boxes(candidates: Candidates, faces: Faces, body: Body, at: int) -> None:
    """Write the boxes of a triangle and its edges, and which of its edges are to be paired."""
    if candidates.is_active[at] == 0:
        return
    t, f = faces.face[at] // 4, faces.face[at] % 4
    is_skin = candidates.is_of_cut[at] == 0
    for k in range(3):
        has_edge = owns_edge(candidates, at, k) and (is_skin or is_ridge(body, t, f, k))
        candidates.has_edge[3 * at + k] = 1 if has_edge else 0
    x, triangle = candidates.reference, candidates.triangle
    a, b, c = vec3(x, triangle[at, 0]), vec3(x, triangle[at, 1]), vec3(x, triangle[at, 2])
    box = widened(with_point(with_point(Aabb(a, a), b), c), rim_width(a, b, c))
    store_box(candidates.triangle_low, candidates.triangle_high, at, box)
    low, high = candidates.edge_low, candidates.edge_high
    store_box(low, high, 3 * at, with_point(Aabb(a, a), b))
    store_box(low, high, 3 * at + 1, with_point(Aabb(b, b), c))
    store_box(low, high, 3 * at + 2, with_point(Aabb(c, c), a))
