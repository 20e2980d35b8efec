"""The paper's scheme: detect, wait until the blade has left, split by the table.

As printed, with its limits: the tip must enter first and leave last, the blade must not turn back,
each tetrahedron is split once and only after the blade has left it, hanging nodes stay. What it
does not support stays uncut and is counted; see `SchemeStatistics`.
"""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.cutting.bielser_1998.active_tetrahedra import (
    IN_NONE,
    Search,
    detect_along_line,
)
from tissue.cutting.bielser_1998.case_table import CASES
from tissue.cutting.bielser_1998.mesh_records import (
    NO_NODE,
    NOT_CUT,
    WHOLE_STILL,
    Records,
    Table,
    cut_edge_code,
    edge_between,
    is_whole,
    records_of,
    table,
)
from tissue.cutting.bielser_1998.node_placement import Placing
from tissue.cutting.bielser_1998.subdivision import Split, SplitCounts, split_tetrahedron
from tissue.cutting.bielser_1998.template_1_to_17 import N_CHILDREN, N_LOCAL_NODES, bit_of
from tissue.cutting.blade_path import Path
from tissue.cutting.bridging import remember_active
from tissue.cutting.workspace import Cut, Scheme, SnapLimits
from tissue.geometry.exact_predicates import lattice_point, orient3d, pierces
from tissue.mesh.body import Body
from tissue.mesh.changes import clear_changes
from tissue.mesh.nonconforming import HANGING
from tissue.mesh.star import Visits
from tissue.types import SchemeStatistics

_REACH = 0.25
"""Distance from its box at which the blade has left a tetrahedron, in mean node sizes. A blade in
soft tissue trembles; at 0, tetrahedra that it comes back into were split too early, by codes of
fewer edges (10 of 154 in a slanted stroke through the paper's block, and it stayed in one piece).
Between 0.25 and 1 the pieces are the same."""

GONE = -1.0
"""In place of a distance: the blade has left every tetrahedron, wherever it is."""


class Waiting(Arrays):
    """Tetrahedra of which the blade has cut an edge and that it has not left yet."""

    tetrahedra: IntArray = sized("tetrahedra")
    """The waiting tetrahedra, shape (n_tets,)."""
    n_listed: IntCell
    """Number of tetrahedra in the list."""
    is_listed: IntArray = sized("tetrahedra")
    """Whether a tetrahedron is in the list, shape (n_tets,)."""


class PaperScheme(Scheme):
    """The paper's scheme, with its records of the initial mesh and scratch.

    Args:
        body: The body, uncut, with room for hanging nodes.
        node_size: Mean over the nodes of the smallest altitude around each [m].
    """

    def __init__(self, body: Body, node_size: float) -> None:
        # The cut surface stays empty: this scheme moves no node to it.
        limits = SnapLimits(snap=0.0, floor=0.0, guard=0.0, crumb=0.0)
        super().__init__(limits, len(body.rest), len(body.tetrahedra))
        self._reach = _REACH * node_size
        self._records = records_of(body)
        self._table = table()
        self._waiting = Waiting.new({"tetrahedra": len(self._records.tetrahedra)})
        self._search = Search.new({}, point=IN_NONE)
        self._placing = Placing.new({})
        self._references = np.zeros((5, N_LOCAL_NODES), np.int64)
        self._counts = SplitCounts.new({})

    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """Detect collisions: the active tetrahedra, and what the edge crossed along `path`."""
        detect_along_line(self._arrays(body, visits, path), self._search)

    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """Record what was detected, and split the tetrahedra that the blade has left: one pass."""
        cut = self._arrays(body, visits, path)
        is_first_pass = self.change.is_full == 0
        clear_changes(self.change)
        if is_first_pass:
            self._counts.n_ignored += record_crossings(cut, self._records, self._waiting)
            record_tips(cut, self._records, self._search)
        split_left(self._split(body), self._waiting, path, self._reach)
        remember_active(cut)

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """Split the tetrahedra that wait for the blade to leave, in one pass."""
        del visits
        clear_changes(self.change)
        self._scratch.n_active = 0
        split_left(self._split(body), self._waiting, path, GONE)

    def forget(self) -> None:
        """Forget the incision. Its edges stay cut: each tetrahedron is processed once."""
        super().forget()
        self._records.incision += 1
        self._search.point = IN_NONE

    def statistics(self, body: Body) -> SchemeStatistics:
        """Return counts of what was done so far."""
        did = (self._waiting, self._counts, self._search)
        return statistics(body, self._records, self._table, *did)

    def _split(self, body: Body) -> Split:
        return Split(
            body=body,
            records=self._records,
            table=self._table,
            change=self.change,
            placing=self._placing,
            references=self._references,
            counts=self._counts,
        )


@kernel
def split_left(s: Split, waiting: Waiting, path: Path, reach: float) -> None:
    """Split the waiting tetrahedra that the blade has left, if their code is in the table."""
    n = 0
    has_room = True
    for i in range(waiting.n_listed):
        t = waiting.tetrahedra[i]
        keep = True
        if has_room and has_left(s.body, path, t, reach):
            code = cut_edge_code(s.records, t)
            keep = False
            if s.table.case[code] >= 0:
                has_room = split_tetrahedron(s, t, code)
                keep = not has_room
        if keep:
            waiting.tetrahedra[n] = t
            n += 1
        else:
            waiting.is_listed[t] = 0
    waiting.n_listed = n


@kernel
def record_crossings(cut: Cut, records: Records, waiting: Waiting) -> int:
    """Record the crossed edges of the initial mesh; return how many others were crossed.

    Others are ignored: "each tetrahedron can only be processed once" (section 6). An edge that is
    crossed a second time in one incision has both ends on one side again, and is not cut: a blade
    that moves along an edge trembles from one side of it to the other.
    """
    scratch = cut.scratch
    n_ignored = 0
    for i in range(scratch.n_crossings):
        e = edge_between(records, scratch.crossing[i, 0], scratch.crossing[i, 1])
        if e < 0:
            n_ignored += 1
        elif records.crossed_at[e] == NOT_CUT:
            records.crossed_at[e] = scratch.crossing_at[i, 0]
            records.crossed_in[e] = records.incision
            _list_waiting(records, waiting, e)
        elif records.crossed_in[e] == records.incision and records.edge_nodes[e, 0] == NO_NODE:
            records.crossed_at[e] = NOT_CUT
    return n_ignored


@kernel
def _list_waiting(records: Records, waiting: Waiting, e: int) -> None:
    """Add the whole tetrahedra around a cut edge to the waiting ones."""
    for i in range(records.first_around[e], records.first_around[e + 1]):
        t = records.around[i]
        if is_whole(records, t) and waiting.is_listed[t] == 0:
            waiting.is_listed[t] = 1
            waiting.tetrahedra[waiting.n_listed] = t
            waiting.n_listed += 1


@kernel
def record_tips(cut: Cut, records: Records, search: Search) -> None:
    """Record where the ends of the blade passed through faces of whole tetrahedra."""
    last = len(cut.path.seed) - 1
    for end in range(2):
        sample = 0 if end == 0 else last
        if cut.path.member[sample]:
            _record_tip(cut, records, search.n_swept, sample)


@kernel
def _record_tip(cut: Cut, records: Records, n_swept: int, sample: int) -> None:
    """Record the faces of the tetrahedra that the line passed through which a sample passed."""
    body, path = cut.body, cut.path
    start, stop = lattice_point(path.lattice_t0, sample), lattice_point(path.lattice_t1, sample)
    for i in range(n_swept):
        t = cut.scratch.active[i]
        if not is_whole(records, t):
            continue
        for f in range(4):
            face = records.faces_of[t, f]
            a = lattice_point(body.lattice_rest, records.faces[face, 0])
            b = lattice_point(body.lattice_rest, records.faces[face, 1])
            c = lattice_point(body.lattice_rest, records.faces[face, 2])
            if not pierces(start, stop, a, b, c):
                continue
            of_a = abs(float(orient3d(start, stop, b, c)))
            of_b = abs(float(orient3d(start, stop, c, a)))
            of_c = abs(float(orient3d(start, stop, a, b)))
            total = of_a + of_b + of_c
            records.tip_weights[face, 0] = of_a / total
            records.tip_weights[face, 1] = of_b / total
            records.tip_weights[face, 2] = of_c / total


@kernel
def has_left(body: Body, path: Path, t: int, reach: float) -> bool:
    """Return whether the edge, where it is now, is farther than `reach` [m] from the box of `t`."""
    grid = body.lattice_rest
    margin = int(reach / body.lattice.spacing)
    a = body.tetrahedra[t, 0]
    b = body.tetrahedra[t, 1]
    c = body.tetrahedra[t, 2]
    d = body.tetrahedra[t, 3]
    for k in range(len(path.linked) - 1):
        if not path.linked[k] or reach < 0.0:
            continue
        is_near = True
        for x in range(3):
            low = min(min(grid[a, x], grid[b, x]), min(grid[c, x], grid[d, x]))
            high = max(max(grid[a, x], grid[b, x]), max(grid[c, x], grid[d, x]))
            p = path.lattice_t1[k, x]
            q = path.lattice_t1[k + 1, x]
            is_near = is_near and min(p, q) <= high + margin and max(p, q) >= low - margin
        if is_near:
            return False
    return True


def statistics(
    body: Body,
    records: Records,
    table: Table,
    waiting: Waiting,
    counts: SplitCounts,
    search: Search,
) -> SchemeStatistics:
    """Return what the scheme did so far and what it left behind, in O(initial mesh).

    Args:
        body: The body as it is now.
        records: Records of the initial mesh.
        table: The lookup table.
        waiting: Tetrahedra that the blade has not left.
        counts: Counts since the body was made.
        search: Search for the point of the blade.
    """
    is_split = records.first_child != WHOLE_STILL
    codes = np.zeros(len(is_split), np.int64)
    for e in range(6):
        is_edge_cut = records.crossed_at[records.edges_of[:, e]] != NOT_CUT
        codes |= is_edge_cut.astype(np.int64) << bit_of(e)
    unsupported = ~is_split & (codes > 0) & (table.case[codes] < 0) & (waiting.is_listed == 0)
    beside_whole = np.zeros(len(records.edges), dtype=bool)
    beside_whole[records.edges_of[~is_split]] = True
    has_node = records.edge_nodes[:, 0] != NO_NODE
    hanging_faces = np.unique(body.links[: len(is_split)][body.links[: len(is_split)] <= HANGING])
    n_cut = int(is_split.sum())
    return SchemeStatistics(
        n_cut=n_cut,
        n_of_case={case: int(counts.n_of_case[i]) for i, case in enumerate(CASES)},
        paper_count=len(is_split) + N_CHILDREN * n_cut,
        n_hanging_edge_nodes=int((has_node & beside_whole).sum()),
        n_hanging_face_nodes=len(hanging_faces) + counts.n_own,
        n_guarded=counts.n_guarded,
        n_own_face_nodes=counts.n_own,
        n_unsupported=int(unsupported.sum()),
        n_waiting=waiting.n_listed,
        n_ignored_crossings=counts.n_ignored,
        n_local_searches=search.n_local,
        n_global_searches=search.n_global,
    )
