"""`TissueModel`: a body with everything that acts on it, as integrators advance it."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from operator import is_
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue.blade.edge import Edge
from tissue.blade.interaction import BladeInteraction
from tissue.blade_shape import BladeShape
from tissue.contact.geoms.geom import Geom
from tissue.contact.geoms.geom_contact import GeomContact, no_geoms
from tissue.contact.self_contact import SelfContact
from tissue.core.array_types import IntArray
from tissue.core.jit import SameTypes
from tissue.core.structs import Arrays
from tissue.core.thread_team import new_team
from tissue.core.vec3 import Vec3
from tissue.cut_settings import MeshMeasures
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import Surroundings
from tissue.elasticity.mass_scaling import added_mass_shares
from tissue.forces.attachments import Attachments, fibre_boxes, no_attachments
from tissue.forces.fibres import report_fibres
from tissue.forces.step_context import Damping, StepContext, new_stages, supports_at_rest
from tissue.integrators.stability import damping_rate, stable_step
from tissue.material import Material
from tissue.mesh.body import Body, grown_body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.cut_face_log import CutFaceLog
from tissue.mesh.node_means import write_node_means
from tissue.mesh.pieces import are_same_pieces, loose_pieces_of, no_loose_pieces
from tissue.mesh.rigid_cores import RigidCores
from tissue.mesh.star import LARGEST_STAR, mean_node_size, no_visits
from tissue.mesh.surface import inverted_share, lowest_altitude

INCREMENTS_TO_PIECES = 50
"""Increments of steps from a change of the mesh until loose pieces are found again: 50 ms in a
usual run. Finding them costs half a step of the integrator. Until then a piece that came
loose is taken as held, and drag slows its fall."""


_WRITE_MEANS = SameTypes(write_node_means)


class Numerics(NamedTuple):
    """Settings of the motion of a body, as far as its arrays depend on it."""

    mass_scaling: float | None
    """Frequency above which nodes get mass [1/s]; see `Elasticity`."""
    damps_between_steps: bool
    """Whether damping acts between steps; if not, in every stage of them."""
    is_single: bool
    """Whether forces of tetrahedra are computed in single precision."""
    averages_shear: bool
    """Whether a share of the shear of tetrahedra is averaged around nodes."""
    moves_together: bool
    """Whether all nodes are moved together; if not, as the paper does."""


class TissueModel:
    """A body and the owners of all arrays that take part in a step.

    Args:
        body: Nodes and tetrahedra; masses are written.
        material: What it is made of; of several materials the one whose law they have.
        gravity: Acceleration of free fall [m/s2].
        blade: The body of the blade; None for a line that cuts.
        floor: Height of a floor below the body [m]; None for no floor.
        numerics: How its motion is computed.
    """

    def __init__(
        self,
        body: Body,
        material: Material,
        gravity: Vec3,
        blade: BladeShape | None,
        floor: float | None,
        numerics: Numerics,
    ) -> None:
        self.body = body
        self.surroundings = Surroundings(
            gravity=gravity,
            drag=float(body.materials.viscous_damping.max()),
            retardation_time=float(body.materials.retardation_time.max()),
        )
        """Gravity and all damping."""
        self.visits = no_visits(body.n_nodes, body.n_tetrahedra)
        self.elasticity = Elasticity(
            material,
            body,
            self.visits,
            mass_scaling=numerics.mass_scaling,
            is_single=numerics.is_single,
            averages_shear=numerics.averages_shear,
            resists_collapse=numerics.moves_together,
        )
        self.cut_faces = CutFaceLog()
        self._around = np.zeros(LARGEST_STAR, dtype=np.int64)
        self._write_node_means(np.arange(body.n_nodes))
        self.node_size = mean_node_size(body, self.visits, self._around)
        """Mean node size of the body before any cut [m]."""
        self.interaction = BladeInteraction(blade, material, self.node_size, body.n_tetrahedra)
        if body.materials.n > 1:
            self.interaction.take_materials(body.materials)
        self.contact = SelfContact(
            body,
            self.node_size,
            material.friction,
            floor,
            self.elasticity.frequency_squared,
            acts=numerics.moves_together,
            adds_mass=self.elasticity.arrays.scaling.allowed < math.inf and not material.stiffens,
        )
        self.moves_together = numerics.moves_together
        """Whether all nodes are moved together."""
        self.stages = new_stages(len(body.rest))
        self._damps_between_steps = numerics.damps_between_steps
        self._set_damping()
        self.supports = supports_at_rest()
        """Whether fixed nodes move, and their work."""
        self.attachments = no_attachments()
        """Points that are tied to what moves from outside."""
        self.has_fibres = False
        """Whether any of them is a fibre, which the blade can cut."""
        self.added_by_attachments = 0.0
        """Amount that they add to w^2 of the body at most [1/s2]."""
        self.geoms = no_geoms(body, self.node_size)
        """Contact with rigid geoms."""
        self.cores = RigidCores()
        """Sets of tetrahedra that move as rigid bodies."""
        self.loose = no_loose_pieces()
        """The pieces that are not held, as they were found last."""
        self.touched = np.zeros(len(body.rest), dtype=np.int64)
        """Scratch: nodes that a pass of a cut touched."""
        self.increments_to_pieces = 0
        """Increments after which loose pieces are found again; 0: they are those found last."""
        self._context: StepContext | None = None
        self._parts: tuple[Arrays, ...] = ()
        self.find_loose_pieces()

    def materials_changed(self, *, is_elastic: bool) -> None:
        """Follow the materials of the body, which are other ones.

        `is_elastic`: whether forces inside it, or masses, are.
        """
        materials = self.body.materials
        if is_elastic:
            self.elasticity.take_materials(self.body, self.visits)
        self.interaction.take_materials(materials)
        self.body.drag[:] = 1.0
        self._write_node_means(np.arange(self.body.n_nodes))
        self.contact.take_friction(float(materials.friction[0]))
        self.geoms.search.is_due = 1
        self.contact.take_frequency(self.elasticity.frequency_squared)
        longest = float(materials.retardation_time.max())
        drag = float(materials.viscous_damping.max())
        self.surroundings = self.surroundings.replaced(retardation_time=longest, drag=drag)
        self._set_damping()

    def _write_node_means(self, nodes: IntArray) -> None:
        """Write means around nodes whose tetrahedra are other ones, or of other materials."""
        _WRITE_MEANS.call(self.body, self.visits, nodes, len(nodes), self._around)

    def _set_damping(self) -> None:
        """Divide damping into that in the stages of a step, and that between steps."""
        damps_between_steps = self._damps_between_steps
        surroundings = self.surroundings
        undamped = surroundings.replaced(drag=0.0, retardation_time=0.0)
        between = surroundings if damps_between_steps else undamped
        self._in_stages = undamped if damps_between_steps else surroundings
        self.damping = Damping(
            interval=1,
            owed=0.0,
            dissipated=0.0,
            is_counted=0,
            rate_uncut=damping_rate(self.elasticity.arrays, surroundings),
            retardation_time=between.retardation_time,
            drag=between.drag,
        )
        """The damping that acts between steps, and what it has dissipated."""

    @property
    def context(self) -> StepContext:
        """The arrays as one struct; another one where an owner has replaced its own."""
        parts = (
            self.body,
            self.elasticity.arrays,
            self.interaction.state,
            self.contact.forces,
            self.geoms.arrays,
            self._in_stages,
            self.damping,
            self.supports,
            self.attachments,
            self.loose,
            self.cores.arrays,
            self.stages,
            self.visits,
        )
        if self._context is None or not all(map(is_, parts, self._parts)):
            self._parts = parts
            fields = zip(StepContext.__annotations__, (*parts, new_team()), strict=True)
            self._context = StepContext(**dict(fields))
        return self._context

    @contextmanager
    def without_drag(self) -> Iterator[None]:
        """Take drag away for a while; what damping dissipates then is not counted."""
        in_stages, damping = self._in_stages, self.damping
        self._in_stages = in_stages.replaced(drag=0.0)
        self.damping = damping.replaced(drag=0.0)
        try:
            yield
        finally:
            self._in_stages, self.damping = in_stages, damping

    def relax_stress(self, seconds: float) -> None:
        """Relax the stress of the tissue where it is, for that time [s] or for ever (inf)."""
        if self.elasticity.relaxes:
            # Imported late: kernels that are not used cost no start.
            from tissue.integrators.damping import relax_stress

            relax_stress(self.context, seconds)

    def find_contacts(self, seconds: float) -> None:
        """Find the contacts that act as forces in a time step of that length [s]."""
        elasticity = self.elasticity
        by_node, highest = elasticity.arrays.frequency_squared, elasticity.frequency_squared
        self.contact.prepare(self.body, by_node, highest, math.inf, seconds)

    def touch(
        self,
        geoms: Sequence[Geom],
        origins: npt.ArrayLike | None = None,
        rotations: npt.ArrayLike | None = None,
    ) -> GeomContact:
        """Touch these rigid geoms from now on, and no others; return the contact.

        See `GeomContact` for the arguments.
        """
        self.geoms = GeomContact(geoms, self.body, self.node_size, origins, rotations)
        return self.geoms

    def find_geom_contacts(self, seconds: float) -> None:
        """Find the contacts with geoms in a time step of that length [s]."""
        self.geoms.begin_step(self.body, seconds)

    def take_attachments(
        self, attachments: Attachments, has_fibres: bool, added_frequency_squared: float
    ) -> None:
        """Take points that are tied to what moves from outside.

        Args:
            attachments: Their arrays.
            has_fibres: Whether any is a fibre, which the blade can cut.
            added_frequency_squared: What they add to w^2 of the body at most [1/s2].
        """
        self.attachments, self.has_fibres = attachments, has_fibres
        self.added_by_attachments = added_frequency_squared

    def replace_edge(self, length: float) -> None:
        """Release the tissue, and use an edge of another length [m]; 0 for no edge."""
        self.interaction.replace_edge(length, self.body)

    def find_loose_pieces(self) -> None:
        """Find the pieces that are not held; where they are those of before, keep the struct.

        With another one the next saved state looks up where all of the memory is, in a millisecond.
        """
        if self.surroundings.drag > 0.0:
            found = loose_pieces_of(self.body)
            if not are_same_pieces(found, self.loose):
                self.loose = found
        self.increments_to_pieces = 0

    def find_new_loose_pieces(self) -> None:
        """Find them again some increments after the mesh changed, as it may change in each."""
        self.increments_to_pieces -= 1
        if self.increments_to_pieces == 0:
            self.find_loose_pieces()

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """List new faces, and find loose pieces some increments later, and friction of nodes."""
        self.cut_faces.add(self.body, changed.change)
        self._write_node_means(changed.nodes)
        if self.increments_to_pieces == 0:
            self.increments_to_pieces = INCREMENTS_TO_PIECES

    def incision_ended(self) -> None:
        """Update what is tested once the blade has left an incision."""
        self.elasticity.return_mass(self.body)
        self.contact.incision_ended(self.body)
        self.find_loose_pieces()

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra in the body, and in scratch."""
        self.body = grown_body(self.body, n_nodes, n_tetrahedra)
        self.visits = no_visits(n_nodes, n_tetrahedra)
        self.stages = new_stages(n_nodes)
        self.touched = np.zeros(n_nodes, dtype=np.int64)

    def report_fibres(self, edge: Edge) -> None:
        """Add the fibres, where there are any, to what the blade reported: forces and bounds."""
        if not self.has_fibres:
            return
        report, fibres, positions = (
            self.interaction.latest_report,
            self.attachments,
            self.body.positions,
        )
        report_fibres(report, fibres, positions, edge)
        boxes, (low, high) = fibre_boxes(fibres, positions), report.bounds
        low[:] = np.minimum(low, boxes[:, 0].min(axis=0, initial=math.inf))
        high[:] = np.maximum(high, boxes[:, 1].max(axis=0, initial=-math.inf))

    def measures(self, method: int) -> MeshMeasures:
        """Return what bounds the time step of the body now.

        `method`: a constant of `tissue.integrators.stability`.
        """
        squared = self.elasticity.frequency_squared
        shares = added_mass_shares(self.elasticity.arrays.scaling, self.body)
        return MeshMeasures(
            n_tetrahedra=self.body.n_tetrahedra,
            altitude=lowest_altitude(self.body),
            frequency=math.sqrt(squared),
            time_step=stable_step(method, self.elasticity.arrays, squared, self.surroundings),
            added_mass=shares.now,
            most_added_mass=shares.largest,
            inverted=inverted_share(self.body),
        )
