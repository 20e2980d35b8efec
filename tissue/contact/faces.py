"""The boundary faces that may touch something, kept in step with the mesh as it is cut.

While the body is whole these are the faces of cuts; once it is in pieces, the skin too.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.mesh.body import CUT, OUTER, Body, grown
from tissue.mesh.changes import Change

ROOM_FOR_FACES = 1 << 14
"""Faces that there is room for at first: those of several cuts, so that few steps must grow it."""

NONE = -1
"""In place of a face that is no more."""

N_FACES, WITH_SKIN, N_FREE = 0, 1, 2
"""Places in `Faces.counts`."""


class Faces(Arrays):
    """The faces, in no particular order, but the same in every run. Each keeps its place."""

    face: IntArray
    """4 * tetrahedron + local face, or NONE; shape (capacity,)."""
    generation: IntArray
    """How often what is in each place has changed, shape (capacity,)."""
    free: IntArray
    """Places that are free again, shape (capacity,)."""
    place: IntArray
    """Where in `face` each face is, or -1; shape (tetrahedron capacity, 4)."""
    piece: IntArray
    """The piece that each tetrahedron is in, or -1 where it is younger than the last look for
    pieces; shape (tetrahedron capacity,)."""
    low: FloatArray
    """Scratch: lowest corner of each piece [m], shape (n_pieces, 3)."""
    high: FloatArray
    """Scratch: highest corner of each piece [m], shape (n_pieces, 3)."""
    counts: IntArray
    """How many places are in use or free again, whether skin is among the faces, and how many
    places are free again; shape (3,)."""


def new_faces(n_tetrahedra: int) -> Faces:
    """Return no faces, of a body with room for that many tetrahedra."""
    return Faces(
        face=np.zeros(ROOM_FOR_FACES, np.int64),
        generation=np.zeros(ROOM_FOR_FACES, np.int64),
        free=np.zeros(ROOM_FOR_FACES, np.int64),
        place=np.full((n_tetrahedra, 4), -1, np.int64),
        piece=np.full(n_tetrahedra, -1, np.int64),
        low=np.zeros((1, 3)),
        high=np.zeros((1, 3)),
        counts=np.zeros(3, np.int64),
    )


def grown_faces(faces: Faces, n_tetrahedra: int) -> Faces:
    """Return the faces with room for that many tetrahedra."""
    return faces.replaced(
        place=grown(faces.place, n_tetrahedra, -1), piece=grown(faces.piece, n_tetrahedra, -1)
    )


def with_room(faces: Faces, n_more: int) -> Faces:
    """Return the faces with room for `n_more` of them."""
    needed = int(faces.counts[N_FACES]) + n_more
    if needed <= len(faces.face):
        return faces
    of_faces = ("face", "generation", "free")
    return faces.replaced(**{name: grown(getattr(faces, name), 2 * needed) for name in of_faces})


@kernel
def renew_faces(faces: Faces, body: Body, change: Change) -> None:
    """Take in and leave out faces of the tetrahedra that changed. Room: 4 for each of them."""
    for i in range(change.n_dirty):
        _renew(faces, body, change.dirty[i])


@kernel
def count_faces(body: Body, with_skin: bool) -> int:
    """Return how many faces there are to collect."""
    n = 0
    for t in range(body.n_tetrahedra):
        for f in range(4):
            link = body.links[t, f]
            if link == CUT or (with_skin and link == OUTER):
                n += 1
    return n


@kernel
def collect_faces(faces: Faces, body: Body) -> None:
    """Look at every tetrahedron of the body."""
    for t in range(body.n_tetrahedra):
        _renew(faces, body, t)


@kernel
def _renew(faces: Faces, body: Body, t: int) -> None:
    counts = faces.counts
    for f in range(4):
        link = body.links[t, f]
        wanted = link == CUT or (link == OUTER and counts[WITH_SKIN] == 1)
        at = faces.place[t, f]
        if wanted and at < 0:
            at = _free_place(faces)
            faces.face[at] = 4 * t + f
            faces.place[t, f] = at
        elif not wanted and at >= 0:
            faces.face[at] = NONE
            faces.place[t, f] = -1
            faces.free[counts[N_FREE]] = at
            counts[N_FREE] += 1
        if at >= 0:
            faces.generation[at] += 1


@kernel
def _free_place(faces: Faces) -> int:
    counts = faces.counts
    if counts[N_FREE] > 0:
        counts[N_FREE] -= 1
        return faces.free[counts[N_FREE]]
    counts[N_FACES] += 1
    return counts[N_FACES] - 1


@kernel
def is_cut(faces: Faces, body: Body, at: int) -> bool:
    """Whether the face in that place is one of a cut."""
    face = faces.face[at]
    return body.links[face // 4, face % 4] == CUT


def in_pieces(faces: Faces, piece: IntArray, n_pieces: int) -> Faces:
    """Return the faces of a body that is in these pieces: that of each tetrahedron, (n_tets,)."""
    faces.piece[: len(piece)] = piece
    return faces.replaced(low=np.zeros((n_pieces, 3)), high=np.zeros((n_pieces, 3)))


@kernel
def measure_pieces(faces: Faces, body: Body) -> None:
    """Write the corners of each piece, from its faces."""
    for p in range(len(faces.low)):
        for x in range(3):
            faces.low[p, x] = np.inf
            faces.high[p, x] = -np.inf
    for i in range(faces.counts[N_FACES]):
        t = faces.face[i] // 4
        if faces.face[i] == NONE or faces.piece[t] < 0:
            continue
        p = faces.piece[t]
        for k in range(4):
            if k != faces.face[i] % 4:
                node = body.tetrahedra[t, k]
                for x in range(3):
                    faces.low[p, x] = min(faces.low[p, x], body.positions[node, x])
                    faces.high[p, x] = max(faces.high[p, x], body.positions[node, x])


@kernel
def may_touch(faces: Faces, body: Body, face: int, reach: float) -> bool:
    """Whether a face is one of a cut, or skin within reach of the box around another piece."""
    t = face // 4
    if body.links[t, face % 4] == CUT or faces.piece[t] < 0:
        return True
    for p in range(len(faces.low)):
        if p != faces.piece[t] and _is_near(faces, body, face, p, reach):
            return True
    return False


@kernel
def _is_near(faces: Faces, body: Body, face: int, p: int, reach: float) -> bool:
    for x in range(3):
        low = np.inf
        high = -np.inf
        for k in range(4):
            if k != face % 4:
                at = body.positions[body.tetrahedra[face // 4, k], x]
                low = min(low, at)
                high = max(high, at)
        if low > faces.high[p, x] + reach or high < faces.low[p, x] - reach:
            return False
    return True
