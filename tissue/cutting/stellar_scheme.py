"""Our scheme of cutting: stellar subdivision, crack front, separation.

Nodes are inserted where the cut surface crosses edges of the mesh, by splitting whole stars; the
faces that then tile the cut surface are cut; nodes whose stars fell apart are doubled. There is no
table of cases, so that no case is missing: cuts may cross, turn back and join.
"""

from typing import Final

import numpy as np

from tissue.core.jit import SameTypes, kernel
from tissue.cutting.blade_path import Path
from tissue.cutting.bridging import remember_active, resolve_bridges
from tissue.cutting.collision_detection import detect_collisions
from tissue.cutting.crack_front import bring_front_to_blade, extend_fronts
from tissue.cutting.cut_surface import begin_cut_surface
from tissue.cutting.finishing import finish_cut_surface
from tissue.cutting.minimum_cut import new_flow_graph
from tissue.cutting.separation import close_cut_surface, open_cut_surface
from tissue.cutting.snapping import insert_crossings
from tissue.cutting.workspace import Cut, Scheme, SnapLimits
from tissue.mesh.body import Body
from tissue.mesh.changes import clear_changes
from tissue.mesh.star import Visits

ALONG_PATH: Final = 0
"""Cut what was detected along the path of the edge."""

TO_EDGE: Final = 1
"""Cut up to the edge itself, which rests."""

TO_THE_END: Final = 2
"""Cut what remains when the blade has left the incision."""


@kernel
def cut_in_a_pass(cut: Cut, how_far: int) -> None:
    """Cut what was detected, as far as there is room; `how_far`: one of the constants above."""
    clear_changes(cut.change)
    if how_far == TO_EDGE:
        bring_front_to_blade(cut)
    else:
        insert_crossings(cut)
        extend_fronts(cut)
    resolve_bridges(cut)
    if how_far == TO_THE_END:
        close_cut_surface(cut)
    else:
        open_cut_surface(cut)
    remember_active(cut)


_DETECT, _CUT = SameTypes(detect_collisions), SameTypes(cut_in_a_pass)


class StellarScheme(Scheme):
    """Our scheme, with cut surface, changes and scratch of the current incision.

    Args:
        limits: When a node that is there is used in place of a new one.
        n_nodes: Room for nodes.
        n_tetrahedra: Room for tetrahedra.
    """

    def __init__(self, limits: SnapLimits, n_nodes: int, n_tetrahedra: int) -> None:
        super().__init__(limits, n_nodes, n_tetrahedra, n_split=n_tetrahedra)
        self._graph = new_flow_graph(n_tetrahedra)
        self._area_before = 0.0

    def detect(self, body: Body, visits: Visits, path: Path) -> None:
        """Detect collisions: the active tetrahedra, and what the edge crossed along `path`."""
        _DETECT.call(self._arrays(body, visits, path))

    def cut(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what was detected, in one pass."""
        _CUT.call(self._arrays(body, visits, path), ALONG_PATH)

    def cut_to_edge(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut up to the edge itself, which rests, in one pass."""
        cut_in_a_pass(self._arrays(body, visits, path), TO_EDGE)

    def end(self, body: Body, visits: Visits, path: Path) -> None:
        """Cut what remains when the blade has left the incision, in one pass."""
        self._scratch.n_active = 0
        self._scratch.n_crossings = 0
        cut_in_a_pass(self._arrays(body, visits, path), TO_THE_END)

    def finish(self, body: Body, visits: Visits, path: Path) -> None:
        """Part small bridges that the blade passed over, in one pass."""
        cut = self._arrays(body, visits, path)
        clear_changes(cut.change)
        finish_cut_surface(cut, self._graph, self.change.area - self._area_before)

    def forget(self) -> None:
        """Forget the incision: what is detected next belongs to another."""
        super().forget()
        begin_cut_surface(self._surface)
        self._area_before = self.change.area

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        super().grow(n_nodes, n_tetrahedra)
        self._scratch = self._scratch.replaced(place=np.zeros(n_tetrahedra, dtype=np.int64))
        self._graph = new_flow_graph(n_tetrahedra)
