"""All that a cut step reads and writes: body, path, cut surface, changes and scratch."""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.hash_table import HashTable, new_hash_table
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import dot, sub, vec3
from tissue.cutting.blade_path import Path, plane_near
from tissue.cutting.cut_surface import CutSurface, on_cut_surface, put_on_cut_surface
from tissue.mesh.body import Body
from tissue.mesh.changes import CHANGES, LISTS, Change
from tissue.mesh.star import LARGEST_STAR, Visits

CROSSINGS = 1 << 12
"""Crossed edges that one pass can note at first; see `CHANGES`."""

HASH_SLOTS = 1 << 15
"""Slots of the table of edges tested at first; twice the number that one pass can test."""


class SnapLimits(Arrays):
    """Distances within which a node that is there is used in place of a new one.

    They trade the path of the cut against the smallest element, hence against the time step.
    Without the guard one unlucky cut divides the time step by a hundred or more.
    """

    snap: float
    """Share of a node's size within which a crossing moves to the node."""
    floor: float
    """Distance within which a crossing moves to a node, whatever the node's size [m]."""
    guard: float
    """Least altitude that a split may leave [m]; else the nearest node is used."""
    crumb: float
    """Volume below which a closed piece made in one step stays with its larger neighbour [m3]."""


class CutScratch(Arrays):
    """Scratch of a cut step."""

    active: IntArray = sized("active")
    """Active tetrahedra, which the swept edge passes through; shape (room,)."""
    segments: IntArray = sized("active", 2)
    """First and last segment of the edge near each active tetrahedron, shape (room, 2)."""
    n_active: IntCell
    """Number of active tetrahedra."""
    previous: IntArray = sized((2, "active"))
    """Tetrahedra that were active or changed in the step before, shape (2 * room,)."""
    n_previous: IntCell
    """Number of tetrahedra in `previous`."""
    around: IntArray = sized(LARGEST_STAR)
    """A star, shape (LARGEST_STAR,)."""
    around_too: IntArray = sized(LARGEST_STAR)
    """Another star, shape (LARGEST_STAR,)."""
    parents: IntArray = sized(LARGEST_STAR)
    """Tetrahedra being split, shape (LARGEST_STAR,)."""
    parent_links: IntArray = sized(LARGEST_STAR, 4)
    """Links of each parent before the split, shape (LARGEST_STAR, 4)."""
    children: IntArray = sized(LARGEST_STAR, 3)
    """Tetrahedra that each parent becomes, shape (LARGEST_STAR, 3)."""
    place: IntArray = sized("tetrahedra")
    """Index in `parents` of each tetrahedron that is split, shape (tetrahedron capacity,)."""
    crossing: IntArray = sized("crossings", 3)
    """Two nodes of each crossed edge and the segment that crossed it, shape (n_room, 3)."""
    crossing_at: FloatArray = sized("crossings", 2)
    """Fraction along each crossed edge, from its first node, and the rank by which crossings are
    sorted: how far the fraction is from 1/2; shape (n_room, 2)."""
    order: IntArray = sized("crossings")
    """Order in which crossings are handled, shape (n_room,)."""
    n_crossings: IntCell
    """Number of crossed edges."""
    tested: HashTable
    """Edges tested in this search, each as a number made of its two nodes."""


class Cut(Arrays):
    """All that a cut step reads and writes."""

    body: Body
    visits: Visits
    surface: CutSurface
    path: Path
    change: Change
    scratch: CutScratch
    limits: SnapLimits


def new_cut_scratch(n_tetrahedra: int) -> CutScratch:
    """Return scratch for a body with room for that many tetrahedra."""
    sizes = {"tetrahedra": n_tetrahedra, "active": CHANGES, "crossings": CROSSINGS}
    return CutScratch.new(sizes, tested=new_hash_table(HASH_SLOTS))


def scratch_with_twice_the_room(scratch: CutScratch) -> CutScratch:
    """Return scratch with twice the room in its lists, and the same in them."""
    sizes = {"active": 2 * len(scratch.active), "crossings": 2 * len(scratch.crossing)}
    return scratch.grown(sizes).replaced(tested=new_hash_table(2 * len(scratch.tested.item)))


@kernel
def flag(cut: Cut, node: int) -> None:
    """Put `node` on the cut surface, and list it in `change.flagged`."""
    surface = cut.surface
    if not on_cut_surface(surface, node):
        p = vec3(cut.body.rest, node)
        plane = plane_near(cut.path, p)
        offset = abs(dot(sub(p, plane.point), plane.normal))
        put_on_cut_surface(surface, node, offset)
        cut.body.off_path[node] = max(cut.body.off_path[node], offset)
    change = cut.change
    if change.n_flagged == len(change.flagged):
        change.lacks_room = LISTS
        return
    change.flagged[change.n_flagged] = node
    change.n_flagged += 1
