"""The loops over a body that steps consist of, which threads share: of every method, and damping.

Each loop writes one row for each of its items from `begin` to `end`, from what loops before it
wrote; sums are gathered. So the result does not depend on who runs which part of it
(`tissue.core.thread_team`).
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Point, point, point_of, store_point, times
from tissue.core.simd_points import store_row
from tissue.core.simd_rows import natural
from tissue.core.thread_team import (
    claim_first,
    claim_last,
    end_chunk,
    items_of,
    open_loop,
    pause,
    wait_for_others,
)
from tissue.elasticity.finite_elements import n_blocks
from tissue.elasticity.gradients import displacements
from tissue.elasticity.internal_forces import viscous_force
from tissue.elasticity.neo_hookean import (
    average_volumes,
    corner_forces,
    displacement_gradients,
    has_averages,
)
from tissue.elasticity.viscoelasticity import relax_blocks, relax_nodes
from tissue.elasticity.viscous_stress import (
    average_rates,
    rates_of_deformation,
    viscous_forces,
    write_velocities,
)
from tissue.forces.acceleration import acceleration, acceleration_of, is_solid
from tissue.forces.step_context import Stages, StepContext
from tissue.mesh.body import Body

GRADIENTS, CORNER_FORCES, STRESS_RELAXATION, RATES, VISCOUS_FORCES = 0, 1, 2, 3, 4
"""Loops over blocks of tetrahedra."""
DISPLACEMENTS, DISPLACEMENTS_2, DISPLACEMENTS_LAST = 5, 6, 7
AVERAGES, NODE_RELAXATION, AVERAGE_RATES = 8, 9, 10
"""Loops over nodes; displacements of the body, of `Stages.positions` and of `last_positions`."""
DISPLACED = -1
"""Stands for a loop of displacements where the loop before has written them."""
DEFORMED = -2
"""Stands for it where gradients are known (`Solid.are_gradients_known`), and averaged shear."""
FIRST_STAGE, SECOND_STAGE, THIRD_STAGE, FOURTH_STAGE = 11, 12, 13, 14
"""Loops over nodes of the Runge-Kutta method on two levels."""
NYSTROEM_FIRST, NYSTROEM_SECOND, NYSTROEM_THIRD = 15, 16, 17
"""Loops over nodes of the method of three stages."""
DRIFTING, KICKING = 18, 19
"""Loops over nodes of position Verlet."""
DAMPING_CHANGES = 20
"""The loop over nodes of damping between steps."""

BLOCKS_OF_A_CHUNK = 32
"""Blocks of tetrahedra in a chunk: about 1 us. Fewer: claims, some 0.1 us, take more of the time;
more: the first thread waits longer for the last chunk."""

NODES_OF_A_CHUNK = 64
"""Nodes in a chunk: 0.2 to 1.5 us; see `BLOCKS_OF_A_CHUNK`."""


@kernel
def run_loop(context: StepContext, loop: int, seconds: float) -> None:
    """Run a loop over the whole body, with the other threads that take part.

    Args:
        context: What takes part.
        loop: Which loop.
        seconds: The step that it is for [s]; some loops need none.
    """
    is_of_blocks = loop <= VISCOUS_FORCES
    body, team = context.body, context.team
    n = n_blocks(context.elastic.solid, body.n_tetrahedra) if is_of_blocks else body.n_nodes
    if team.is_shared == 0:
        _run_part(context, loop, seconds, 0, n)
        return
    size = BLOCKS_OF_A_CHUNK if is_of_blocks else NODES_OF_A_CHUNK
    of_others = open_loop(team, loop, seconds, n, size)
    chunk = claim_first(team)
    while chunk >= 0:
        begin, end = items_of(team, chunk)
        _run_part(context, loop, seconds, begin, end)
        of_others -= 1
        chunk = claim_first(team)
    wait_for_others(team, of_others)


@kernel
def resist_shared(context: StepContext, velocities: FloatArray) -> None:
    """Evaluate how tetrahedra resist `velocities` [m/s], with threads, for `viscous_force`.

    After `displacements`, or the gradients where they are known; see `internal_forces.resist`.
    """
    solid = context.elastic.solid
    write_velocities(context.elastic.viscosity, context.body, velocities)
    run_loop(context, RATES, 0.0)
    if has_averages(solid):
        run_loop(context, AVERAGE_RATES, 0.0)
    run_loop(context, VISCOUS_FORCES, 0.0)


@kernel
def take_part(context: StepContext, longest_spin: int) -> int:
    """Run chunks of loops that another thread opens; return how many.

    It returns where no loop has been opened for a while.

    Args:
        context: What takes part, the same struct as the other thread's.
        longest_spin: Searches for a chunk in vain before it returns.
    """
    team, spins, n_chunks = context.team, 0, 0
    while spins < longest_spin:
        chunk = claim_last(team)
        if chunk >= 0:
            begin, end = items_of(team, chunk)
            _run_part(context, team.loop, team.seconds, begin, end)
            end_chunk(team)
            n_chunks += 1
            spins = 0
        else:
            pause()
            spins += 1
    return n_chunks


@kernel
def _run_part(context: StepContext, loop: int, seconds: float, begin: int, end: int) -> None:
    """Run a loop over its items from `begin` to `end`; see `run_loop`."""
    if loop < FIRST_STAGE:
        _deform_part(context, loop, begin, end)
    elif loop == FIRST_STAGE:
        first_stage(context, seconds, begin, end)
    elif loop == SECOND_STAGE:
        second_stage(context, seconds, begin, end)
    elif loop == THIRD_STAGE:
        third_stage(context, seconds, begin, end)
    elif loop == FOURTH_STAGE:
        fourth_stage(context, seconds, begin, end)
    elif loop == NYSTROEM_FIRST:
        nystroem_first(context, seconds, begin, end)
    elif loop == NYSTROEM_SECOND:
        nystroem_second(context, seconds, begin, end)
    elif loop == NYSTROEM_THIRD:
        nystroem_third(context, seconds, begin, end)
    elif loop == DRIFTING:
        drift(context, seconds, begin, end)
    elif loop == KICKING:
        kick(context, seconds, begin, end)
    else:
        damping_changes(context, seconds, begin, end)


@kernel
def _deform_part(context: StepContext, loop: int, begin: int, end: int) -> None:
    """Run a part of a loop of forces inside the body, or of relaxation."""
    solid, viscosity = context.elastic.solid, context.elastic.viscosity
    body, stages = context.body, context.stages
    if loop == GRADIENTS:
        displacement_gradients(solid, begin, end)
    elif loop == CORNER_FORCES:
        corner_forces(solid, begin, end)
    elif loop == STRESS_RELAXATION:
        relax_blocks(solid, begin, end)
    elif loop == RATES:
        rates_of_deformation(viscosity, solid, begin, end)
    elif loop == VISCOUS_FORCES:
        viscous_forces(viscosity, solid, begin, end)
    elif loop == AVERAGES:
        average_volumes(solid, begin, end)
    elif loop == NODE_RELAXATION:
        relax_nodes(solid, begin, end)
    elif loop == AVERAGE_RATES:
        average_rates(viscosity, solid, begin, end)
    else:
        positions = body.positions
        if loop == DISPLACEMENTS_2:
            positions = stages.positions
        elif loop == DISPLACEMENTS_LAST:
            positions = stages.last_positions
        displacements(solid, body, positions, begin, end)


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
    """Find a2, and how much the third stage's velocities differ; without viscosity a3 as well."""
    body, stages, surroundings = context.body, context.stages, context.surroundings
    x2, v2 = stages.positions, stages.velocities
    is_viscous = surroundings.retardation_time > 0.0
    for i in range(begin, end):
        a2 = acceleration(context, i, x2, v2)
        change = times(0.5 * h, a2 - point(stages.a1, i))
        if is_viscous:
            store_point(stages.a2, i, a2)
            store_point(stages.change, i, change)
        else:
            drag = surroundings.drag * body.drag[i]
            a3 = a2 if body.fixed[i] else a2 - times(drag, change)
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
            drag = surroundings.drag * body.drag[i]
            a3 = a3 - times(drag, point(stages.change, i))
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
    a1, now = acceleration_of(context, i, x, v, solid), point(v, i)
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
    a2 = acceleration_of(context, i, stages.positions, stages.velocities, solid)
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
    a3 = acceleration_of(context, i, stages.last_positions, stages.velocities, solid)
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
            now = point(v, i) + times(h, acceleration_of(context, i, x, v, True))
            store_point(v, i, now)
            store_point(x, i, point(x, i) + times(0.5 * h, now))
    else:
        for i in range(begin, end):
            store_point(v, i, point(v, i) + times(h, acceleration_of(context, i, x, v, False)))


@kernel
def damping_changes(context: StepContext, seconds: float, begin: int, end: int) -> None:
    """Find how damping over some time [s] changes the velocities of the nodes `begin` to `end`."""
    damping, body, stages = context.damping, context.body, context.stages
    time, drag = damping.retardation_time, damping.drag
    x, v = body.positions, body.velocities
    for node in range(begin, end):
        i = natural(node)
        change = point_of(0.0, 0.0, 0.0)
        if not body.fixed[i]:
            change = times(-drag * body.drag[i], point(v, i))
            if time > 0.0:
                force = viscous_force(context.elastic, i, x, v, time)
                change = change + times(1.0 / body.masses[i], force)
        store_point(stages.change, i, times(seconds, change))
