"""Changes of a mesh in a cut step, and the room in its arrays that one pass of the step needs."""

from typing import Final, NamedTuple, Protocol

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

CHANGES = 1 << 15
"""Changes that one pass of a cut step can note at first; `PASS_NODES` of cutting keeps within it in
meshes of ordinary stars. Where it does not suffice there is more room, and the step is repeated."""

LISTS: Final = 1
"""Lack of room in the lists of a pass."""

NODES: Final = 2
"""Lack of room in the arrays of the body, for nodes that are doubled."""

PASS_NODES = 256
"""Nodes that one pass of a cut step puts on the cut surface at most; a step that needs more takes
several passes. Doubling a node changes some 50 tetrahedra, which must fit into `CHANGES`."""

SPARE_NODES = 4 * PASS_NODES
"""Room that a pass leaves for doubled nodes: no node becomes more than a few."""

ROOM_FOR_TETRAHEDRA = 1 << 12
"""Free tetrahedra that a pass of a cut step begins with; more are made between passes."""


class Change(Arrays):
    """Changes of one pass of a cut step."""

    flagged: IntArray = sized("lists")
    """Nodes that came to lie on the cut surface, shape (room,)."""
    dirty: IntArray = sized("lists")
    """Tetrahedra that were split or got another node, with repeats; shape (room,)."""
    faces: IntArray = sized("lists", 4)
    """Faces cut, each as tetrahedron, local face, tetrahedron, local face; shape (room, 4)."""
    children: IntArray = sized("lists", 2)
    """Tetrahedra that were appended, and the tetrahedron that each is a part of: in order, so that
    a parent stands before its children; shape (room, 2)."""
    n_flagged: IntCell
    """Number of entries in `flagged`."""
    n_dirty: IntCell
    """Number of entries in `dirty`."""
    n_faces: IntCell
    """Number of entries in `faces`."""
    n_children: IntCell
    """Number of entries in `children`."""
    is_full: IntCell
    """1 if the pass stopped for lack of room in the body, to continue once some is made; else 0."""
    lacks_room: IntCell
    """LISTS or NODES where there was no room, and something is missing; else 0. What was done is of
    no use then: it is done again from where the step began, with more room."""
    lost_spin: FloatArray = sized(3)
    """Angular momentum that the masses at nodes lost by splits, over the density of the first
    material [m5/s], shape (3,)."""
    area: FloatCell
    """Area of the faces cut, at rest, one side of each, since the body was made [m2]."""
    finished_area: FloatCell
    """The part of `area` that no blade cut: bridges that were finished [m2]
    (`tissue.cutting.finishing`)."""


class ChangedMesh(NamedTuple):
    """A mesh after a pass of a cut, and what the pass changed."""

    body: Body
    """The body as it is now."""
    visits: Visits
    """Scratch for searches."""
    change: Change
    """Changes of the pass."""
    nodes: IntArray
    """Nodes of the tetrahedra that changed, each once, shape (n,)."""


class Owner(Protocol):
    """Owner of arrays that depend on the mesh: of rows for nodes or tetrahedra, or numbers of them.

    All owners of a tissue stand in one list (`tissue.stepping.stages`).
    """

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Update what depends on the tetrahedra that a pass of a cut changed."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        ...


def new_change() -> Change:
    """Return an empty list of changes."""
    return Change.new({"lists": CHANGES})


def with_twice_the_room(change: Change) -> Change:
    """Return an empty list of changes with twice the room, and the same sums."""
    sums = {name: getattr(change, name) for name in ("lost_spin", "area", "finished_area")}
    return Change.new({"lists": 2 * len(change.dirty)}, **sums)


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
    """List tetrahedron `t` as changed."""
    if change.n_dirty == len(change.dirty):
        change.lacks_room = LISTS
        return
    change.dirty[change.n_dirty] = t
    change.n_dirty += 1


@kernel
def note_face(change: Change, t: int, f: int, other: int, g: int) -> None:
    """List a face as cut.

    Args:
        change: The list.
        t: A tetrahedron that has it.
        f: Its local number there.
        other: The other tetrahedron.
        g: Its local number there.
    """
    if change.n_faces == len(change.faces):
        change.lacks_room = LISTS
        return
    row = change.n_faces
    change.n_faces += 1
    change.faces[row, 0] = t
    change.faces[row, 1] = f
    change.faces[row, 2] = other
    change.faces[row, 3] = g


@kernel
def note_child(change: Change, child: int, parent: int) -> None:
    """List tetrahedron `child`, which was appended, as a part of `parent`."""
    if change.n_children == len(change.children):
        change.lacks_room = LISTS
        return
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


def room_for_a_pass(body: Body, factor: int = 1) -> tuple[int, int] | None:
    """Return the numbers of nodes and tetrahedra to make room for before a pass; None to keep them.

    Arrays double when they are nearly full.

    Args:
        body: The body.
        factor: How many times as many nodes as usual may be doubled in the pass.
    """
    capacity = n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
    spare = 2 * SPARE_NODES * factor
    if body.n_nodes + spare > n_nodes:
        n_nodes = 2 * n_nodes + spare
    if body.n_tetrahedra + ROOM_FOR_TETRAHEDRA > n_tetrahedra:
        n_tetrahedra = 2 * n_tetrahedra + ROOM_FOR_TETRAHEDRA
    return (n_nodes, n_tetrahedra) if (n_nodes, n_tetrahedra) != capacity else None
