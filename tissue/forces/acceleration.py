"""Acceleration of one node: what the stages of all methods evaluate, and what reactions correct."""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, times
from tissue.core.simd_rows import natural
from tissue.elasticity.internal_forces import internal_force
from tissue.elasticity.mass_scaling import free_fall
from tissue.elasticity.neo_hookean import solid_force
from tissue.forces.step_context import StepContext


@kernel
def is_solid(context: StepContext) -> bool:
    """Return whether tetrahedra alone act inside the body in the stages of a step.

    The loops over nodes are then compiled without what springs and viscosity take, and write
    displacements as well as positions.
    """
    elastic, time = context.elastic, context.surroundings.retardation_time
    return elastic.has_tetrahedra == 1 and elastic.has_springs == 0 and time == 0.0


@inlined
def acceleration(
    context: StepContext, node: int, positions: FloatArray, velocities: FloatArray
) -> Point:
    """Acceleration of a node at `positions` [m] and `velocities` [m/s]; of a fixed one zero."""
    return acceleration_of(context, node, positions, velocities, False)


@inlined
def acceleration_of(
    context: StepContext, node: int, positions: FloatArray, velocities: FloatArray, solid: bool
) -> Point:
    """Return `acceleration`.

    Args:
        context: What takes part.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        solid: What `is_solid` returns; a constant where this is called.
    """
    body, surroundings, node = context.body, context.surroundings, natural(node)
    if body.fixed[node]:
        return point_of(0.0, 0.0, 0.0)
    if solid:
        force = solid_force(context.elastic.solid, node)
    else:
        time = surroundings.retardation_time
        force = internal_force(context.elastic, node, positions, velocities, time)
    force = force + point(context.stages.external, node) + point(context.stages.loads, node)
    fall = free_fall(body, node, surroundings.gravity)
    drag = surroundings.drag * body.drag[node]
    free = fall - times(drag, point(velocities, node))
    total: Point = free + times(1.0 / body.masses[node], force)
    return total
