"""The forces that act on nodes from outside, in one list for each verb and in one fixed order.

Blade, contact of the body with itself and the floor, attachments with their fibres, tetrahedra that
are nearly flat, contact with rigid geoms, rigid cores, and supports. Another force is one more line
in each function. Three exceptions have physical reasons:

- Contacts with geoms react to all other forces, rigid cores to these too, and supports bear them:
  `add_reactions` follows once the body is deformed.
- The blade slips last in `end_substep`, where all nodes are at the end of the step.
- What contact and attachments add to the frequencies is constant in an increment: it is found
  before, where they are.
"""

from typing import NamedTuple

from tissue.blade.edge import Edge
from tissue.blade.edge_anchors import is_engaged
from tissue.blade.faces_contact import faces_energy
from tissue.blade.forces import (
    apply_blade_forces,
    apply_slip,
    edge_energy,
    frequency_with_blade,
    limit_frequency_at_blade,
)
from tissue.contact.geoms.kinematic_contact import clear_geom_forces, end_geom_substep
from tissue.contact.response.contacts import clear_contact_forces
from tissue.contact.response.forces import add_contact_forces, end_contact_substep
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import point_of, store_point
from tissue.elasticity.collapse import add_collapse_forces, clear_collapse_forces, find_collapsing
from tissue.elasticity.internal_forces import deform, keep_viscous_forces, resist
from tissue.forces.acceleration import acceleration
from tissue.forces.attachments import (
    add_attachment_forces,
    attached_energy,
    clear_attachment_forces,
)
from tissue.forces.core_reactions import add_core_reactions, clear_core_forces
from tissue.forces.fibres import add_caught_forces, slip_fibres
from tissue.forces.geom_reactions import add_geom_reactions
from tissue.forces.step_context import Instant, StepContext
from tissue.forces.supports import add_support_work, support_force
from tissue.laws.kernels import stiffens


class TermEnergies(NamedTuple):
    """Energy that is stored in the springs of each kind of force [J]."""

    edge: float
    """Energy in the anchors of the edge and the blunt sides of the blade."""
    sides: float
    """Energy between the side faces of the blade and the body."""
    contacts: float
    """Energy in contacts of the body with itself and the floor."""
    attachments: float
    """Energy in the springs of attachments."""


@kernel
def clear_terms(context: StepContext) -> None:
    """Clear the forces of attachments, geoms, flat tetrahedra and rigid cores on the nodes."""
    external = context.stages.external
    clear_attachment_forces(context.attachments, external)
    clear_geom_forces(context.geoms, external)
    clear_collapse_forces(context.elastic.collapsing, context.body, external)
    clear_core_forces(context.cores, external)


@kernel
def add_terms(
    context: StepContext,
    edge: Edge,
    positions: FloatArray,
    velocities: FloatArray,
    instant: Instant,
) -> None:
    """Write the forces on nodes at an instant; count their impulses and works.

    Args:
        context: Forces on the nodes are written to its stages.
        edge: The cutting edge over the time step.
        positions: Positions of the nodes [m].
        velocities: Velocities of the nodes [m/s].
        instant: The instant, and its weight.
    """
    external, (when, share, _, dt) = context.stages.external, instant
    attachments, collapsing = context.attachments, context.elastic.collapsing
    clear_contact_forces(context.contacts, external)
    clear_terms(context)
    apply_blade_forces(context.blade, context.body, edge, positions, when, share, dt, external)
    add_contact_forces(context.contacts, positions, velocities, share * dt, external)
    add_attachment_forces(attachments, positions, velocities, when, share, dt, external)
    add_collapse_forces(collapsing, context.body, positions, external)
    if attachments.n_caught > 0:
        add_caught_forces(context, edge, positions, velocities, when, share, dt)


@kernel
def add_reactions(
    context: StepContext, positions: FloatArray, velocities: FloatArray, instant: Instant
) -> None:
    """Add what reacts to all other forces, after the body was deformed at the same positions.

    Args:
        context: Forces on the nodes are added to its stages, and the work of supports.
        positions: Positions of the nodes [m].
        velocities: Velocities of the nodes [m/s].
        instant: The instant, and its weight.
    """
    add_geom_reactions(context, positions, velocities, instant.share, instant.dt)
    add_core_reactions(context, positions, velocities)
    if context.supports.is_moving == 1:
        add_support_work(context, positions, velocities, instant.seconds)


@kernel
def end_substep(context: StepContext, edge: Edge, dt: float, share: float, when: float) -> None:
    """End a step: contacts slide, forces are cleared, geoms are corrected and the blade slips.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        share: Length of the step as a fraction of the time step.
        when: End of the step, as a fraction of the time step.
    """
    body, external, seconds = context.body, context.stages.external, share * dt
    end_contact_substep(context.contacts, body.positions, body.velocities, external)
    clear_terms(context)
    end_geom_substep(context.geoms, body, seconds, when, dt)
    apply_slip(context.blade, body, context.visits, edge, external, when, seconds)
    if context.attachments.n_caught > 0:
        slip_fibres(context.attachments, body.positions, edge, when)


@kernel
def bound_of_terms(
    context: StepContext,
    no_frequency: FloatArray,
    of_contact: float,
    speed: float,
    node_size: float,
    seconds: float,
) -> tuple[float, float]:
    """Return a bound on w^2 with the body at rest, and what is added to it where it strains [1/s2].

    Nodes that the blade makes too fast get mass.

    Args:
        context: What takes part.
        no_frequency: Zeros, shape (node capacity,).
        of_contact: What attachments add to w^2 at most, and contact where it is not known for each
            node [1/s2].
        speed: Speed of the fastest node [m/s].
        node_size: Mean node size of the body [m].
        seconds: Time to advance by [s].
    """
    elastic, body, external = context.elastic, context.body, context.stages.external
    near = limit_frequency_at_blade(context.blade, elastic, body, external)
    added = of_contact
    highest, collapsing = elastic.highest, elastic.collapsing
    find_collapsing(collapsing, body, elastic.frequency_squared, highest, speed, node_size, seconds)
    least = max(highest, near, collapsing.highest, elastic.highest_touching) + added
    if stiffens(elastic.solid.law):
        # Tissue that stiffens is stiffest where the blade holds it, and resists together with it.
        added += frequency_with_blade(context.blade, body, no_frequency, external)
    return least, added


@kernel
def energy_of_terms(context: StepContext, edge: Edge, when: float) -> TermEnergies:
    """Return the energy that is stored in the springs of each kind of force.

    Args:
        context: The body and all that acts on it.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
    """
    body, blade, attachments = context.body, context.blade, context.attachments
    return TermEnergies(
        edge_energy(blade, body, edge, when),
        faces_energy(blade.sides),
        context.contacts.stored,
        attached_energy(attachments, body.positions, 0, len(attachments.nodes)),
    )


@kernel
def leave_at_rest(context: StepContext) -> bool:
    """Return whether no force on nodes moves a body that rests.

    A loose piece that touches nothing drifts on, however slowly.
    """
    blade = context.blade
    is_touched = is_engaged(blade.anchors) or blade.sides.n_faces > 0 or blade.spine.n_pressing > 0
    is_drifting = len(context.loose.node) > 0 and context.contacts.n_contacts == 0
    if is_touched or is_drifting or context.supports.is_moving == 1:
        return False
    return bool(context.geoms.n_contacts == 0)


@kernel
def press_at_rest(context: StepContext, seconds: float) -> None:
    """Count some time [s] in which the body rests: its contacts press as they are."""
    body, contacts, external = context.body, context.contacts, context.stages.external
    if contacts.n_contacts > 0:
        add_contact_forces(contacts, body.positions, body.velocities, seconds, external)
        end_contact_substep(contacts, body.positions, body.velocities, external)


@kernel
def accelerations(context: StepContext, out: FloatArray) -> None:
    """Write the acceleration of every node as it is and moves now to `out` [m/s2]."""
    body = context.body
    _add_terms_at_rest(context, context.surroundings.retardation_time)
    for i in range(body.n_nodes):
        store_point(out, i, acceleration(context, i, body.positions, body.velocities))
    clear_terms(context)


@kernel
def write_support_forces(context: StepContext, out: FloatArray) -> None:
    """Write the force that holds each fixed node now to `out` [N], and zero for other nodes."""
    body = context.body
    time = context.surroundings.retardation_time + context.damping.retardation_time
    _add_terms_at_rest(context, time)
    for i in range(body.n_nodes):
        force = point_of(0.0, 0.0, 0.0)
        if body.fixed[i]:
            force = support_force(context, i, body.positions, body.velocities, time)
        store_point(out, i, force)
    clear_terms(context)


@kernel
def _add_terms_at_rest(context: StepContext, retardation_time: float) -> None:
    """Deform the body where it is, and add the forces on nodes there; nothing is counted.

    Args:
        context: Written.
        retardation_time: Of the viscosity that counts [s].
    """
    body, external = context.body, context.stages.external
    x, v = body.positions, body.velocities
    if retardation_time > 0.0:
        resist(context.elastic, body, x, v)
        keep_viscous_forces(context.elastic, body)
    deform(context.elastic, body, x)
    add_attachment_forces(context.attachments, x, v, 1.0, 0.0, 1.0, external)
    add_collapse_forces(context.elastic.collapsing, body, x, external)
    add_geom_reactions(context, x, v, 0.0, 1.0)
    add_core_reactions(context, x, v)
