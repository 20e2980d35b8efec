"""`Grip`: what the blade holds of a body, which of its faces touch it, and the forces of both."""

import math

import numpy as np

from tissue.blade.anchors import (
    Edge,
    is_engaged,
    new_anchors,
)
from tissue.blade.engagement import hold_on, meet
from tissue.blade.forces import Tool, release_edge
from tissue.blade.impulse_totals import (
    IMPULSE,
    IMPULSE_TORQUE,
    TISSUE_IMPULSE,
)
from tissue.blade.return_mapping import SEARCH, relocate
from tissue.blade.side_contact import grown_flanks, new_flanks, with_more_rows
from tissue.blade.side_search import (
    blade_box,
    find_faces,
    forget_cells,
    forget_changed_faces,
    forget_faces,
)
from tissue.blade.toughness import resistance_of
from tissue.blade.wrench import contacts_of, most_contacts, new_report, wrench_of, write_report
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray
from tissue.cutting.blade_path import Path
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import Survey, boxes_meet
from tissue.mesh.changes import Change
from tissue.mesh.moved_nodes import Moved, forget_moved
from tissue.mesh.point_location import build_grid, list_appended, list_moved, no_grid
from tissue.mesh.star import LARGEST_STAR, Visits
from tissue.types import BladeContacts, Wrench

SAMPLES_PER_NODE_SIZE = 6.0
"""Samples of the cutting edge per mean node size. Fewer make the force ripple where the edge
enters and leaves the skin; more cost time in every Runge-Kutta stage."""
MOST_SAMPLES = 512
"""Samples at most, for a long blade in a fine mesh."""

FURTHEST_HOLD = 1.0
"""How far from the edge tissue is taken hold of beside what it holds already, per mean node size. A
lip that has turned aside would else draw the edge into the tissue behind it."""

GRID_MARGIN = 0.5
"""How far a node goes before it is listed for the search of contact again, per mean node size."""

NEAR_BLADE = 0.5
"""How near to the blade's faces the tissue's are looked at, per mean node size: twice as far as the
blade goes between two looks."""

_SAME_LENGTH = 1e-3
"""Relative change in length below which it is the same blade. Poses in single precision, or between
two places of a turning blade, differ by less; another blade would begin another incision."""


class Grip:
    """All through which one body and the blade act on each other.

    Args:
        blade: The body of the blade; None for a line that cuts.
        material: Of the tissue.
        node_size: Mean node size of the body [m].
        n_tetrahedra: Of the body.
    """

    def __init__(
        self, blade: BladeShape | None, material: Material, node_size: float, n_tetrahedra: int
    ) -> None:
        self._material = material
        self._node_size = node_size
        self.tool = Tool(
            anchors=new_anchors(2, 1.0, material.young_modulus),
            flanks=new_flanks(blade, material, node_size, n_tetrahedra),
            resistance=resistance_of(material, blade),
        )
        self._has_flanks = blade is not None
        self._report = new_report(most_contacts(self.tool))
        self._edge_length = 0.0
        self._grid = no_grid()
        self._all_nodes = np.zeros(0, np.int64)
        self._queue = np.zeros(max(LARGEST_STAR, SEARCH), dtype=np.int64)

    @property
    def n_samples(self) -> int:
        """Samples of the edge."""
        return len(self.tool.anchors.state)

    @property
    def is_engaged(self) -> bool:
        """Whether the edge is in the tissue."""
        return is_engaged(self.tool.anchors)

    def is_another(self, length: float) -> bool:
        """Whether an edge of that length [m] is another one; 0 is none."""
        return abs(length - self._edge_length) > _SAME_LENGTH * length

    def take(self, length: float, body: Body, edge: Edge, when: float) -> None:
        """Let go of the tissue with the edge as it was, and take one of that length [m]."""
        release_edge(self.tool, body, edge, when)
        n = math.ceil(length / self._node_size * SAMPLES_PER_NODE_SIZE) + 1
        anchors = new_anchors(min(max(n, 2), MOST_SAMPLES), length, self._material.young_modulus)
        anchors = anchors.replaced(totals=self.tool.anchors.totals)
        self.tool = self.tool.replaced(anchors=anchors)
        self._report = new_report(most_contacts(self.tool))
        self._edge_length = length

    def grow(self, n_tetrahedra: int) -> None:
        """Make room for that many tetrahedra."""
        self.tool = self.tool.replaced(flanks=grown_flanks(self.tool.flanks, n_tetrahedra))

    def mesh_changed(self, body: Body, visits: Visits, change: Change) -> None:
        """Find what the edge holds, in the mesh after a pass of a cut."""
        relocate(self.tool.anchors, body, visits, self._queue)
        if self._has_flanks:
            forget_changed_faces(self.tool.flanks, change.dirty, change.n_dirty)

    def feel(
        self,
        body: Body,
        visits: Visits,
        moved: Moved | None,
        edge: Edge | None,
        when: float,
        box: Survey,
    ) -> None:
        """Find the faces of the tissue that those of the blade may touch; None is no blade."""
        if not self._has_flanks:
            return
        totals = self.tool.anchors.totals
        margin = NEAR_BLADE * self._node_size
        if edge is None or not boxes_meet(
            blade_box(self.tool.flanks, edge, when, margin), (box.low, box.high)
        ):
            forget_faces(self.tool.flanks, totals)
            return
        self._list_tetrahedra(body, visits, moved)
        where = (body, visits, self._grid, edge, when, margin, totals)
        while not find_faces(self.tool.flanks, *where):
            self.tool = self.tool.replaced(flanks=with_more_rows(self.tool.flanks))
            self._report = new_report(most_contacts(self.tool))

    def hold(
        self,
        body: Body,
        visits: Visits,
        path: Path,
        moved: Moved | None,
        edge: Edge,
        when: float,
        box: Survey,
        reach: float,
    ) -> None:
        """Anchor what came into the tissue, let go of what left it.

        Samples that hold nothing are looked for anywhere in `box`, the body's. `reach` [m]: see
        `tissue.blade.slit.in_slit`.
        """
        anchors, far = self.tool.anchors, FURTHEST_HOLD * self._node_size
        around = (far, self.tool.resistance, box.low, box.high, self._queue)
        if hold_on(anchors, body, visits, path, edge, when, *around):
            self._list_tetrahedra(body, visits, moved)
            meet(anchors, body, self._grid, edge, when, reach, box.low, box.high)

    def report(self, body: Body, edge: Edge) -> None:
        """Write what acts at the end of a step, for those below to read."""
        write_report(self._report, self.tool, body, edge)

    def wrench_t1(self, point: FloatArray) -> Wrench:
        """Return what the tissue does to the blade at the end of the step, about the tip [m]."""
        return wrench_of(self._report, point)

    @property
    def stiffness(self) -> FloatArray:
        """How that changes with the pose of the blade, shape (6, 6); a copy."""
        return self._report.stiffness.copy()

    @property
    def contacts(self) -> BladeContacts:
        """Where it acts; views."""
        return contacts_of(self._report)

    def mean_wrench(self, point: FloatArray, dt: float) -> Wrench:
        """Return what the tissue did to the blade in a step of `dt` [s], about `point` [m]."""
        totals, per_second = self.tool.anchors.totals, _per_second(dt)
        force = totals[IMPULSE : IMPULSE + 3] * per_second
        torque = totals[IMPULSE_TORQUE : IMPULSE_TORQUE + 3] * per_second
        (x, y, z), (fx, fy, fz) = point.tolist(), force.tolist()  # np.cross would cost 20 us
        torque -= np.array([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
        return Wrench(force, torque, point)

    def mean_force_on_tissue(self, dt: float) -> FloatArray:
        """Return what its nodes were given in a step of `dt` [s], summed over them [N]."""
        return self.tool.anchors.totals[TISSUE_IMPULSE : TISSUE_IMPULSE + 3] * _per_second(dt)

    def _list_tetrahedra(self, body: Body, visits: Visits, moved: Moved | None) -> None:
        """Let the grid list where the tetrahedra are now."""
        if len(self._all_nodes) != len(body.positions):
            self._all_nodes = np.arange(len(body.positions))
        nodes, n = self._all_nodes, body.n_nodes
        if moved is not None:
            nodes, n = moved.nodes, int(moved.n_nodes)
        has_room = (
            len(self._grid.listed_at) == len(body.positions)
            and list_moved(body, visits, self._grid, nodes, n, self._queue)
            and list_appended(body, body.positions, self._grid)
        )
        if moved is not None:
            forget_moved(moved)
        if not has_room:
            self._grid = build_grid(body, body.positions, GRID_MARGIN * self._node_size)
            forget_cells(self.tool.flanks)


def _per_second(dt: float) -> float:
    return 1.0 / dt if dt > 0.0 else 0.0
