"""Nonconforming faces: one large face that meets six small ones; the nodes between them hang.

The paper's scheme splits a tetrahedron and leaves its neighbour whole: the new nodes on their
common face hang. Both sides of such a face have the same link, HANGING or less, which names a row
of `Hanging.faces`. The tetrahedra around a hanging node share no faces there, so each node has a
list of the tetrahedra around it. With our own scheme no node hangs: the arrays are empty, and no
link is less than CUT. Other modules read these arrays through `is_open`, `n_behind` and `behind` of
`tissue.mesh.body`, and through `tissue.mesh.star`.
"""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays

HANGING = -3
"""Link of a face that meets faces of another size: HANGING - row. OUTER and CUT are greater."""

SMALL_FACES = 6
"""Small faces that meet a large one."""

_END = -1
"""In place of an entry at the end of a list."""


class Hanging(Arrays):
    """Faces of two sizes that meet, and the tetrahedra around each node. May be empty."""

    faces: IntArray = sized("faces", 1 + SMALL_FACES, fill=-1)
    """The tetrahedron with the large face, then those with the small ones; shape (n_rows, 7)."""
    first: IntArray = sized("nodes", fill=_END)
    """First entry of each node's list: 4 * tetrahedron + local node; shape (node capacity,)."""
    next: IntArray = sized((4, "tetrahedra"), fill=_END)
    """Next entry of the list, by entry; shape (4 * tetrahedron capacity,)."""


def nothing_hanging() -> Hanging:
    """Return empty arrays, for a scheme with which no node hangs."""
    return Hanging.new({"faces": 0, "nodes": 0, "tetrahedra": 0})


def may_hang(n_faces: int, n_nodes: int, tetrahedra: IntArray) -> Hanging:
    """Return room for that many faces, and the lists of `tetrahedra`, shape (n_tets, 4)."""
    sizes = {"faces": n_faces, "nodes": n_nodes, "tetrahedra": len(tetrahedra)}
    hanging = Hanging.new(sizes)
    list_corners(hanging, np.ascontiguousarray(tetrahedra))
    return hanging


def grown_hanging(hanging: Hanging, n_nodes: int, n_tetrahedra: int) -> Hanging:
    """Return the arrays with room for that many nodes and tetrahedra; empty ones stay empty."""
    if len(hanging.first) == 0:
        return hanging
    return hanging.grown({"nodes": n_nodes, "tetrahedra": n_tetrahedra})


@kernel
def list_corners(hanging: Hanging, tetrahedra: IntArray) -> None:
    """List the four nodes of every tetrahedron."""
    for t in range(len(tetrahedra)):
        for k in range(4):
            join_list(hanging, tetrahedra[t, k], t, k)


@kernel
def join_list(hanging: Hanging, node: int, t: int, k: int) -> None:
    """List `node` as the local node `k` of tetrahedron `t`."""
    hanging.next[4 * t + k] = hanging.first[node]
    hanging.first[node] = 4 * t + k


@kernel
def leave_list(hanging: Hanging, node: int, t: int) -> None:
    """Remove tetrahedron `t` from those around `node`."""
    before = _END
    corner = hanging.first[node]
    while corner != _END and corner // 4 != t:
        before = corner
        corner = hanging.next[corner]
    if corner == _END:
        return
    if before == _END:
        hanging.first[node] = hanging.next[corner]
    else:
        hanging.next[before] = hanging.next[corner]


@kernel
def listed_tetrahedra(hanging: Hanging, node: int, out: IntArray, room: int) -> int:
    """Write the tetrahedra around `node` to `out`, at most `room`; return how many."""
    n = 0
    corner = hanging.first[node]
    while corner != _END and n < room:
        out[n] = corner // 4
        n += 1
        corner = hanging.next[corner]
    return n
