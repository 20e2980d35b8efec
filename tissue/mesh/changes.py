"""What a cut step changed in a mesh, the nodes that it touched, and their highest frequency."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

CHANGES = 1 << 15
"""Changes that one pass of a cut step can note; see PASS_NODES."""


class Change(Arrays):
    """What one pass of a cut step did."""

    flagged: IntArray
    """Nodes that came to lie on the sheet, shape (CHANGES,)."""
    dirty: IntArray
    """Tetrahedra that were split or got another node, shape (CHANGES,); may repeat."""
    faces: IntArray
    """Faces cut: tetrahedron, face, tetrahedron, face; shape (CHANGES, 4)."""
    counts: IntArray
    """How many of each, and whether there was too little room; shape (4,)."""
    area: FloatArray
    """Area of the faces cut, at rest, since the body was made [m2]; shape (1,)."""


N_FLAGGED, N_DIRTY, N_FACES, FULL = 0, 1, 2, 3
"""Places in `Change.counts`."""


def new_change() -> Change:
    """Return an empty list of changes."""
    return Change(
        flagged=np.zeros(CHANGES, np.int64),
        dirty=np.zeros(CHANGES, np.int64),
        faces=np.zeros((CHANGES, 4), np.int64),
        counts=np.zeros(4, np.int64),
        area=np.zeros(1),
    )


@kernel
def clear_changes(change: Change) -> None:
    """Forget what the last pass did."""
    for i in range(len(change.counts)):
        change.counts[i] = 0


@kernel
def note_dirty(change: Change, t: int) -> None:
    """Note that tetrahedron `t` was changed."""
    if change.counts[N_DIRTY] < len(change.dirty):
        change.dirty[change.counts[N_DIRTY]] = t
        change.counts[N_DIRTY] += 1


@kernel
def touched_nodes(body: Body, change: Change, visits: Visits, out: IntArray) -> int:
    """Write the nodes of the changed tetrahedra to `out`, each once; return how many."""
    visits.epoch[0] += 1
    epoch = visits.epoch[0]
    n = 0
    for i in range(change.counts[N_DIRTY]):
        for k in range(4):
            node = body.tetrahedra[change.dirty[i], k]
            if visits.nodes[node] != epoch:
                visits.nodes[node] = epoch
                out[n] = node
                n += 1
    return n


@kernel
def largest_frequency(body: Body, frequency_squared: FloatArray, nodes: IntArray, n: int) -> float:
    """Largest bound on w^2 [1/s2] among the first `n` of `nodes` that can move."""
    largest = 0.0
    for i in range(n):
        if not body.fixed[nodes[i]]:
            largest = max(largest, frequency_squared[nodes[i]])
    return largest
