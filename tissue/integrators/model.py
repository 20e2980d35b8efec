"""`TissueModel`: a body with everything that acts on it, as integrators advance it."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from tissue.blade.blade_context import BladeContext
from tissue.blade.edge import Edge
from tissue.blade.interaction import BladeInteraction
from tissue.blade.wrench import BladeReport
from tissue.blade_shape import BladeShape
from tissue.contact.geoms.geom_contact import no_geoms
from tissue.contact.self_contact import SelfContact
from tissue.core.array_types import IntArray
from tissue.core.thread_team import new_team
from tissue.cut_settings import MeshMeasures
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import Surroundings
from tissue.elasticity.mass_scaling import added_mass_shares
from tissue.integrators.attachments import no_attachments, strand_boxes
from tissue.integrators.damping import Damping
from tissue.integrators.stability import damping_rate, stable_step
from tissue.integrators.stages import new_stages
from tissue.integrators.step_context import StepContext
from tissue.integrators.strands import report_strands
from tissue.integrators.support_state import supports_at_rest
from tissue.material import Material
from tissue.mesh.body import Body, grown_body
from tissue.mesh.changes import Change
from tissue.mesh.cut_error import inverted_share, lowest_altitude
from tissue.mesh.loose_pieces import are_same_pieces, loose_pieces_of, no_loose_pieces
from tissue.mesh.star import LARGEST_STAR, Visits, mean_node_size, no_visits

INCREMENTS_TO_PIECES = 50
"""Increments of steps from a change of the mesh until loose pieces are found again: 50 ms in a
usual run. Finding them costs half a step of the integrator. Until then a piece that came
loose is taken as held, and drag slows its fall."""


class TissueModel:
    """The owners of the arrays that take part in a step.

    Args:
        body: Nodes and tetrahedra.
        elasticity: Forces inside the body.
        contact: Contact of the body with itself and the floor.
        interaction: Forces between blade and body.
        surroundings: Gravity and damping.
        visits: Scratch for searches, with room for the body.
        node_size: Mean node size of the body [m].
        damps_between_steps: Whether damping acts between steps; if not, in every stage of them.
    """

    def __init__(
        self,
        body: Body,
        elasticity: Elasticity,
        contact: SelfContact,
        interaction: BladeInteraction,
        surroundings: Surroundings,
        visits: Visits,
        node_size: float,
        *,
        damps_between_steps: bool,
    ) -> None:
        self.body = body
        self.elasticity = elasticity
        self.contact = contact
        self.interaction = interaction
        self.surroundings = surroundings
        self.visits = visits
        self.node_size = node_size
        self.stages = new_stages(len(body.rest))
        undamped = surroundings.replaced(drag=0.0, retardation_time=0.0)
        damped = surroundings if damps_between_steps else undamped
        self._in_stages = undamped if damps_between_steps else surroundings
        self.damping = Damping(
            interval=1,
            owed=0.0,
            dissipated=0.0,
            is_counted=0,
            rate_uncut=damping_rate(elasticity.arrays, surroundings),
            retardation_time=damped.retardation_time,
            drag=damped.drag,
        )
        """The damping that acts between steps, and what it has dissipated."""
        self.supports = supports_at_rest()
        """Whether fixed nodes move, and their work."""
        self.attachments = no_attachments()
        """Points that are tied to what moves from outside."""
        self.has_strands = False
        """Whether any of them is a strand, which the blade can cut."""
        self.geoms = no_geoms(body, node_size)
        """Contact with rigid geoms."""
        self.added_by_attachments = 0.0
        """What they add to w^2 of the body at most [1/s2]."""
        self.loose = no_loose_pieces()
        """The pieces that are not held, as they were found last."""
        self._increments_to_pieces = 0
        self._context: StepContext | None = None

    @property
    def context(self) -> StepContext:
        """The arrays as one struct; another one where an owner has replaced its own."""
        context = self._context
        if (
            context is None
            or context.body is not self.body
            or context.elastic is not self.elasticity.arrays
            or context.blade is not self.interaction.state
            or context.contacts is not self.contact.forces
            or context.geoms is not self.geoms.arrays
            or context.stages is not self.stages
            or context.attachments is not self.attachments
            or context.loose is not self.loose
        ):
            self._context = context = StepContext(
                body=self.body,
                elastic=self.elasticity.arrays,
                blade=self.interaction.state,
                contacts=self.contact.forces,
                geoms=self.geoms.arrays,
                surroundings=self._in_stages,
                damping=self.damping,
                supports=self.supports,
                attachments=self.attachments,
                loose=self.loose,
                stages=self.stages,
                visits=self.visits,
                team=new_team(),
            )
        return context

    @contextmanager
    def without_drag(self) -> Iterator[None]:
        """Let nothing drag the nodes for a while; what damping dissipates then is not counted."""
        in_stages, damping = self._in_stages, self.damping
        self._in_stages = in_stages.replaced(drag=0.0)
        self.damping = damping.replaced(drag=0.0)
        self._context = None
        try:
            yield
        finally:
            self._in_stages, self.damping, self._context = in_stages, damping, None

    def relax_stress(self, seconds: float) -> None:
        """Let the stress of the tissue relax where it is, for that time [s] or for ever (inf)."""
        if self.elasticity.relaxes:
            # Imported late: kernels that are not used cost no start.
            from tissue.integrators.stress_relaxation import relax_stress

            relax_stress(self.context, seconds)

    def find_contacts(self, seconds: float, room: float = math.inf) -> None:
        """Find the contacts that act as forces in a time step of that length [s].

        `room`: what may be added to w^2 of the body without another step [1/s2].
        """
        elasticity = self.elasticity
        by_node, highest = elasticity.arrays.frequency_squared, elasticity.frequency_squared
        self.contact.prepare(self.body, by_node, highest, room, seconds)

    def find_loose_pieces(self) -> None:
        """Find the pieces that are not held; where they are those of before, keep the struct.

        With another one the next saved state looks up where all of the memory is, in a millisecond.
        """
        if self.surroundings.drag > 0.0:
            found = loose_pieces_of(self.body)
            if not are_same_pieces(found, self.loose):
                self.loose = found
        self._increments_to_pieces = 0

    def find_new_loose_pieces(self) -> None:
        """Find them again some increments after the mesh changed, as it may change in each."""
        if self._increments_to_pieces > 0:
            self._increments_to_pieces -= 1
            if self._increments_to_pieces == 0:
                self.find_loose_pieces()

    def mesh_changed(self, change: Change, nodes: IntArray, edge: Edge, when: float) -> None:
        """Update what depends on the tetrahedra that a pass of a cut changed, and their nodes.

        Args:
            change: What the pass changed.
            nodes: Nodes of the tetrahedra that changed.
            edge: The cutting edge over the time step.
            when: Instant of the pass, as a fraction of it.
        """
        if self._increments_to_pieces == 0:
            self._increments_to_pieces = INCREMENTS_TO_PIECES
        self.elasticity.mesh_changed(self.body, self.visits, change, nodes, len(nodes))
        self.interaction.mesh_changed(self.body, self.visits, change, edge, when)
        self.contact.mesh_changed(self.body, change)
        self.geoms.mesh_changed(self.body, change)

    def incision_ended(self) -> None:
        """Update what is looked at once the blade has left an incision."""
        self.elasticity.return_mass(self.body)
        self.contact.incision_ended(self.body)
        self.find_loose_pieces()

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        self.body = grown_body(self.body, n_nodes, n_tetrahedra)
        self.visits = no_visits(n_nodes, n_tetrahedra)
        self.stages = new_stages(n_nodes)
        self.elasticity.grow(n_nodes, n_tetrahedra)
        self.interaction.grow(n_tetrahedra)
        self.contact.grow(n_nodes, n_tetrahedra)
        self.geoms.grow(n_nodes, n_tetrahedra)

    def report(self, blade: BladeContext, edge: Edge, dt: float) -> BladeReport:
        """Return what a time step of `dt` [s] came to for the blade; bounds hold strands too."""
        if not self.has_strands:
            return self.interaction.report(blade, edge, dt)
        strands, positions = self.attachments, self.body.positions
        found = self.interaction.report(
            blade, edge, dt, lambda report: report_strands(report, strands, positions, edge)
        )
        boxes = strand_boxes(strands, positions)
        low = boxes[:, 0].min(axis=0, initial=math.inf)
        high = boxes[:, 1].max(axis=0, initial=-math.inf)
        bounds = (np.minimum(found.bounds[0], low), np.maximum(found.bounds[1], high))
        return found._replace(bounds=np.stack(bounds))

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


class Numerics(NamedTuple):
    """How the motion of a body is computed, as far as its arrays depend on it."""

    mass_scaling: float | None
    """Frequency above which nodes get mass [1/s]; see `Elasticity`."""
    damps_between_steps: bool
    """Whether damping acts between steps; if not, in every stage of them."""
    is_single: bool
    """Whether forces of tetrahedra are computed in single precision."""
    moves_together: bool
    """Whether all nodes are moved together; if not, as the paper does."""


def assembled(
    body: Body,
    material: Material,
    surroundings: Surroundings,
    blade: BladeShape | None,
    floor: float | None,
    numerics: Numerics,
) -> TissueModel:
    """Return a body with its elasticity, its contact and the blade.

    Args:
        body: Masses are written.
        material: What it is made of.
        surroundings: Gravity and damping.
        blade: The body of the blade; None for a line that cuts.
        floor: Height of a floor below the body [m]; None for no floor.
        numerics: How it is computed.
    """
    visits = no_visits(body.n_nodes, body.n_tetrahedra)
    elasticity = Elasticity(
        material,
        body,
        visits,
        mass_scaling=numerics.mass_scaling,
        is_single=numerics.is_single,
        resists_collapse=numerics.moves_together,
    )
    node_size = mean_node_size(body, visits, np.zeros(LARGEST_STAR, dtype=np.int64))
    interaction = BladeInteraction(blade, material, node_size, body.n_tetrahedra)
    touching = SelfContact(
        body,
        node_size,
        material.friction,
        floor,
        elasticity.frequency_squared,
        acts=numerics.moves_together,
    )
    owners = (body, elasticity, touching, interaction, surroundings, visits, node_size)
    return TissueModel(*owners, damps_between_steps=numerics.damps_between_steps)
