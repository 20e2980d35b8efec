"""The paper's scheme: detect, wait until the blade has left, split by the table.

Kept as it was printed, with its limits: the tip must enter first and leave last, the blade must not
turn back, each tetrahedron is split once and only after the blade has left it, hanging nodes stay.
What it does not support is left uncut, and counted; see `SchemeStatistics`.
"""

import numpy as np

from tissue.body import Body
from tissue.cut import Cut, Quality, clear_changes, new_change, new_work
from tissue.jit import kernel
from tissue.paper_scheme.collision import Waiting, list_waiting, record_crossings, record_tips
from tissue.paper_scheme.placing import new_placing
from tissue.paper_scheme.presplit import N_NODES
from tissue.paper_scheme.records import cut_edge_code, records_of, table
from tissue.paper_scheme.splitting import N_TALLIES, Split, split
from tissue.paper_scheme.statistics import SchemeStatistics, statistics
from tissue.path import Path
from tissue.sheet import new_sheet
from tissue.star import Visits
from tissue.sweep import find_active_tetrahedra, find_crossings


class PaperScheme:
    """Records of the initial mesh, and scratch; see `tissue.scheme.Scheme`.

    Args:
        body: Whole, and with room for hanging nodes.
        density: [kg/m3].
    """

    def __init__(self, body: Body, density: float) -> None:
        self.change = new_change()
        self._density = density
        self._records = records_of(body)
        self._table = table()
        n = len(self._records.tetrahedra)
        self._waiting = Waiting(
            tetrahedra=np.zeros(n, np.int64),
            n=np.zeros(1, np.int64),
            is_listed=np.zeros(n, np.int64),
            touched=np.zeros(n, np.int64),
            step=np.zeros(1, np.int64),
        )
        self._placing = new_placing()
        self._references = np.zeros((5, N_NODES), np.int64)
        self._tally = np.zeros(N_TALLIES, np.int64)
        self._n_ignored = 0
        # What a collision is found with; this scheme has no sheet, and moves nothing to a node.
        self._work = new_work(0)
        self._sheet = new_sheet(0, 0)
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
        clear_changes(self.change)
        self._n_ignored += record_crossings(cut, self._records)
        record_tips(cut, self._records)
        list_waiting(cut, self._records, self._waiting)
        split_left(self._split(body), self._waiting)

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`."""
        del visits, path  # The blade is gone; what it met is recorded.
        clear_changes(self.change)
        self._work.n_active[0] = 0
        self._waiting.step[0] += 1
        split_left(self._split(body), self._waiting)

    def forget(self) -> None:
        """See `Scheme`. Edges stay cut: each tetrahedron is processed once."""

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """See `Scheme`. What grows with the mesh is the body's."""

    def statistics(self, body: Body) -> SchemeStatistics:
        """Return what was done so far."""
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
def split_left(s: Split, waiting: Waiting) -> None:
    """Split the waiting tetrahedra that the blade has left, if their code is in the table."""
    n = 0
    has_room = True
    for i in range(waiting.n[0]):
        t = waiting.tetrahedra[i]
        keep = True
        if has_room and waiting.touched[t] != waiting.step[0]:
            code = cut_edge_code(s.records, t)
            keep = False
            if s.table.case[code] >= 0:
                has_room = split(s, t, code)
                keep = not has_room
        if keep:
            waiting.tetrahedra[n] = t
            n += 1
        else:
            waiting.is_listed[t] = 0
    waiting.n[0] = n
