"""Boxes around the pieces of the body: skin far from all other pieces touches nothing."""

from tissue.contact.faces import NO_FACE, Faces
from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.geometry.aabb import Aabb, box_at, empty_box, overlap_within, store_box, with_point
from tissue.mesh.body import CUT, Body


@kernel
def update_piece_boxes(faces: Faces, body: Body) -> None:
    """Write the box around each piece, from its faces."""
    low, high = faces.piece_low, faces.piece_high
    for p in range(len(low)):
        store_box(low, high, p, empty_box())
    for i in range(faces.n_places):
        t = faces.face[i] // 4
        if faces.face[i] == NO_FACE or faces.piece[t] < 0:
            continue
        p = faces.piece[t]
        store_box(low, high, p, _with_face(box_at(low, high, p), body, faces.face[i]))


@kernel
def may_touch(faces: Faces, body: Body, face: int, reach: float) -> bool:
    """Whether a face is of a cut, or is skin within `reach` [m] of the box around another piece."""
    t = face // 4
    if body.links[t, face % 4] == CUT or faces.piece[t] < 0:
        return True
    box = _with_face(empty_box(), body, face)
    for p in range(len(faces.piece_low)):
        if p != faces.piece[t] and overlap_within(
            box, box_at(faces.piece_low, faces.piece_high, p), reach
        ):
            return True
    return False


@kernel
def _with_face(box: Aabb, body: Body, face: int) -> Aabb:
    """Return the smallest box that holds a box and a face of the body."""
    for k in range(4):
        if k != face % 4:
            box = with_point(box, vec3(body.positions, body.tetrahedra[face // 4, k]))
    return box
