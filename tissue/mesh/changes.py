"""What a cut step changed in a mesh: nodes put on the sheet, tetrahedra changed, faces cut."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

CHANGES = 1 << 15
"""Changes that one pass of a cut step can note; `PASS_NODES` of cutting keeps within it."""


class Change(Arrays):
    """What one pass of a cut step changed."""

    flagged: IntArray
    """Nodes that came to lie on the sheet, shape (CHANGES,)."""
    dirty: IntArray
    """Tetrahedra that were split or got another node, with repeats; shape (CHANGES,)."""
    faces: IntArray
    """Faces cut, each as tetrahedron, local face, tetrahedron, local face; shape (CHANGES, 4)."""
    children: IntArray
    """Tetrahedra that were appended, and the tetrahedron that each is a part of: in order, so that
    a parent stands before its children; shape (CHANGES, 2)."""
    n_flagged: IntCell
    """Number of entries in `flagged`."""
    n_dirty: IntCell
    """Number of entries in `dirty`."""
    n_faces: IntCell
    """Number of entries in `faces`."""
    n_children: IntCell
    """Number of entries in `children`."""
    is_full: IntCell
    """1 if the pass stopped for want of room, else 0."""
    lost_spin: FloatArray
    """Angular momentum that the masses at nodes lost by splits, over the density [m5/s], shape
    (3,)."""
    area: FloatCell
    """Area of the faces cut, at rest, one side of each, since the body was made [m2]."""
    finished_area: FloatCell
    """The part of `area` that no blade cut: bridges that were finished [m2]
    (`tissue.cutting.finishing`)."""


def new_change() -> Change:
    """Return an empty list of changes."""
    return Change(
        flagged=np.zeros(CHANGES, np.int64),
        dirty=np.zeros(CHANGES, np.int64),
        faces=np.zeros((CHANGES, 4), np.int64),
        children=np.zeros((CHANGES, 2), np.int64),
        n_flagged=0,
        n_dirty=0,
        n_faces=0,
        n_children=0,
        is_full=0,
        lost_spin=np.zeros(3),
        area=0.0,
        finished_area=0.0,
    )


@kernel
def clear_changes(change: Change) -> None:
    """Forget what the last pass did."""
    change.n_flagged = 0
    change.n_dirty = 0
    change.n_faces = 0
    change.n_children = 0
    change.is_full = 0


@kernel
def note_dirty(change: Change, t: int) -> None:
    """Note that tetrahedron `t` was changed."""
    if change.n_dirty < len(change.dirty):
        change.dirty[change.n_dirty] = t
        change.n_dirty += 1


@kernel
def note_child(change: Change, child: int, parent: int) -> None:
    """Note that tetrahedron `child`, which was appended, is a part of `parent`."""
    if change.n_children < len(change.children):
        change.children[change.n_children, 0] = child
        change.children[change.n_children, 1] = parent
        change.n_children += 1


@kernel
def touched_nodes(body: Body, change: Change, visits: Visits, out: IntArray) -> int:
    """Write the nodes of the changed tetrahedra to `out`, each once; return how many."""
    visits.epoch += 1
    epoch = visits.epoch
    n = 0
    for i in range(change.n_dirty):
        for k in range(4):
            node = body.tetrahedra[change.dirty[i], k]
            if visits.nodes[node] != epoch:
                visits.nodes[node] = epoch
                out[n] = node
                n += 1
    return n


@kernel
def largest_frequency(body: Body, frequency_squared: FloatArray, nodes: IntArray, n: int) -> float:
    """Return the largest bound on w^2 [1/s2] among the first `n` of `nodes` that can move."""
    largest = 0.0
    for i in range(n):
        if not body.fixed[nodes[i]]:
            largest = max(largest, frequency_squared[nodes[i]])
    return largest
