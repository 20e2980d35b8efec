"""Who is behind a face, and around a node, where one large face meets six small ones.

The paper's scheme splits a tetrahedron and leaves its neighbour whole: the new nodes on their
common face hang. Both sides of such a face bear the same link, HANGING or less, which names a row
of `Hanging.faces`. The tetrahedra around a hanging node share no faces there, so that each node
keeps a list of the tetrahedra around it. Our own scheme leaves nothing hanging: the arrays are
empty, and no link is less than CUT.
"""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays

HANGING = -3
"""Link of a face that meets faces of another size: HANGING - row. OUTER and CUT are more."""

SMALL_FACES = 6
"""Small faces that meet a large one."""

END = -1
"""Of a list."""


class Hanging(Arrays):
    """Faces of two sizes that meet, and the tetrahedra around each node. May be empty."""

    faces: IntArray
    """The tetrahedron with the large face, then those with the small ones; shape (n_rows, 7)."""
    first: IntArray
    """Where the list of a node begins: 4 * tetrahedron + local node; shape (node capacity,)."""
    next: IntArray
    """What follows in the list of that local node, shape (4 * tetrahedron capacity,)."""


def nothing_hanging() -> Hanging:
    """Return empty arrays, for a scheme that leaves nothing hanging."""
    return Hanging(
        faces=np.zeros((0, 1 + SMALL_FACES), np.int64),
        first=np.zeros(0, np.int64),
        next=np.zeros(0, np.int64),
    )


def may_hang(n_faces: int, n_nodes: int, tetrahedra: IntArray) -> Hanging:
    """Return room for that many faces, and the lists of `tetrahedra`, shape (n_tets, 4)."""
    hanging = Hanging(
        faces=np.full((n_faces, 1 + SMALL_FACES), -1),
        first=np.full(n_nodes, END),
        next=np.full(tetrahedra.size, END),
    )
    list_corners(hanging, np.ascontiguousarray(tetrahedra))
    return hanging


def grown_hanging(hanging: Hanging, n_nodes: int, n_tetrahedra: int) -> Hanging:
    """Return the arrays with room for that many nodes and tetrahedra; empty ones stay empty."""
    if len(hanging.first) == 0:
        return hanging
    first, following = np.full(n_nodes, END), np.full(4 * n_tetrahedra, END)
    first[: len(hanging.first)] = hanging.first
    following[: len(hanging.next)] = hanging.next
    return hanging.replaced(first=first, next=following)


@kernel
def is_open(link: int) -> bool:
    """Whether nothing is behind a face: it is on the skin or on a cut."""
    return HANGING < link < 0


@kernel
def n_behind(hanging: Hanging, t: int, link: int) -> int:
    """How many tetrahedra are behind a face of `t` that bears `link`: none, one or six."""
    if link >= 0:
        return 1
    if link > HANGING:
        return 0
    return SMALL_FACES if hanging.faces[HANGING - link, 0] == t else 1


@kernel
def behind(hanging: Hanging, t: int, link: int, i: int) -> int:
    """Number `i` of the tetrahedra behind a face of `t` that bears `link`."""
    if link >= 0:
        return link // 4
    row = HANGING - link
    return hanging.faces[row, 1 + i if hanging.faces[row, 0] == t else 0]


@kernel
def list_corners(hanging: Hanging, tetrahedra: IntArray) -> None:
    """Note the four nodes of every tetrahedron."""
    for t in range(len(tetrahedra)):
        for k in range(4):
            join_list(hanging, tetrahedra[t, k], t, k)


@kernel
def join_list(hanging: Hanging, node: int, t: int, k: int) -> None:
    """Note that `node` is the local node `k` of tetrahedron `t`."""
    hanging.next[4 * t + k] = hanging.first[node]
    hanging.first[node] = 4 * t + k


@kernel
def leave_list(hanging: Hanging, node: int, t: int) -> None:
    """Note that tetrahedron `t` is no longer around `node`."""
    before = END
    corner = hanging.first[node]
    while corner != END and corner // 4 != t:
        before = corner
        corner = hanging.next[corner]
    if corner == END:
        return
    if before == END:
        hanging.first[node] = hanging.next[corner]
    else:
        hanging.next[before] = hanging.next[corner]
