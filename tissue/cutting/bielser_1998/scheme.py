"""The paper's scheme: detect, wait until the blade has left, split by the table.

As printed, with its limits: the tip must enter first and leave last, the blade must not turn back,
each tetrahedron is split once and only after the blade has left it, hanging nodes stay. What it
does not support stays uncut and is counted; see `SchemeStatistics`.
"""

import numpy as np

from tissue.core.jit import kernel
from tissue.cutting.bielser_1998.crossings import (
    Waiting,
    has_left,
    list_waiting,
    record_crossings,
    record_tips,
)
from tissue.cutting.bielser_1998.mesh_records import cut_edge_code, records_of, table
from tissue.cutting.bielser_1998.node_placement import new_placing
from tissue.cutting.bielser_1998.statistics import statistics
from tissue.cutting.bielser_1998.subdivision import split_tetrahedron
from tissue.cutting.bielser_1998.template_1_to_17 import N_LOCAL_NODES
from tissue.cutting.bielser_1998.workspace import Split, no_counts
from tissue.cutting.blade_path import Path
from tissue.cutting.bridging import remember_active
from tissue.cutting.collision_detection import detect_collisions
from tissue.cutting.cut_surface import grown_sheet, new_sheet
from tissue.cutting.workspace import (
    Cut,
    SnapLimits,
    new_cut_scratch,
    scratch_with_twice_the_room,
)
from tissue.mesh.body import Body
from tissue.mesh.changes import NODES, clear_changes, new_change, with_twice_the_room
from tissue.mesh.star import Visits
from tissue.types import SchemeStatistics

_REACH = 0.25
"""Distance from its box at which the blade has left a tetrahedron, in mean node sizes. A blade in
soft tissue trembles; at 0, tetrahedra that it comes back into were split too early, by codes of
fewer edges (10 of 154 in a slanted stroke through the paper's block, and it stayed in one piece).
Between 0.25 and 1 the pieces are the same."""

GONE = -1.0
"""In place of a distance: the blade has left every tetrahedron, wherever it is."""


class PaperScheme:
    """The paper's scheme, with its records of the initial mesh and scratch.

    The methods are those of `tissue.cutting.scheme.Scheme`.

    Args:
        body: The body, uncut, with room for hanging nodes.
        density: [kg/m3].
        node_size: Mean over the nodes of the smallest altitude around each [m].
    """

    def __init__(self, body: Body, density: float, node_size: float) -> None:
        self.change = new_change()
        self.doubled_nodes = 1
        self._density = density
        self._reach = _REACH * node_size
        self._records = records_of(body)
        self._table = table()
        n = len(self._records.tetrahedra)
        self._waiting = Waiting(
            tetrahedra=np.zeros(n, np.int64),
            n_listed=0,
            is_listed=np.zeros(n, np.int64),
        )
        self._placing = new_placing()
        self._references = np.zeros((5, N_LOCAL_NODES), np.int64)
        self._counts = no_counts()
        # For collision detection. The sheet stays empty: this scheme moves no node to it.
        self._scratch = new_cut_scratch(0)
        self._sheet = new_sheet(len(body.rest), len(body.tetrahedra))
        self._limits = SnapLimits(snap=0.0, floor=0.0, guard=0.0, crumb=0.0)

    @property
    def n_active(self) -> int:
        """Number of active tetrahedra (paper, section 3)."""
        return self._scratch.n_active

    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """Detect collisions: the active tetrahedra, and what the edge crossed along `path`."""
        detect_collisions(self._arrays(body, visits, path))

    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """Record what was detected, and split the tetrahedra that the blade has left: one pass."""
        cut = self._arrays(body, visits, path)
        is_first_pass = self.change.is_full == 0
        clear_changes(self.change)
        if is_first_pass:
            self._counts.n_ignored += record_crossings(cut, self._records)
            record_tips(cut, self._records)
            list_waiting(cut, self._records, self._waiting)
        split_left(self._split(body), self._waiting, path, self._reach)
        remember_active(cut)

    def cut_to_edge(self, body: Body, visits: Visits, path: Path) -> None:
        """Do nothing: a tetrahedron is cut when the blade has left it (paper, section 4.3)."""
        del body, visits, path
        clear_changes(self.change)

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """Split the tetrahedra that wait for the blade to leave, in one pass."""
        del visits
        clear_changes(self.change)
        self._scratch.n_active = 0
        split_left(self._split(body), self._waiting, path, GONE)

    def finish(self, body: Body, visits: Visits, path: Path) -> None:
        """Do nothing: what the scheme cannot split it leaves whole, and counts."""
        del body, visits, path
        clear_changes(self.change)

    def forget(self) -> None:
        """Forget the incision. Its edges stay cut: each tetrahedron is processed once."""
        self._records.incision += 1
        self._scratch.n_previous = 0

    def make_room(self, lacking: int) -> None:
        """Make twice the room for what lacked it."""
        if lacking == NODES:
            self.doubled_nodes *= 2
            return
        self.change = with_twice_the_room(self.change)
        self._scratch = scratch_with_twice_the_room(self._scratch)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        self._sheet = grown_sheet(self._sheet, n_nodes, n_tetrahedra)

    def statistics(self, body: Body) -> SchemeStatistics:
        """Return counts of what was done so far."""
        return statistics(body, self._records, self._table, self._waiting, self._counts)

    def _split(self, body: Body) -> Split:
        return Split(
            body=body,
            records=self._records,
            table=self._table,
            change=self.change,
            placing=self._placing,
            references=self._references,
            counts=self._counts,
            density=self._density,
        )

    def _arrays(self, body: Body, visits: Visits, path: Path) -> Cut:
        return Cut(
            body=body,
            visits=visits,
            sheet=self._sheet,
            path=path,
            change=self.change,
            scratch=self._scratch,
            limits=self._limits,
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
