"""Boxes around the pieces of the body: skin far from all other pieces touches nothing."""

from tissue.contact.faces import NO_FACE, Faces
from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.geometry.aabb import Aabb, box_at, empty_box, overlap_within, store_box, with_point
from tissue.mesh.body import CUT, Body


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
