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
from tissue.contact.penalty.contact_forces import add_contact_forces, clear_contact_forces
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, store_point, times
from tissue.elasticity.internal_forces import deform, internal_force, viscous_force
from tissue.elasticity.mass_scaling import free_fall
from tissue.integrators.stages import Stages
from tissue.integrators.step_context import StepContext
from tissue.mesh.body import Body


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
    body, elastic, stages = context.body, context.elastic, context.stages
    h = share * dt
    n = body.n_nodes
    half, end = at + 0.5 * share, at + share
    apply_outer_forces(context, edge, body.positions, body.velocities, at, share / 6.0, dt)
    deform(elastic, body, body.positions)
    first_stage(context, h, 0, n)
    x2 = stages.positions
    apply_outer_forces(context, edge, x2, stages.velocities, half, share * 2.0 / 3.0, dt)
    deform(elastic, body, x2)
    second_stage(context, h, 0, n)
    if context.surroundings.retardation_time > 0.0:
        third_stage(context, h, 0, n)
    x4 = stages.positions_4
    apply_outer_forces(context, edge, x4, stages.velocities, end, share / 6.0, dt)
    deform(elastic, body, x4)
    fourth_stage(context, h, 0, n)


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
    """Write the forces of the blade and of contact on the nodes; count impulses and work.

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
    clear_contact_forces(context.contacts, external)
    apply_blade_forces(context.blade, context.body, edge, positions, when, share, dt, external)
    add_contact_forces(context.contacts, positions, velocities, share * dt, external)


@inlined
def acceleration(
    context: StepContext, node: int, positions: FloatArray, velocities: FloatArray
) -> Point:
    """Acceleration of a node at `positions` [m] and `velocities` [m/s]; of a fixed one zero."""
    body, surroundings = context.body, context.surroundings
    if body.fixed[node]:
        return point_of(0.0, 0.0, 0.0)
    time = surroundings.retardation_time
    force = internal_force(context.elastic, node, positions, velocities, time)
    force = force + point(context.stages.external, node)
    fall = free_fall(body, node, surroundings.gravity)
    free = fall - times(surroundings.drag, point(velocities, node))
    total: Point = free + times(1.0 / body.masses[node], force)
    return total


@kernel
def first_stage(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a1 of the nodes from `begin` to `end`, and the positions of the second stage."""
    body, stages = context.body, context.stages
    x, v = body.positions, body.velocities
    for i in range(begin, end):
        a1 = acceleration(context, i, x, v)
        store_point(stages.a1, i, a1)
        x2 = point(x, i) + times(0.5 * h, point(v, i)) + times(0.125 * h * h, a1)
        store_point(stages.positions, i, x2)
        store_point(stages.velocities, i, point(v, i) + times(0.5 * h, a1))


@kernel
def second_stage(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a2, and how much the third stage's velocities differ; without dampers a3 as well."""
    body, stages, surroundings = context.body, context.stages, context.surroundings
    x2, v2 = stages.positions, stages.velocities
    has_dampers = surroundings.retardation_time > 0.0
    for i in range(begin, end):
        a2 = acceleration(context, i, x2, v2)
        change = times(0.5 * h, a2 - point(stages.a1, i))
        if has_dampers:
            store_point(stages.a2, i, a2)
            store_point(stages.change, i, change)
        else:
            a3 = a2 if body.fixed[i] else a2 - times(surroundings.drag, change)
            _positions_and_velocities(body, stages, i, a2, a3, h)


@kernel
def third_stage(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a3: it differs from a2 by damping alone, and damping is linear in the velocities."""
    body, stages, surroundings = context.body, context.stages, context.surroundings
    time = surroundings.retardation_time
    for i in range(begin, end):
        a2 = point(stages.a2, i)
        a3 = a2
        if not body.fixed[i]:
            viscous = viscous_force(context.elastic, i, stages.positions, stages.change, time)
            a3 = a2 + times(1.0 / body.masses[i], viscous)
            a3 = a3 - times(surroundings.drag, point(stages.change, i))
        _positions_and_velocities(body, stages, i, a2, a3, h)


@inlined
def _positions_and_velocities(
    body: Body, stages: Stages, i: int, a2: Point, a3: Point, h: float
) -> None:
    """Write the new positions, and the new velocities without the part of a4."""
    x, v, a1 = point(body.positions, i), point(body.velocities, i), point(stages.a1, i)
    moved = x + times(h, v)
    store_point(stages.positions_4, i, moved + times(0.5 * h * h, a3))
    store_point(stages.velocities, i, v + times(h, a3))
    both = a2 + a3
    store_point(body.positions, i, moved + times(h * h / 6.0, a1 + both))
    store_point(body.velocities, i, v + times(h / 6.0, a1 + both + both))


@kernel
def fourth_stage(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a4, and complete the velocities."""
    body, stages = context.body, context.stages
    x4, v4 = stages.positions_4, stages.velocities
    for i in range(begin, end):
        a4 = acceleration(context, i, x4, v4)
        store_point(body.velocities, i, point(body.velocities, i) + times(h / 6.0, a4))


@kernel
def accelerations(context: StepContext, out: FloatArray) -> None:
    """Write the acceleration of every node as it is and moves now to `out` [m/s2]."""
    body = context.body
    deform(context.elastic, body, body.positions)
    for i in range(body.n_nodes):
        store_point(out, i, acceleration(context, i, body.positions, body.velocities))
