"""`System`: a body with everything that acts on it, as integrators advance it."""

import math

import numpy as np

from tissue.blade.interaction import BladeInteraction
from tissue.blade_shape import BladeShape
from tissue.contact.self_contact import SelfContact
from tissue.core.array_types import IntArray
from tissue.cut_settings import MeshMeasures
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import Surroundings
from tissue.integrators.stability import stable_step
from tissue.integrators.stages import new_stages
from tissue.integrators.step_context import StepContext
from tissue.material import Material
from tissue.mesh.body import Body, grown_body
from tissue.mesh.changes import Change
from tissue.mesh.cut_error import lowest_altitude
from tissue.mesh.star import LARGEST_STAR, Visits, mean_node_size, no_visits


class System:
    """The owners of the arrays that take part in a step.

    Args:
        body: Nodes and tetrahedra.
        elasticity: Forces inside the body.
        contact: Contact of the body with itself and the floor.
        interaction: Forces between blade and body.
        surroundings: Gravity and damping.
        visits: Scratch for searches, with room for the body.
        node_size: Mean node size of the body [m].
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
    ) -> None:
        self.body = body
        self.elasticity = elasticity
        self.contact = contact
        self.interaction = interaction
        self.surroundings = surroundings
        self.visits = visits
        self.node_size = node_size
        self.stages = new_stages(len(body.rest))
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
            or context.contact is not self.contact.arrays
            or context.stages is not self.stages
        ):
            self._context = context = StepContext(
                body=self.body,
                elastic=self.elasticity.arrays,
                blade=self.interaction.state,
                contact=self.contact.arrays,
                surroundings=self.surroundings,
                stages=self.stages,
                visits=self.visits,
            )
        return context

    def mesh_changed(self, change: Change, nodes: IntArray) -> None:
        """Update what depends on the tetrahedra that a pass of a cut changed, and their nodes."""
        self.elasticity.mesh_changed(self.body, self.visits, change, nodes, len(nodes))
        self.interaction.mesh_changed(self.body, self.visits, change)
        self.contact.mesh_changed(self.body, change)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        self.body = grown_body(self.body, n_nodes, n_tetrahedra)
        self.visits = no_visits(n_nodes, n_tetrahedra)
        self.stages = new_stages(n_nodes)
        self.elasticity.grow(n_nodes, n_tetrahedra)
        self.interaction.grow(n_tetrahedra)
        self.contact.grow(n_nodes, n_tetrahedra)

    def measures(self) -> MeshMeasures:
        """Return what bounds the time step of the body now."""
        squared = self.elasticity.frequency_squared
        return MeshMeasures(
            n_tetrahedra=self.body.n_tetrahedra,
            altitude=lowest_altitude(self.body),
            frequency=math.sqrt(squared),
            time_step=stable_step(self.elasticity, squared, self.surroundings),
        )


def assembled(
    body: Body,
    material: Material,
    surroundings: Surroundings,
    blade: BladeShape | None,
    floor: float | None,
    is_tight: bool,
) -> System:
    """Return a body with its elasticity, its contact and the blade.

    Args:
        body: Masses are written.
        material: What it is made of.
        surroundings: Gravity and damping.
        blade: The body of the blade; None for a line that cuts.
        floor: Height of a floor below the body [m]; None for no floor.
        is_tight: Whether the bound on frequencies is brought near the truth; see `Elasticity`.
    """
    visits = no_visits(body.n_nodes, body.n_tetrahedra)
    elasticity = Elasticity(material, body, visits, is_tight=is_tight)
    node_size = mean_node_size(body, visits, np.zeros(LARGEST_STAR, dtype=np.int64))
    interaction = BladeInteraction(blade, material, node_size, body.n_tetrahedra)
    contact = SelfContact(body, node_size, material.friction, floor)
    return System(body, elasticity, contact, interaction, surroundings, visits, node_size)
