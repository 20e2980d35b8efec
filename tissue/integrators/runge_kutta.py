"""The two-level Runge-Kutta method: positions and velocities in one step of 4th order.

Nystroem's form (Collatz, chapter 2: the paper's reference [4]):

    a1 = a(t,       x,   v           )
    X  = x + h/2 v + h^2/8 a1                  one position for stages 2 and 3
    a2 = a(t + h/2, X,   v + h/2 a1  )
    a3 = a(t + h/2, X,   v + h/2 a2  )
    x4 = x + h v + h^2/2 a3
    a4 = a(t + h,   x4,  v + h a3    )
    x <- x + h v + h^2/6 (a1 + a2 + a3)        the paper's correction terms are those in h^2
    v <- v + h/6 (a1 + 2 a2 + 2 a3 + a4)

Elastic forces are evaluated three times a step. Damping is evaluated four times where it acts in
every stage, for the full order; by default it acts between the steps
(`tissue.integrators.damping`).
"""

from tissue.blade.edge import Edge
from tissue.blade.forces import apply_blade_forces
from tissue.contact.geoms.kinematic_contact import clear_geom_forces
from tissue.contact.response.contacts import clear_contact_forces
from tissue.contact.response.forces import add_contact_forces
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.elasticity.collapse import add_collapse_forces, clear_collapse_forces
from tissue.elasticity.internal_forces import deform
from tissue.integrators.attachments import add_attachment_forces, clear_attachment_forces
from tissue.integrators.geom_reactions import add_geom_reactions
from tissue.integrators.node_loops import acceleration
from tissue.integrators.shared_loops import (
    DISPLACEMENTS,
    DISPLACEMENTS_2,
    DISPLACEMENTS_LAST,
    FIRST_STAGE,
    FOURTH_STAGE,
    SECOND_STAGE,
    THIRD_STAGE,
    deform_shared,
    run_loop,
)
from tissue.integrators.step_context import StepContext
from tissue.integrators.strands import add_caught_forces
from tissue.integrators.supports import add_support_work


@kernel
def runge_kutta_nystroem(
    context: StepContext, edge: Edge, dt: float, at: float, share: float
) -> None:
    """Take one step, without contact or slip.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    body, stages = context.body, context.stages
    h = share * dt
    is_moving = context.supports.is_moving == 1
    half, end = at + 0.5 * share, at + share
    apply_outer_forces(context, edge, body.positions, body.velocities, at, share / 6.0, dt)
    deform_shared(context, DISPLACEMENTS)
    add_geom_reactions(context, body.positions, body.velocities, share / 6.0, dt)
    if is_moving:
        add_support_work(context, body.positions, body.velocities, h / 6.0)
    run_loop(context, FIRST_STAGE, h)
    x2 = stages.positions
    apply_outer_forces(context, edge, x2, stages.velocities, half, share * 2.0 / 3.0, dt)
    deform_shared(context, DISPLACEMENTS_2)
    add_geom_reactions(context, x2, stages.velocities, share * 2.0 / 3.0, dt)
    if is_moving:
        add_support_work(context, x2, stages.velocities, h * 2.0 / 3.0)
    run_loop(context, SECOND_STAGE, h)
    if context.surroundings.retardation_time > 0.0:
        run_loop(context, THIRD_STAGE, h)
    x4 = stages.last_positions
    apply_outer_forces(context, edge, x4, stages.velocities, end, share / 6.0, dt)
    deform_shared(context, DISPLACEMENTS_LAST)
    add_geom_reactions(context, x4, stages.velocities, share / 6.0, dt)
    if is_moving:
        add_support_work(context, x4, stages.velocities, h / 6.0)
    run_loop(context, FOURTH_STAGE, h)


@kernel
def apply_outer_forces(
    context: StepContext,
    edge: Edge,
    positions: FloatArray,
    velocities: FloatArray,
    when: float,
    share: float,
    dt: float,
) -> None:
    """Write the forces of blade, contact and attachments on nodes; count impulses and work.

    Those of tetrahedra that are flat are among them.

    Args:
        context: Forces on the nodes are written to its stages.
        edge: The cutting edge over the time step.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        when: Instant, as a fraction of the time step.
        share: Weight of this evaluation in the integral over the time step.
        dt: Length of the time step [s].
    """
    external = context.stages.external
    attachments, collapsing = context.attachments, context.elastic.collapsing
    clear_contact_forces(context.contacts, external)
    clear_attachment_forces(attachments, external)
    clear_geom_forces(context.geoms, external)
    clear_collapse_forces(collapsing, context.body, external)
    apply_blade_forces(context.blade, context.body, edge, positions, when, share, dt, external)
    add_contact_forces(context.contacts, positions, velocities, share * dt, external)
    add_attachment_forces(attachments, positions, velocities, when, share, dt, external)
    add_collapse_forces(collapsing, context.body, positions, external)
    if attachments.n_caught > 0:
        add_caught_forces(context, edge, positions, velocities, when, share, dt)


@kernel
def accelerations(context: StepContext, out: FloatArray) -> None:
    """Write the acceleration of every node as it is and moves now to `out` [m/s2]."""
    body, external = context.body, context.stages.external
    x, v = body.positions, body.velocities
    deform(context.elastic, body, x)
    add_attachment_forces(context.attachments, x, v, 1.0, 0.0, 1.0, external)
    add_collapse_forces(context.elastic.collapsing, body, x, external)
    add_geom_reactions(context, x, v, 0.0, 1.0)
    for i in range(body.n_nodes):
        store_point(out, i, acceleration(context, i, x, v))
    clear_attachment_forces(context.attachments, external)
    clear_geom_forces(context.geoms, external)
    clear_collapse_forces(context.elastic.collapsing, body, external)
