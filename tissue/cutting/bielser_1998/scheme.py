"""The paper's scheme: detect, wait until the blade has left, split by the table.

Kept as it was printed, with its limits: the tip must enter first and leave last, the blade must not
turn back, each tetrahedron is split once and only after the blade has left it, hanging nodes stay.
What it does not support is left uncut, and counted; see `SchemeStatistics`.
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
from tissue.cutting.bielser_1998.template_1_to_17 import N_NODES
from tissue.cutting.bielser_1998.workspace import N_TALLIES, Split
from tissue.cutting.blade_path import Path
from tissue.cutting.bridging import remember_active
from tissue.cutting.crossings import find_active_tetrahedra, find_crossings
from tissue.cutting.cut_surface import grown_sheet, new_sheet
from tissue.cutting.workspace import Cut, Quality, new_work
from tissue.mesh.body import Body
from tissue.mesh.changes import clear_changes, new_change
from tissue.mesh.star import Visits
from tissue.types import SchemeStatistics

_REACH = 0.25
"""How far from its box the blade must be to have left a tetrahedron, in mean node sizes. A blade in
soft tissue trembles; without it, tetrahedra that it comes back into were split too early, by codes
of fewer edges (10 of 154 in a slanted stroke through the paper's block, and it stayed in one
piece). Between 0.25 and 1 the pieces are the same."""

GONE = -1.0
"""In place of a reach: the blade has left, wherever it is."""


class PaperScheme:
    """Records of the initial mesh, and scratch; see `tissue.cutting.scheme.Scheme`.

    Args:
        body: Whole, and with room for hanging nodes.
        density: [kg/m3].
        node_size: Mean over the nodes of the smallest altitude around each [m].
    """

    def __init__(self, body: Body, density: float, node_size: float) -> None:
        self.change = new_change()
        self._density = density
        self._reach = _REACH * node_size
        self._records = records_of(body)
        self._table = table()
        n = len(self._records.tetrahedra)
        self._waiting = Waiting(
            tetrahedra=np.zeros(n, np.int64),
            n=np.zeros(1, np.int64),
            is_listed=np.zeros(n, np.int64),
        )
        self._placing = new_placing()
        self._references = np.zeros((5, N_NODES), np.int64)
        self._tally = np.zeros(N_TALLIES, np.int64)
        self._n_ignored = 0
        # What a collision is found with. Nothing lies on the sheet: no node is moved to it.
        self._work = new_work(0)
        self._sheet = new_sheet(len(body.rest), len(body.tetrahedra))
        self._quality = Quality(snap=0.0, floor=0.0, guard=0.0, crumb=0.0)

    @property
    def n_active(self) -> int:
        """See `Scheme`."""
        return int(self._work.n_active[0])

    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`."""
        cut = self._arrays(body, visits, path)
        find_active_tetrahedra(cut)
        find_crossings(cut)

    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`."""
        cut = self._arrays(body, visits, path)
        is_first_pass = self.change.is_full == 0
        clear_changes(self.change)
        if is_first_pass:
            self._n_ignored += record_crossings(cut, self._records)
            record_tips(cut, self._records)
            list_waiting(cut, self._records, self._waiting)
        split_left(self._split(body), self._waiting, path, self._reach)
        remember_active(cut)

    def rest(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`. Nothing is cut before the blade has left it (paper, section 4.3)."""
        del body, visits, path
        clear_changes(self.change)

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`."""
        del visits
        clear_changes(self.change)
        self._work.n_active[0] = 0
        split_left(self._split(body), self._waiting, path, GONE)

    def forget(self) -> None:
        """See `Scheme`. Edges stay cut: each tetrahedron is processed once."""
        self._records.incision[0] += 1
        self._work.n_previous[0] = 0

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """See `Scheme`."""
        self._sheet = grown_sheet(self._sheet, n_nodes, n_tetrahedra)
        self._work.hash_stamps[:] = 0  # they are numbers of searches, which begin anew

    def statistics(self, body: Body) -> SchemeStatistics:
        """See `Scheme`."""
        return statistics(
            body, self._records, self._table, self._waiting, self._tally, self._n_ignored
        )

    def _split(self, body: Body) -> Split:
        return Split(
            body=body,
            records=self._records,
            table=self._table,
            change=self.change,
            placing=self._placing,
            references=self._references,
            tally=self._tally,
            density=self._density,
        )

    def _arrays(self, body: Body, visits: Visits, path: Path) -> Cut:
        return Cut(
            body=body,
            visits=visits,
            sheet=self._sheet,
            path=path,
            change=self.change,
            work=self._work,
            quality=self._quality,
        )


@kernel
def split_left(s: Split, waiting: Waiting, path: Path, reach: float) -> None:
    """Split the waiting tetrahedra that the blade has left, if their code is in the table."""
    n = 0
    has_room = True
    for i in range(waiting.n[0]):
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
    waiting.n[0] = n
