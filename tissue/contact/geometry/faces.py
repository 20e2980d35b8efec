"""`Faces`: the boundary faces that may touch something, updated as the mesh is cut.

While the body is whole these are the faces of cuts; once it is in pieces or near itself, the skin
too. Boxes around the pieces show which skin is far from all other pieces, and so touches nothing.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, cross, dot, store, sub, vec3
from tissue.geometry.aabb import Aabb, box_at, empty_box, overlap_within, store_box, with_point
from tissue.mesh.body import CUT, OUTER, Body, grown
from tissue.mesh.changes import Change
from tissue.mesh.faces import OUTWARD
from tissue.mesh.pieces import label_pieces

_ROOM_FOR_FACES = 1 << 14
"""Faces that there is room for at first: those of several cuts, so that few steps must grow it."""

NO_FACE = -1
"""Entry of `Faces.face` in a place that is free."""

Nodes = tuple[int, int, int, int]
"""A node and the corners of a triangle, or the ends of two edges."""


class Faces(Arrays):
    """The faces, in no particular order, but the same in every run. Each keeps its place."""

    n_places: IntCell
    """Number of places that are in use or free again."""
    n_free: IntCell
    """Number of places that are free again."""
    has_skin: IntCell
    """1 if skin is among the faces, else 0."""
    face: IntArray
    """4 * tetrahedron + local face, or NO_FACE; shape (capacity,)."""
    node: IntArray
    """Corners of each face, counter-clockwise seen from outside, and the fourth node of its
    tetrahedron; shape (capacity, 4)."""
    generation: IntArray
    """Number of changes of each place, shape (capacity,)."""
    free: IntArray
    """Places that are free again, shape (capacity,)."""
    place: IntArray
    """Where in `face` each face is, or -1; shape (tetrahedron capacity, 4)."""
    piece: IntArray
    """Piece that each tetrahedron is in, or -1 where it is younger than the last search for pieces;
    shape (tetrahedron capacity,)."""
    piece_low: FloatArray
    """Lowest corner of the box around each piece [m], shape (n_pieces, 3)."""
    piece_high: FloatArray
    """Highest corner of the box around each piece [m], shape (n_pieces, 3)."""
    is_piece_far: IntArray
    """1 if no other piece was near a piece when the boxes were made, else 0; shape (n_pieces,)."""


def new_faces(n_tetrahedra: int) -> Faces:
    """Return no faces, of a body with room for `n_tetrahedra`."""
    return Faces(
        n_places=0,
        n_free=0,
        has_skin=0,
        face=np.zeros(_ROOM_FOR_FACES, np.int64),
        node=np.zeros((_ROOM_FOR_FACES, 4), np.int64),
        generation=np.zeros(_ROOM_FOR_FACES, np.int64),
        free=np.zeros(_ROOM_FOR_FACES, np.int64),
        place=np.full((n_tetrahedra, 4), -1, np.int64),
        piece=np.full(n_tetrahedra, -1, np.int64),
        piece_low=np.zeros((1, 3)),
        piece_high=np.zeros((1, 3)),
        is_piece_far=np.zeros(1, np.int64),
    )


def grown_faces(faces: Faces, n_tetrahedra: int) -> Faces:
    """Return the faces, of a body with room for `n_tetrahedra`."""
    return faces.replaced(
        place=grown(faces.place, n_tetrahedra, -1), piece=grown(faces.piece, n_tetrahedra, -1)
    )


def with_room(faces: Faces, n_more: int) -> Faces:
    """Return the faces with room for `n_more` of them."""
    needed = faces.n_places + n_more
    if needed <= len(faces.face):
        return faces
    of_faces = ("face", "node", "generation", "free")
    return faces.replaced(**{name: grown(getattr(faces, name), 2 * needed) for name in of_faces})


def _with_pieces(faces: Faces, piece: IntArray, n_pieces: int) -> Faces:
    """Return the faces of a body in `n_pieces`; `piece` is that of each tetrahedron, (n_tets,)."""
    faces.piece[: len(piece)] = piece
    return faces.replaced(
        piece_low=np.zeros((n_pieces, 3)),
        piece_high=np.zeros((n_pieces, 3)),
        is_piece_far=np.zeros(n_pieces, np.int64),
    )


def with_found_pieces(faces: Faces, body: Body) -> Faces | None:
    """Return the faces of a body in several pieces, skin among them.

    None where it is one piece and skin is not among them.
    """
    piece, n_pieces = _labelled(body)
    if n_pieces == 1 and not faces.has_skin:
        return None
    return _with_skin(_with_pieces(faces, piece, n_pieces), body)


def with_skin(faces: Faces, body: Body) -> Faces:
    """Return the faces, skin among them, whether the body is in pieces or not."""
    return faces if faces.has_skin else _with_skin(_with_pieces(faces, *_labelled(body)), body)


def _labelled(body: Body) -> tuple[IntArray, int]:
    """Return the piece that each tetrahedron is in, shape (n_tets,), and how many there are."""
    piece, queue = np.empty((2, body.n_tetrahedra), np.int64)
    return piece, label_pieces(body, piece, queue)


def _with_skin(faces: Faces, body: Body) -> Faces:
    """Return the faces with the skin among them; their pieces are known."""
    if not faces.has_skin:
        faces = with_room(faces, _count_faces(body, True))
        faces.has_skin = 1
        _collect_faces(faces, body)
    return faces


@kernel
def has_room_for_changed(faces: Faces, change: Change) -> bool:
    """Return whether there is room for the faces of the tetrahedra that changed, 4 for each."""
    return bool(faces.n_places + 4 * change.n_dirty <= len(faces.face))


@kernel
def update_changed_faces(faces: Faces, body: Body, change: Change) -> None:
    """Add and remove faces of the tetrahedra that changed. Room: 4 for each of them."""
    for i in range(change.n_dirty):
        _update_tetrahedron(faces, body, change.dirty[i])


@kernel
def _count_faces(body: Body, with_skin: bool) -> int:
    """Return how many faces there are to collect."""
    n = 0
    for t in range(body.n_tetrahedra):
        for f in range(4):
            link = body.links[t, f]
            if link == CUT or (with_skin and link == OUTER):
                n += 1
    return n


@kernel
def _collect_faces(faces: Faces, body: Body) -> None:
    """Add and remove faces of every tetrahedron of the body."""
    for t in range(body.n_tetrahedra):
        _update_tetrahedron(faces, body, t)


@kernel
def _update_tetrahedron(faces: Faces, body: Body, t: int) -> None:
    """Add and remove faces of tetrahedron `t`."""
    for f in range(4):
        link = body.links[t, f]
        wanted = link == CUT or (link == OUTER and faces.has_skin == 1)
        at = faces.place[t, f]
        if wanted and at < 0:
            at = _free_place(faces)
            faces.face[at] = 4 * t + f
            faces.place[t, f] = at
        elif not wanted and at >= 0:
            faces.face[at] = NO_FACE
            faces.place[t, f] = -1
            faces.free[faces.n_free] = at
            faces.n_free += 1
        if at >= 0:
            faces.generation[at] += 1
            for k in range(3):
                faces.node[at, k] = body.tetrahedra[t, OUTWARD[f, k]]
            faces.node[at, 3] = body.tetrahedra[t, f]


@kernel
def _free_place(faces: Faces) -> int:
    """Return a place for a new face."""
    if faces.n_free > 0:
        faces.n_free -= 1
        return int(faces.free[faces.n_free])
    faces.n_places += 1
    return faces.n_places - 1


@kernel
def is_face_of_cut(faces: Faces, body: Body, at: int) -> bool:
    """Whether the face in place `at` was made by a cut."""
    face = faces.face[at]
    return bool(body.links[face // 4, face % 4] == CUT)


@kernel
def update_piece_boxes(faces: Faces, body: Body, reach: float) -> None:
    """Write the box around each piece, from its faces, and which have none within `reach` [m]."""
    low, high = faces.piece_low, faces.piece_high
    for p in range(len(low)):
        store_box(low, high, p, empty_box())
    box, last = empty_box(), -1
    for i in range(faces.n_places):
        if faces.face[i] == NO_FACE:
            continue
        p = faces.piece[faces.face[i] // 4]
        if p < 0:
            continue
        # Faces of a piece are mostly one after the other.
        if p != last:
            if last >= 0:
                store_box(low, high, last, box)
            box, last = box_at(low, high, p), p
        for k in range(3):
            box = with_point(box, vec3(body.positions, faces.node[i, k]))
    if last >= 0:
        store_box(low, high, last, box)
    for p in range(len(low)):
        is_near = _is_near_another(faces, p, box_at(low, high, p), reach)
        faces.is_piece_far[p] = 0 if is_near else 1


@kernel
def may_touch(faces: Faces, body: Body, at: int, reach: float, is_far_known: bool) -> bool:
    """Whether a face is of a cut, or is skin within `reach` [m] of the box around another piece.

    Args:
        faces: The faces, and the boxes around pieces.
        body: Where the nodes are.
        at: Place of the face.
        reach: Distance from a box.
        is_far_known: Whether `faces.is_piece_far` says where skin is now, to no less reach.
    """
    t = faces.face[at] // 4
    piece = faces.piece[t]
    if piece < 0 or body.links[t, faces.face[at] % 4] == CUT:
        return True
    if is_far_known and faces.is_piece_far[piece] == 1:
        return False
    box = empty_box()
    for k in range(3):
        box = with_point(box, vec3(body.positions, faces.node[at, k]))
    return _is_near_another(faces, piece, box, reach)


@kernel
def _is_near_another(faces: Faces, piece: int, box: Aabb, reach: float) -> bool:
    """Whether a box is within `reach` [m] of that around another piece than its own."""
    for p in range(len(faces.piece_low)):
        if p != piece and overlap_within(box, box_at(faces.piece_low, faces.piece_high, p), reach):
            return True
    return False


@kernel
def update_normals(
    faces: Faces, body: Body, normal: FloatArray, inverted_step: IntArray, step: int
) -> None:
    """Write the normals of nodes, and record the nodes of tetrahedra that are inverted.

    Args:
        faces: The faces that may touch.
        body: Where the nodes are.
        normal: Outward normal of the nodes of faces, weighted by area [m2]; written.
        inverted_step: When each node was last seen to be of an inverted tetrahedron; written.
        step: Now, as it is written there.
    """
    x = body.positions
    nothing = Vec3(0.0, 0.0, 0.0)
    for at in range(faces.n_places):
        if faces.face[at] != NO_FACE:
            for k in range(3):
                store(normal, faces.node[at, k], nothing)
    for at in range(faces.n_places):
        if faces.face[at] == NO_FACE:
            continue
        i, j, k = faces.node[at, 0], faces.node[at, 1], faces.node[at, 2]
        behind = faces.node[at, 3]
        a = vec3(x, i)
        area = cross(sub(vec3(x, j), a), sub(vec3(x, k), a))
        store(normal, i, add(vec3(normal, i), area))
        store(normal, j, add(vec3(normal, j), area))
        store(normal, k, add(vec3(normal, k), area))
        if not dot(area, sub(a, vec3(x, behind))) > 0.0:
            for node in (i, j, k, behind):
                inverted_step[node] = step


@kernel
def area_at_rest(body: Body, a: int, b: int, c: int) -> Vec3:
    """Return the normal of a triangle of nodes at rest, times twice its area [m2]."""
    p = vec3(body.rest, a)
    return cross(sub(vec3(body.rest, b), p), sub(vec3(body.rest, c), p))


@kernel
def has_inverted(inverted_step: IntArray, step: int, nodes: Nodes) -> bool:
    """Whether one of the nodes was seen at `step` to be of an inverted tetrahedron."""
    a, b, c, d = nodes
    return bool(
        inverted_step[a] == step
        or inverted_step[b] == step
        or inverted_step[c] == step
        or inverted_step[d] == step
    )
