"""`Scheme`, and all that a cut step reads and writes: body, path, cut surface, changes, scratch."""

from abc import ABC, abstractmethod

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.hash_table import HashTable, new_hash_table
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import dot, sub, vec3
from tissue.cutting.blade_path import Path, plane_near
from tissue.cutting.cut_surface import (
    CutSurface,
    new_cut_surface,
    on_cut_surface,
    put_on_cut_surface,
)
from tissue.mesh.body import Body
from tissue.mesh.changes import (
    CHANGES,
    LISTS,
    NODES,
    Change,
    clear_changes,
    new_change,
    with_twice_the_room,
)
from tissue.mesh.star import LARGEST_STAR, Visits
from tissue.types import SchemeStatistics

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


class Scheme(ABC):
    """A method of cutting a mesh. It owns the arrays of the incision, not those of the body.

    A cut step is `detect` (CD), then `cut` (GC). Where `cut` runs out of room (`change.is_full`),
    `grow`, `detect` and `cut` follow until one pass is complete.

    Args:
        limits: When a node that is there is used in place of a new one.
        n_nodes: Room for nodes.
        n_tetrahedra: Room for tetrahedra.
        n_split: Room for tetrahedra that are split by stars.
    """

    def __init__(
        self, limits: SnapLimits, n_nodes: int, n_tetrahedra: int, n_split: int = 0
    ) -> None:
        self.change = new_change()
        """Changes of the last pass, and the area cut since the body was made."""
        self.doubled_nodes = 1
        """For how many times as many doubled nodes as usual a pass is to have room."""
        self._limits = limits
        self._surface = new_cut_surface(n_nodes, n_tetrahedra)
        self._scratch = new_cut_scratch(n_split)
        self._cut: Cut | None = None

    @property
    def n_active(self) -> int:
        """Number of active tetrahedra (paper, section 3)."""
        return self._scratch.n_active

    @abstractmethod
    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """Detect collisions: the active tetrahedra, and what the edge crossed along `path`."""

    @abstractmethod
    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what was detected, in one pass."""

    def cut_to_edge(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut up to the edge itself, which rests, in one pass; by default nothing."""
        del body, visits, path
        clear_changes(self.change)

    @abstractmethod
    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what remains when the blade has left the incision, in one pass."""

    def finish(self, body: Body, visits: Visits, path: Path) -> None:
        """Part small bridges that the blade passed over, in one pass; by default none."""
        del body, visits, path
        clear_changes(self.change)

    def forget(self) -> None:
        """Forget the incision: what is detected next belongs to another."""
        self._scratch.n_previous = 0

    def statistics(self, body: Body) -> SchemeStatistics | None:
        """Return counts of what was done so far; None where the scheme keeps none."""
        del body
        return None

    def make_room(self, lacking: int) -> None:
        """Make twice the room for what lacked it: `LISTS`, or `NODES` by `doubled_nodes`."""
        if lacking == NODES:
            self.doubled_nodes *= 2
            return
        self.change = with_twice_the_room(self.change)
        scratch = self._scratch
        sizes = {"active": 2 * len(scratch.active), "crossings": 2 * len(scratch.crossing)}
        tested = new_hash_table(2 * len(scratch.tested.item))
        self._scratch = scratch.grown(sizes).replaced(tested=tested)
        self._cut = None

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        self._surface = self._surface.grown({"nodes": n_nodes, "tetrahedra": n_tetrahedra})
        self._cut = None

    def _arrays(self, body: Body, visits: Visits, path: Path) -> Cut:
        """Return all that a pass needs as one struct, made again only where a part is replaced."""
        cut = self._cut
        if cut is None or not (cut.body is body and cut.visits is visits and cut.path is path):
            self._cut = cut = Cut(
                body=body,
                visits=visits,
                surface=self._surface,
                path=path,
                change=self.change,
                scratch=self._scratch,
                limits=self._limits,
            )
        return cut
