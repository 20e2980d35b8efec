"""Fixed nodes as supports: the force that holds each, and the work of those that move."""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, store_point, times
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.internal_forces import internal_force, viscous_force
from tissue.forces.step_context import StepContext


@inlined
def support_force(
    context: StepContext,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the force that holds a fixed node [N], after `deform` at the same positions.

    Args:
        context: Body, elasticity, and the other forces on the nodes.
        node: The fixed node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness of the dampers that count [s].
    """
    body, stages = context.body, context.stages
    weight = body.masses[node] - body.added_masses[node]
    total = times(weight, point_of(*context.surroundings.gravity))
    total = total + internal_force(context.elastic, node, positions, velocities, retardation_time)
    total = total + point(stages.external, node) + point(stages.loads, node)
    held: Point = times(-1.0, total)
    return held


@kernel
def add_support_work(
    context: StepContext, positions: FloatArray, velocities: FloatArray, seconds: float
) -> None:
    """Add the work of moving supports over some time [s], after `deform` at these positions.

    Args:
        context: The work is added to its supports.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        seconds: Weight of this instant in the integral over time [s].
    """
    body, supports = context.body, context.supports
    time = context.surroundings.retardation_time
    power = 0.0
    for i in range(body.n_nodes):
        if body.fixed[i]:
            force = support_force(context, i, positions, velocities, time)
            store_point(supports.force, 0, force)
            power += dot(vec3(supports.force, 0), vec3(body.velocities, i))
    supports.work += seconds * power


@kernel
def add_support_damping(context: StepContext, seconds: float) -> None:
    """Add what moving supports put into dampers that act between steps, for some time [s].

    The work is dissipated at once: the dampers store nothing.
    """
    body, supports, damping = context.body, context.supports, context.damping
    time = damping.retardation_time
    if time == 0.0:
        return
    power = 0.0
    for i in range(body.n_nodes):
        if body.fixed[i]:
            force = viscous_force(context.elastic, i, body.positions, body.velocities, time)
            store_point(supports.force, 0, force)
            power -= dot(vec3(supports.force, 0), vec3(body.velocities, i))
    supports.work += seconds * power
    damping.dissipated += seconds * power
