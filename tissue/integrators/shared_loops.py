"""The loops over a body that a step consists of, which threads share.

Every loop writes one row for each of its items, from what loops before it wrote; sums are gathered.
So its result does not depend on who runs which part of it (`tissue.core.thread_team`).
"""

from tissue.core.jit import kernel
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
from tissue.elasticity.neo_hookean import (
    corner_forces,
    displacement_gradients,
    displacements,
    has_averaged_volumes,
    pressures_in_order,
)
from tissue.elasticity.viscoelasticity import relax_blocks
from tissue.integrators.damping import damping_changes
from tissue.integrators.node_loops import (
    drift,
    first_stage,
    fourth_stage,
    kick,
    nystroem_first,
    nystroem_second,
    nystroem_third,
    second_stage,
    third_stage,
)
from tissue.integrators.step_context import StepContext

GRADIENTS, CORNER_FORCES, STRESS_RELAXATION = 0, 1, 2
"""Loops over blocks of tetrahedra."""
DISPLACEMENTS, DISPLACEMENTS_2, DISPLACEMENTS_LAST, PRESSURES = 3, 4, 5, 6
"""Loops over nodes; displacements of the body, of `Stages.positions` and of `last_positions`."""
DISPLACED = -1
"""Stands for a loop of displacements where the loop before has written them."""
DEFORMED = -2
"""Stands for it where gradients are known, too (`Solid.are_gradients_known`)."""
FIRST_STAGE, SECOND_STAGE, THIRD_STAGE, FOURTH_STAGE = 7, 8, 9, 10
"""Loops over nodes of the Runge-Kutta method on two levels."""
NYSTROEM_FIRST, NYSTROEM_SECOND, NYSTROEM_THIRD = 11, 12, 13
"""Loops over nodes of the method of three stages."""
DRIFTING, KICKING = 14, 15
"""Loops over nodes of position Verlet."""
DAMPING_CHANGES = 16
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
    is_of_blocks = loop <= STRESS_RELAXATION
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
def take_part(context: StepContext, longest_spin: int) -> int:
    """Run chunks of loops that another thread opens; return how many.

    It returns where no loop has been opened for a while.

    Args:
        context: What takes part, the same struct as the other thread's.
        longest_spin: Times to look for a chunk in vain before it returns.
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
def deform_shared(context: StepContext, loop_of_displacements: int) -> None:
    """Evaluate all tetrahedra; see `tissue.elasticity.internal_forces.deform`.

    Args:
        context: What takes part.
        loop_of_displacements: Says at which positions; `DISPLACED` or `DEFORMED` where that is
            not needed.
    """
    elastic = context.elastic
    if elastic.has_tetrahedra:
        solid = elastic.solid
        if loop_of_displacements >= 0:
            run_loop(context, loop_of_displacements, 0.0)
        if loop_of_displacements != DEFORMED:
            run_loop(context, GRADIENTS, 0.0)
        if has_averaged_volumes(solid):
            run_loop(context, PRESSURES, 0.0)
        run_loop(context, CORNER_FORCES, 0.0)


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
        damping_changes(
            context.damping, context.body, context.elastic, context.stages, seconds, begin, end
        )


@kernel
def _deform_part(context: StepContext, loop: int, begin: int, end: int) -> None:
    """Run a part of a loop of `deform_shared`, or of relaxation."""
    solid, body, stages = context.elastic.solid, context.body, context.stages
    if loop == GRADIENTS:
        displacement_gradients(solid, solid.every, begin, end)
    elif loop == CORNER_FORCES:
        corner_forces(solid, solid.every, begin, end)
    elif loop == STRESS_RELAXATION:
        relax_blocks(solid, begin, end)
    elif loop == PRESSURES:
        pressures_in_order(solid, begin, end)
    else:
        positions = body.positions
        if loop == DISPLACEMENTS_2:
            positions = stages.positions
        elif loop == DISPLACEMENTS_LAST:
            positions = stages.last_positions
        displacements(solid, body, positions, solid.every, begin, end)
