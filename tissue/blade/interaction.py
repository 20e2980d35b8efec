"""`BladeInteraction`: the anchors and side contacts of one body with the blade, and the wrench."""

import math

import numpy as np

from tissue.blade.blade_context import (
    GRID_IS_FULL,
    NO_ROOM_FOR_FACES,
    NOT_SEARCHED,
    BladeContext,
    release_sides,
    update_anchors,
    update_faces,
)
from tissue.blade.blade_state import new_blade_state
from tissue.blade.edge import NOWHERE, Edge, is_other_length
from tissue.blade.edge_anchors import (
    anchor_stiffness,
    is_engaged,
    new_anchors,
)
from tissue.blade.faces_contact import FACE_STIFFNESS, grown_face_contacts, with_more_faces
from tissue.blade.faces_search import forget_cells, forget_changed_faces
from tissue.blade.forces import release_edge
from tissue.blade.return_mapping import relocate
from tissue.blade.spine_contact import new_spine_contacts
from tissue.blade.spine_search import relocate_spine
from tissue.blade.toughness import (
    blunt_toughness,
    toughness_law_of,
    toughness_of_materials,
)
from tissue.blade.wrench import contacts_of, new_report
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import SameTypes
from tissue.cutting.blade_path import Path
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.material_table import MaterialArrays
from tissue.mesh.node_motion import Moved, forget_moved
from tissue.mesh.star import Visits
from tissue.mesh.tetrahedron_grid import build_grid, no_grid
from tissue.types import RigidContacts

SAMPLES_PER_NODE_SIZE = 6.0
"""Samples of the cutting edge per mean node size. Fewer make the force ripple where the edge
enters and leaves the skin; more cost time in every Runge-Kutta stage."""
MOST_SAMPLES = 4096
"""Samples of an edge at most. As many add 0.3 ms to a time step, however small the body is."""

GRID_MARGIN = 0.5
"""Distance that a node moves before its tetrahedra are listed in the grid again, per mean node
size."""

CUT_MARGIN = 0.5
"""Distance outside the skin at which the cut begins and ends, per mean node size."""

_RELOCATE, _RELOCATE_SPINE = SameTypes(relocate), SameTypes(relocate_spine)
_FORGET_CHANGED = SameTypes(forget_changed_faces)


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
        self._node_size = node_size
        toughness = toughness_law_of(material, blade).skin_toughness
        anchors = new_anchors(2, 1.0, anchor_stiffness(material, toughness, node_size))
        self.state = new_blade_state(anchors, blade, material, node_size, n_tetrahedra)
        """State for the kernels; replaced by another object when arrays grow."""
        self._shape, self._material = blade, material
        self._n_fibres = 0
        self._renew_report()
        self.edge_length = 0.0
        self.edge_now = (NOWHERE, 1.0)
        """The cutting edge over the last time step, and the instant of it that was reached, as a
        fraction."""
        self.grid = no_grid()
        self._all_nodes = np.zeros(0, np.int64)
        self._context: BladeContext | None = None

    def _renew_report(self) -> None:
        """Make a report with room for all contacts that the blade may have."""
        self.latest_report = new_report(self.state, self._n_fibres)
        self._views: dict[int, RigidContacts] = {}

    def take_materials(self, materials: MaterialArrays) -> None:
        """Take the materials of the body: toughness, stiffness and friction of each."""
        toughness, skin = toughness_of_materials(materials, self._shape)
        numbers = (materials, self._material, self._shape, self._node_size)
        stiffest = float(materials.young_modulus.max())
        stiffness = FACE_STIFFNESS * stiffest / self._node_size
        labels, place = np.unique(materials.label, return_inverse=True)
        if len(labels) > 1 and not len(self.state.totals.cutting_of_labels):
            totals = self.state.totals.replaced(cutting_of_labels=np.zeros(len(labels)))
            self.state = self.state.replaced(totals=totals)
            self._renew_report()
        self.state = self.state.replaced(
            toughness=self.state.toughness.replaced(
                toughness=float(toughness[0]),
                skin_toughness=float(skin[0]),
                label=place.reshape(-1).astype(np.int64),
                exponent=materials.toughness_exponent,
                doubling_speed=materials.toughness_speed,
                blunt=blunt_toughness(materials, self._shape),
                relative=relative_numbers(*numbers),
            ),
            sides=self.state.sides.replaced(
                stiffness=stiffness,
                of_materials=np.stack([materials.blade_friction, materials.blade_viscosity], 1),
            ),
        )

    def _first_of(self, materials: MaterialArrays) -> Material:
        """Return the first material of the body, over which numbers of others are given."""
        if materials.n == 1:
            return self._material
        modulus, ratio = float(materials.young_modulus[0]), float(materials.poisson_ratio[0])
        return self._material.changed(young_modulus=modulus, poisson_ratio=ratio)

    def make_room_for_fibres(self, n: int) -> None:
        """Make room for that many contacts with fibres."""
        if n > self._n_fibres:
            self._n_fibres = n
            self._renew_report()

    @property
    def n_samples(self) -> int:
        """Number of samples of the edge."""
        return len(self.state.anchors.state)

    @property
    def contacts(self) -> RigidContacts:
        """Contacts of the blade at the end of the last step: views, which the next step changes."""
        n, views = self.latest_report.n_contacts, self._views
        if n not in views:
            views[n] = contacts_of(self.latest_report, n)
        return views[n]

    @property
    def has_faces(self) -> bool:
        """Whether the blade has side faces; a line that cuts has none."""
        return self._shape is not None

    @property
    def is_engaged(self) -> bool:
        """Whether the edge is in the tissue."""
        return is_engaged(self.state.anchors)

    def is_other_edge(self, length: float) -> bool:
        """Return whether an edge of that length [m] differs from the current one; 0 is no edge."""
        return is_other_length(length, self.edge_length)

    def expect_usable_edge(self, length: float) -> None:
        """Refuse an edge of a length [m] that does not fit the mesh.

        It is at least as long as two samples are apart.

        Raises:
            ValueError: it is too short or too long.
        """
        shortest = self._node_size / SAMPLES_PER_NODE_SIZE
        longest = MOST_SAMPLES * shortest
        if shortest <= length <= longest:
            return
        why, advice = (
            ("shorter than this mesh resolves", "Use a longer edge or a finer mesh")
            if length < shortest
            else ("too long for this mesh", "Pass only the part of the edge that meets the tissue")
        )
        raise ValueError(
            f"the edge of the blade is {length * 1e3:.3g} mm long, {why}, whose mean node size is "
            f"{self._node_size * 1e3:.3g} mm: it has {shortest * 1e3:.3g} to {longest * 1e3:.3g} "
            f"mm. {advice}"
        )

    def replace_edge(self, length: float, body: Body) -> None:
        """Release the anchors of the current edge, and use an edge of another length.

        Args:
            length: Length of the new edge [m]; 0 for no edge.
            body: The tissue.
        """
        release_edge(self.state, body, *self.edge_now)
        n = math.ceil(length / self._node_size * SAMPLES_PER_NODE_SIZE) + 1
        first = self._first_of(body.materials)
        toughness = self.state.toughness.skin_toughness
        stiffness = anchor_stiffness(first, toughness, self._node_size)
        anchors = new_anchors(max(n, 2), length, stiffness)
        self.state = self.state.replaced(anchors=anchors)
        if self._shape is not None and length > 0.0:
            where = (self._shape, length, first, self._node_size)
            self.state = self.state.replaced(spine=new_spine_contacts(*where))
        self._renew_report()
        self.edge_length = length

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many tetrahedra; there are no rows of nodes."""
        del n_nodes
        self.state = self.state.replaced(sides=grown_face_contacts(self.state.sides, n_tetrahedra))

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Find the tetrahedra of the anchors again after a pass of a cut."""
        body, visits, change, _ = changed
        _RELOCATE.call(self.state, body, visits, *self.edge_now)
        _RELOCATE_SPINE.call(self.state, body, visits)
        if self._shape is not None:
            _FORGET_CHANGED.call(self.state.sides, body, change.dirty, change.n_dirty)

    def context(
        self, body: Body, visits: Visits, path: Path, bounds: FloatArray, slit_reach: float
    ) -> BladeContext:
        """Return the arrays as one struct; another one where an owner has replaced its own.

        Args:
            body: The tissue.
            visits: For searches.
            path: Path of the edge through the material.
            bounds: Lowest and highest corner of a box around the tissue [m], shape (2, 3). They,
                and the distance below, are the same for all steps.
            slit_reach: Distance from a cut face up to which a point is in the slit [m]
                (`tissue.blade.edge_search.is_in_slit`).
        """
        context = self._context
        if (
            context is None
            or context.blade is not self.state
            or context.body is not body
            or context.visits is not visits
            or context.path is not path
            or context.grid is not self.grid
            or context.report is not self.latest_report
        ):
            self._context = context = BladeContext(
                blade=self.state,
                body=body,
                visits=visits,
                path=path,
                grid=self.grid,
                report=self.latest_report,
                bounds=bounds,
                slit_reach=slit_reach,
                cut_margin=CUT_MARGIN * self._node_size,
            )
        return context

    def renewed(self, context: BladeContext) -> BladeContext:
        """Return the struct with the arrays that were replaced since."""
        return self.context(
            context.body, context.visits, context.path, context.bounds, context.slit_reach
        )

    def update_faces(
        self, context: BladeContext, moved: Moved | None, edge: Edge | None, when: float
    ) -> None:
        """Find the faces of the tissue that the side faces of the blade may touch.

        Args:
            context: Body and blade.
            moved: Nodes that moved since the last search; None where all may have.
            edge: The cutting edge over the time step; None for no blade.
            when: Instant, as a fraction of the time step.
        """
        if not self.has_faces:
            return
        if edge is None:
            release_sides(self.state)
            return
        while True:
            outcome = update_faces(context, edge, when, *self._to_list(context.body, moved))
            self._note_search(outcome, moved)
            if outcome not in (GRID_IS_FULL, NO_ROOM_FOR_FACES):
                return
            context = self.with_room(outcome, context)

    def update_anchors(
        self,
        context: BladeContext,
        external: FloatArray,
        moved: Moved | None,
        edge: Edge,
        when: float,
    ) -> None:
        """Anchor the samples of the edge that entered the tissue, and free those that left it.

        Args:
            context: Body and blade.
            external: Forces on the nodes [N], shape (capacity, 3); those of the blade are cleared.
            moved: Nodes that moved since the last search; None where all may have.
            edge: The cutting edge over the time step.
            when: Instant, as a fraction of the time step.
        """
        body, is_again = context.body, False
        while True:
            nodes = self._to_list(body, moved)
            outcome = update_anchors(context, external, edge, when, *nodes, is_again)
            self._note_search(outcome, moved)
            if outcome != GRID_IS_FULL:
                return
            context, is_again = self.with_room(outcome, context), True

    def with_room(self, outcome: int, context: BladeContext) -> BladeContext:
        """Return the struct with room for what a search found full.

        Args:
            outcome: `GRID_IS_FULL` or `NO_ROOM_FOR_FACES`.
            context: Body and blade.
        """
        if outcome == NO_ROOM_FOR_FACES:
            self.state = self.state.replaced(sides=with_more_faces(self.state.sides))
            self._renew_report()
        else:
            body, margin = context.body, GRID_MARGIN * self._node_size
            self.grid = build_grid(body, body.positions, margin)
            forget_cells(self.state.sides)
        return self.renewed(context)

    def all_nodes(self, body: Body) -> IntArray:
        """Return 0, 1, 2, ... up to the room that the body has for nodes."""
        if len(self._all_nodes) != len(body.positions):
            self._all_nodes = np.arange(len(body.positions))
        return self._all_nodes

    def _to_list(self, body: Body, moved: Moved | None) -> tuple[IntArray, int]:
        """Return the nodes whose tetrahedra may have to be listed again, and how many they are."""
        if moved is not None:
            return moved.nodes, moved.n_nodes
        return self.all_nodes(body), body.n_nodes

    def _note_search(self, outcome: int, moved: Moved | None) -> None:
        """Forget the nodes that moved where a search has listed their tetrahedra."""
        if moved is not None and outcome != NOT_SEARCHED:
            forget_moved(moved)


def relative_numbers(
    materials: MaterialArrays, material: Material, shape: BladeShape | None, node_size: float
) -> FloatArray:
    """Return `ToughnessLaw.relative` of the materials of a body.

    Args:
        materials: The materials.
        material: Whose law they have.
        shape: Shape of the blade; None for a line.
        node_size: Mean node size of the body [m].
    """
    toughness, skin = toughness_of_materials(materials, shape)
    moduli = materials.young_modulus
    anchors = [
        anchor_stiffness(material, skin[i], node_size, float(moduli[i])) for i in range(len(skin))
    ]
    columns = (toughness, skin, np.array(anchors), moduli / (1.0 - materials.poisson_ratio**2))
    # Of 0, tissue that nothing cuts: all of it is.
    firsts = [column[0] or 1.0 for column in columns]
    return np.stack([column / first for column, first in zip(columns, firsts, strict=True)], axis=1)
