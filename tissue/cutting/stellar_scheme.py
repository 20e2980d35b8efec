"""The scheme of cutting that is ours: stellar subdivision, crack front, un-gluing ("S-cut").

Points are inserted where the sheet meets edges of the mesh, by splitting whole stars; the faces
that then tile the sheet are cut; nodes whose stars fell apart are doubled. No tetrahedron is ever
built from a table of cases, so that none has to be left out: neighbours see one operation, cuts
cross, turn back and meet.
"""

import numpy as np

from tissue.cutting.blade_path import Path
from tissue.cutting.bridging import remember_active, resolve_bridges
from tissue.cutting.crack_front import bring_front_to_blade, extend_fronts
from tissue.cutting.crossings import find_active_tetrahedra, find_crossings
from tissue.cutting.cut_surface import begin_sheet, grown_sheet, new_sheet
from tissue.cutting.separation import close_sheet, open_sheet
from tissue.cutting.snapping import insert_crossings
from tissue.cutting.workspace import Cut, Quality, new_work
from tissue.mesh.body import Body
from tissue.mesh.changes import clear_changes, new_change
from tissue.mesh.star import Visits
from tissue.types import SchemeStatistics


class StellarScheme:
    """Sheet, changes and scratch of the current incision; see `tissue.cutting.scheme.Scheme`.

    Args:
        quality: When a node that is there is used in place of a new one.
        n_nodes: Room for nodes.
        n_tetrahedra: Room for tetrahedra.
    """

    def __init__(self, quality: Quality, n_nodes: int, n_tetrahedra: int) -> None:
        self.change = new_change()
        self._quality = quality
        self._sheet = new_sheet(n_nodes, n_tetrahedra)
        self._work = new_work(n_tetrahedra)
        self._cut: Cut | None = None

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
        self._insert(cut)
        open_sheet(cut)
        remember_active(cut)

    def rest(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`."""
        cut = self._arrays(body, visits, path)
        clear_changes(cut.change)
        bring_front_to_blade(cut)
        resolve_bridges(cut)
        open_sheet(cut)
        remember_active(cut)

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """See `Scheme`."""
        self._work.n_active[0] = 0
        self._work.n_crossings[0] = 0
        cut = self._arrays(body, visits, path)
        self._insert(cut)
        close_sheet(cut)
        remember_active(cut)

    def forget(self) -> None:
        """See `Scheme`."""
        begin_sheet(self._sheet)
        self._work.n_previous[0] = 0

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """See `Scheme`."""
        self._sheet = grown_sheet(self._sheet, n_nodes, n_tetrahedra)
        self._work = self._work.replaced(place=np.zeros(n_tetrahedra, dtype=np.int64))
        self._work.hash_stamps[:] = 0
        self._cut = None

    def statistics(self, body: Body) -> SchemeStatistics | None:
        """See `Scheme`. There are no cases to count, and nothing is left hanging."""
        del body
        return None

    def _insert(self, cut: Cut) -> None:
        clear_changes(cut.change)
        insert_crossings(cut)
        extend_fronts(cut)
        resolve_bridges(cut)

    def _arrays(self, body: Body, visits: Visits, path: Path) -> Cut:
        """Return all that a pass needs as one struct; made anew only where a part is another."""
        cut = self._cut
        if cut is None or not (cut.body is body and cut.visits is visits and cut.path is path):
            self._cut = cut = self._struct(body, visits, path)
        return cut

    def _struct(self, body: Body, visits: Visits, path: Path) -> Cut:
        return Cut(
            body=body,
            visits=visits,
            sheet=self._sheet,
            path=path,
            change=self.change,
            work=self._work,
            quality=self._quality,
        )
