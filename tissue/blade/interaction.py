"""`BladeInteraction`: the anchors and side contacts of one body with the blade, and the wrench."""

import math

import numpy as np

from tissue.blade.anchors import anchored_length, is_engaged, new_anchors
from tissue.blade.blade_state import new_blade_state
from tissue.blade.edge import Edge
from tissue.blade.engagement import anchor_entering, update_engagement
from tissue.blade.forces import begin_blade_step, clear_blade_forces, release_edge
from tissue.blade.return_mapping import relocate
from tissue.blade.side_contact import grown_side_contacts, with_more_faces
from tissue.blade.side_search import (
    blade_box,
    find_faces,
    forget_cells,
    forget_changed_faces,
    release_faces,
)
from tissue.blade.wrench import (
    contacts_of,
    mean_force_on_tissue,
    mean_wrench,
    new_report,
    wrench_of,
    write_report,
)
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray
from tissue.cutting.blade_path import Path
from tissue.geometry.aabb import Aabb, overlap
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import BodyBounds
from tissue.mesh.changes import Change
from tissue.mesh.moved_nodes import Moved, forget_moved
from tissue.mesh.point_location import build_grid, list_appended, list_moved, no_grid
from tissue.mesh.star import Visits
from tissue.types import BladeContacts, Wrench

SAMPLES_PER_NODE_SIZE = 6.0
"""Samples of the cutting edge per mean node size. Fewer make the force ripple where the edge
enters and leaves the skin; more cost time in every Runge-Kutta stage."""
MOST_SAMPLES = 512
"""Samples at most, for a long blade in a fine mesh."""

GRID_MARGIN = 0.5
"""Distance that a node moves before its tetrahedra are listed in the grid again, per mean node
size."""

_SAME_LENGTH = 1e-3
"""Relative change in length below which an edge counts as the same. Poses in single precision, or
between two places of a turning blade, differ by less; another edge would begin another incision."""


class BladeInteraction:
    """The interaction of one body with the blade: anchors, side contacts, forces of both.

    Args:
        blade: Shape of the blade; None for a line that cuts.
        material: Material of the tissue.
        node_size: Mean node size of the body [m].
        n_tetrahedra: Number of tetrahedra of the body.
    """

    def __init__(
        self, blade: BladeShape | None, material: Material, node_size: float, n_tetrahedra: int
    ) -> None:
        self._young_modulus = material.young_modulus
        self._node_size = node_size
        anchors = new_anchors(2, 1.0, material.young_modulus)
        self.state = new_blade_state(anchors, blade, material, node_size, n_tetrahedra)
        """State for the kernels; replaced by another object when arrays grow."""
        self._has_sides = blade is not None
        self._report = new_report(self.state)
        self._edge_length = 0.0
        self._grid = no_grid()
        self._all_nodes = np.zeros(0, np.int64)

    @property
    def n_samples(self) -> int:
        """Number of samples of the edge."""
        return len(self.state.anchors.state)

    @property
    def is_engaged(self) -> bool:
        """Whether the edge is in the tissue."""
        return is_engaged(self.state.anchors)

    @property
    def anchored_length(self) -> float:
        """Length of edge that pulls on the tissue [m]."""
        return anchored_length(self.state.anchors)

    def is_other_edge(self, length: float) -> bool:
        """Return whether an edge of that length [m] differs from the current one; 0 is no edge."""
        return abs(length - self._edge_length) > _SAME_LENGTH * length

    def replace_edge(self, length: float, body: Body, edge: Edge, when: float) -> None:
        """Release the anchors of the current edge, and use an edge of another length.

        Args:
            length: Length of the new edge [m]; 0 for no edge.
            body: The tissue.
            edge: The current edge over the last time step.
            when: Instant of the release, as a fraction of that time step.
        """
        release_edge(self.state, body, edge, when)
        n = math.ceil(length / self._node_size * SAMPLES_PER_NODE_SIZE) + 1
        anchors = new_anchors(min(max(n, 2), MOST_SAMPLES), length, self._young_modulus)
        self.state = self.state.replaced(anchors=anchors)
        self._report = new_report(self.state)
        self._edge_length = length

    def grow(self, n_tetrahedra: int) -> None:
        """Make room for that many tetrahedra."""
        self.state = self.state.replaced(sides=grown_side_contacts(self.state.sides, n_tetrahedra))

    def mesh_changed(self, body: Body, visits: Visits, change: Change) -> None:
        """Find the tetrahedra of the anchors again after a pass of a cut."""
        relocate(self.state, body, visits)
        if self._has_sides:
            forget_changed_faces(self.state.sides, change.dirty, change.n_dirty)

    def begin_step(self, body: Body, edge: Edge, dt: float) -> None:
        """Begin a time step of `dt` [s]: impulses are counted from zero."""
        begin_blade_step(self.state, body, edge, dt)

    def clear_forces(self, body: Body, external: FloatArray) -> None:
        """Set the forces on the nodes that the blade acts on to zero."""
        clear_blade_forces(self.state, body, external)

    def update_faces(
        self,
        body: Body,
        visits: Visits,
        moved: Moved | None,
        edge: Edge | None,
        when: float,
        box: BodyBounds,
    ) -> None:
        """Find the faces of the tissue that the side faces of the blade may touch.

        Args:
            body: The tissue.
            visits: For searches.
            moved: Nodes that moved since the last search; None where all may have.
            edge: The cutting edge over the time step; None for no blade.
            when: Instant, as a fraction of the time step.
            box: Box around the body.
        """
        if not self._has_sides:
            return
        if edge is None or not overlap(
            blade_box(self.state.sides, edge, when), Aabb(box.low, box.high)
        ):
            release_faces(self.state)
            return
        self._list_tetrahedra(body, visits, moved)
        while not find_faces(self.state, body, visits, self._grid, edge, when):
            self.state = self.state.replaced(sides=with_more_faces(self.state.sides))
            self._report = new_report(self.state)

    def update_anchors(
        self,
        body: Body,
        visits: Visits,
        path: Path,
        moved: Moved | None,
        edge: Edge,
        when: float,
        box: BodyBounds,
        slit_reach: float,
    ) -> None:
        """Anchor the samples of the edge that entered the tissue, and free those that left it.

        Args:
            body: The tissue.
            visits: For searches.
            path: Path of the edge through the material.
            moved: Nodes that moved since the last search; None where all may have.
            edge: The cutting edge over the time step.
            when: Instant, as a fraction of the time step.
            box: Box around the body, within which free samples are looked for.
            slit_reach: Distance from a cut face up to which a point is in the slit [m]
                (`tissue.blade.engagement.is_in_slit`).
        """
        state, corners = self.state, (box.low, box.high)
        if update_engagement(state, body, visits, path, edge, when, *corners):
            self._list_tetrahedra(body, visits, moved)
            anchor_entering(state.anchors, body, self._grid, edge, when, slit_reach, *corners)

    def write_report(self, body: Body, edge: Edge) -> None:
        """Write wrench, stiffness and contacts at the end of a step, for the properties below."""
        write_report(self._report, self.state, body, edge)

    def wrench_t1(self, point: FloatArray) -> Wrench:
        """Return the wrench on the blade at the end of the step, about the tip, `point` [m]."""
        return wrench_of(self._report, point)

    @property
    def stiffness(self) -> FloatArray:
        """Change of that wrench with the pose of the blade, shape (6, 6); a copy."""
        return self._report.stiffness.copy()

    @property
    def contacts(self) -> BladeContacts:
        """The contacts at the end of the step; views."""
        return contacts_of(self._report)

    def mean_wrench(self, point: FloatArray, dt: float) -> Wrench:
        """Return the mean wrench on the blade in a step of `dt` [s], about `point` [m]."""
        return mean_wrench(self.state.totals, point, dt)

    def mean_force_on_tissue(self, dt: float) -> FloatArray:
        """Return the mean force of the blade on the nodes in a step of `dt` [s], summed [N]."""
        return mean_force_on_tissue(self.state.totals, dt)

    def _list_tetrahedra(self, body: Body, visits: Visits, moved: Moved | None) -> None:
        """List in the grid where the tetrahedra are now."""
        if len(self._all_nodes) != len(body.positions):
            self._all_nodes = np.arange(len(body.positions))
        nodes, n = self._all_nodes, body.n_nodes
        if moved is not None:
            nodes, n = moved.nodes, moved.n_nodes
        has_room = (
            len(self._grid.listed_at) == len(body.positions)
            and list_moved(body, visits, self._grid, nodes, n, self.state.queue)
            and list_appended(body, body.positions, self._grid)
        )
        if moved is not None:
            forget_moved(moved)
        if not has_room:
            self._grid = build_grid(body, body.positions, GRID_MARGIN * self._node_size)
            forget_cells(self.state.sides)
