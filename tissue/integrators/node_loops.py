"""Loops over the nodes of a body: stages of Runge-Kutta steps, drift and kick of Verlet.

Each writes rows of nodes from `begin` to `end` alone, so that threads may share it.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, store_point, times
from tissue.core.simd_blocks import store_row
from tissue.core.simd_rows import natural
from tissue.elasticity.internal_forces import internal_force, viscous_force
from tissue.elasticity.mass_scaling import free_fall
from tissue.elasticity.neo_hookean import solid_force
from tissue.integrators.stages import Stages
from tissue.integrators.step_context import StepContext
from tissue.mesh.body import Body


@kernel
def is_solid(context: StepContext) -> bool:
    """Return whether tetrahedra alone act inside the body in the stages of a step.

    The loops over nodes are then compiled without what springs and dampers take, and write
    displacements beside positions.
    """
    elastic, time = context.elastic, context.surroundings.retardation_time
    return elastic.has_tetrahedra == 1 and elastic.has_springs == 0 and time == 0.0


@inlined
def acceleration(
    context: StepContext, node: int, positions: FloatArray, velocities: FloatArray
) -> Point:
    """Acceleration of a node at `positions` [m] and `velocities` [m/s]; of a fixed one zero."""
    return _acceleration(context, node, positions, velocities, False)


@inlined
def _acceleration(
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
    free = fall - times(surroundings.drag, point(velocities, node))
    total: Point = free + times(1.0 / body.masses[node], force)
    return total


@inlined
def _displace(context: StepContext, node: int, x: Point) -> None:
    """Write the displacement of a node from rest to `x` [m]."""
    store_row(context.elastic.solid.displacement, node, x - point(context.body.rest, node))


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
    for node in range(begin, end):
        i = natural(node)
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
    store_point(stages.last_positions, i, moved + times(0.5 * h * h, a3))
    store_point(stages.velocities, i, v + times(h, a3))
    both = a2 + a3
    store_point(body.positions, i, moved + times(h * h / 6.0, a1 + both))
    store_point(body.velocities, i, v + times(h / 6.0, a1 + both + both))


@kernel
def fourth_stage(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a4, and complete the velocities."""
    body, stages = context.body, context.stages
    x4, v4 = stages.last_positions, stages.velocities
    for i in range(begin, end):
        a4 = acceleration(context, i, x4, v4)
        store_point(body.velocities, i, point(body.velocities, i) + times(h / 6.0, a4))


@kernel
def nystroem_first(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a1 of the nodes from `begin` to `end`, and where the second stage has them."""
    if is_solid(context):
        for i in range(begin, end):
            _nystroem_first(context, h, i, True)
    else:
        for i in range(begin, end):
            _nystroem_first(context, h, i, False)


@inlined
def _nystroem_first(context: StepContext, h: float, i: int, solid: bool) -> None:
    body, stages = context.body, context.stages
    x, v = body.positions, body.velocities
    a1, now = _acceleration(context, i, x, v, solid), point(v, i)
    store_point(stages.a1, i, a1)
    x2 = point(x, i) + times(h / 3.0, now) + times(h * h / 18.0, a1)
    store_point(stages.positions, i, x2)
    store_point(stages.velocities, i, now + times(h / 3.0, a1))
    if solid:
        _displace(context, i, x2)


@kernel
def nystroem_second(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a2 of the nodes from `begin` to `end`, and where the third stage has them."""
    if is_solid(context):
        for i in range(begin, end):
            _nystroem_second(context, h, i, True)
    else:
        for i in range(begin, end):
            _nystroem_second(context, h, i, False)


@inlined
def _nystroem_second(context: StepContext, h: float, i: int, solid: bool) -> None:
    body, stages = context.body, context.stages
    a2 = _acceleration(context, i, stages.positions, stages.velocities, solid)
    x, v, a1 = point(body.positions, i), point(body.velocities, i), point(stages.a1, i)
    store_point(stages.a2, i, a2)
    bend = times(5.0 / 144.0 * h * h, a1) + times(5.0 / 16.0 * h * h, a2)
    x3 = x + times(5.0 / 6.0 * h, v) + bend
    store_point(stages.last_positions, i, x3)
    v3 = v + times(1.25 * h, a2) - times(5.0 / 12.0 * h, a1)
    store_point(stages.velocities, i, v3)
    if solid:
        _displace(context, i, x3)


@kernel
def nystroem_third(context: StepContext, h: float, begin: int, end: int) -> None:
    """Find a3 of the nodes from `begin` to `end`, and where they are after the step."""
    if is_solid(context):
        for i in range(begin, end):
            _nystroem_third(context, h, i, True)
    else:
        for i in range(begin, end):
            _nystroem_third(context, h, i, False)


@inlined
def _nystroem_third(context: StepContext, h: float, i: int, solid: bool) -> None:
    body, stages = context.body, context.stages
    a3 = _acceleration(context, i, stages.last_positions, stages.velocities, solid)
    x, v = point(body.positions, i), point(body.velocities, i)
    a1, a2 = point(stages.a1, i), point(stages.a2, i)
    bend = times(0.1, a1) + times(1.0 / 3.0, a2) + times(1.0 / 15.0, a3)
    store_point(body.positions, i, x + times(h, v) + times(h * h, bend))
    turn = times(0.1, a1) + times(0.5, a2) + times(0.4, a3)
    store_point(body.velocities, i, v + times(h, turn))


@kernel
def drift(context: StepContext, seconds: float, begin: int, end: int) -> None:
    """Move the nodes from `begin` to `end` with their velocities for some time [s]."""
    x, v = context.body.positions, context.body.velocities
    if is_solid(context):
        for i in range(begin, end):
            moved = point(x, i) + times(seconds, point(v, i))
            store_point(x, i, moved)
            _displace(context, i, moved)
    else:
        for i in range(begin, end):
            store_point(x, i, point(x, i) + times(seconds, point(v, i)))


@kernel
def kick(context: StepContext, h: float, begin: int, end: int) -> None:
    """Accelerate the nodes from `begin` to `end` for `h` [s] where they are.

    Where tetrahedra alone act, nodes then drift for `h / 2`, too. Springs see all nodes where they
    are, so that none may move before all are accelerated.
    """
    x, v = context.body.positions, context.body.velocities
    if is_solid(context):
        for i in range(begin, end):
            now = point(v, i) + times(h, _acceleration(context, i, x, v, True))
            store_point(v, i, now)
            store_point(x, i, point(x, i) + times(0.5 * h, now))
    else:
        for i in range(begin, end):
            store_point(v, i, point(v, i) + times(h, _acceleration(context, i, x, v, False)))
