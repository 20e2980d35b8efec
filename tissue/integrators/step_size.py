"""Into how many steps an increment is divided: as many as stability needs, and not more.

Where stiffness depends on how far the body is strained, an increment is divided into parts of
two steps, and the number of steps is chosen for each part.
"""

import math
from typing import Final

from tissue.core.jit import kernel
from tissue.core.simd import point, store_point, times
from tissue.elasticity.finite_elements import Solid, averages_shear
from tissue.elasticity.frequency.strained import StepLimit, strained_frequency
from tissue.elasticity.gradients import keeps_gradients
from tissue.forces.step_context import StepContext
from tissue.forces.terms import bound_of_terms, press_at_rest
from tissue.integrators.damping import FASTEST_DECAY, LONGEST_INTERVAL, SLOW_DAMPING
from tissue.integrators.mass_limits import limit_mass, limit_mass_for_strain
from tissue.integrators.methods import METHODS, OF_LAST_STEP, OF_NEXT_STEP
from tissue.integrators.node_loops import (
    AVERAGES,
    DISPLACEMENTS,
    DISPLACEMENTS_LAST,
    GRADIENTS,
    run_loop,
)
from tissue.integrators.resting import (
    FASTEST_AT_REST,
    MOTION_AT_REST,
    SPEED_AT_REST,
    TIME_TO_REST,
    have_stayed,
    keep_positions,
    may_rest,
    mean_speed,
    stop_nodes,
)
from tissue.integrators.stability import damping_rate, stable_step, without_another_step
from tissue.integrators.step_choice import StepChoice
from tissue.laws.kernels import stiffens
from tissue.mesh.bounding_boxes import largest_speed

STEPS_BETWEEN_STRAIN_BOUNDS: Final = 2
"""Steps between two bounds on the frequencies of the strained body. A lip that snaps back, or is
pinched, is as much shorter within a frame of eight steps as an element is long."""

MOTION_BETWEEN_STRAIN_BOUNDS: Final = 0.001
"""Longest way of a node from one bound to the next where there are more steps between them, as a
share of the node size: some percent of the least altitude of slivers. With 0.01 slivers of the
organ kept trembling at 0.06 m/s a second after ten strokes; with this they are at rest. A bound
takes as long as half a step: without this a body at rest would be evaluated as often as one that
swings."""

_SAME_LIMIT = 1e-6
"""Relative difference of two limits of w^2 below which they are the same: they differ by rounding
where steps are as long as before."""

LONGEST_MOTION: Final = 0.5
"""Largest motion of the fastest node in a step, as a share of the node size. A bound on
frequencies holds where the body is; what moves farther may be stiffer before the next bound. With
less, strokes take more steps; without it, a body far from rest can become unstable."""

MOST_STEPS: Final = 5_000.0
"""Steps of an increment that are always allowed. In 160 blocks that recovered from random positions
of their nodes it was 150 times as many as at rest, of which a millisecond takes 1 to 20. Without a
limit, motion that has become unstable takes more and more steps and never ends."""

MOST_OF_LONG: Final = 20.0
"""Steps of a long increment at most, per step that the body at rest would take. With more, a second
in which tissue is torn about could take minutes, and nobody would learn why; in shorter time steps
it can be done."""

_GRADIENTS: Final = tuple(method.gradients for method in METHODS.values())
_FOLLOWS_SLIVERS: Final = tuple(method.follows_slivers for method in METHODS.values())


@kernel
def room_for_contact(choice: StepChoice, context: StepContext, seconds: float) -> float:
    """Return what contact may add to w^2 of the body without another step [1/s2].

    Args:
        choice: The method, and all damping.
        context: The body at rest.
        seconds: Time to advance by [s].
    """
    elastic = context.elastic
    longest = stable_step(choice.method, elastic, elastic.highest, choice.surroundings)
    room: float = without_another_step(elastic.highest, longest, seconds)[1] - elastic.highest
    return room


@kernel
def begin_increment(
    choice: StepChoice, context: StepContext, dt: float, begin: float, end: float
) -> None:
    """Begin an increment; nodes that the blade makes too fast get mass.

    Args:
        choice: Written, but for what contact adds.
        context: What takes part.
        dt: Length of the time step [s].
        begin: Fraction of the time step at which the increment begins.
        end: Fraction of the time step at which it ends.
    """
    choice.done = 0
    choice.is_unstable = 0
    choice.dt = dt
    choice.begin = choice.part_end = begin
    choice.end = end
    choice.span = dt * (end - begin)
    if not choice.span > 0.0:
        choice.end = begin  # no steps
        return
    _find_rest(choice, context)
    if choice.is_at_rest == 1:
        choice.end = begin
        press_at_rest(context, choice.span)
        return
    limit_mass(choice, context)
    elastic = context.elastic
    motion = choice.speed, choice.node_size, choice.span
    bounds = bound_of_terms(context, choice.no_frequency, choice.of_contact, *motion)
    choice.least, choice.added = bounds
    limit_mass_for_strain(choice, elastic)


@kernel
def _find_rest(choice: StepChoice, context: StepContext) -> None:
    """Find out whether the body is at rest."""
    if not may_rest(context, choice.surroundings.drag):
        choice.resting = 0.0
    choice.is_at_rest = 1 if choice.resting >= TIME_TO_REST else 0


@kernel
def note_rest(choice: StepChoice, context: StepContext) -> None:
    """Note, after an increment, whether the body was nearly at rest; stop it once it is at rest."""
    body, size = context.body, choice.node_size
    is_free = may_rest(context, choice.surroundings.drag)
    is_slow = is_free and choice.speed <= FASTEST_AT_REST * size
    if not is_slow or mean_speed(body) > SPEED_AT_REST * size:
        choice.resting = 0.0
    elif choice.resting == 0.0:
        keep_positions(body, choice.resting_positions)
        choice.resting = choice.span
    elif have_stayed(body, choice.resting_positions, MOTION_AT_REST * size):
        choice.resting += choice.span
    else:
        choice.resting = 0.0
    if choice.resting >= TIME_TO_REST:
        stop_nodes(context)


@kernel
def next_part(choice: StepChoice, context: StepContext) -> bool:
    """Choose the steps of the next part of an increment; return whether there is one.

    There is none at its end, and where the motion became unstable.
    """
    choice.begin = choice.part_end
    if choice.begin >= choice.end:
        return False
    elastic, surroundings = context.elastic, choice.surroundings
    span = choice.dt * (choice.end - choice.begin)
    longest = stable_step(choice.method, elastic, choice.least, surroundings)
    n, highest = without_another_step(choice.least, longest, span)
    _note_motion(choice, context)
    step = _strained_step(choice, context, StepLimit(highest - choice.added, choice.added, n))
    choice.needed = max(span / step, choice.speed * span / choice.node_size / LONGEST_MOTION)
    choice.at_rest = max(span / longest, 1.0)
    # A comparison with nan is false.
    if not choice.needed <= max(MOST_STEPS, MOST_OF_LONG * choice.at_rest):
        choice.is_unstable = 1
        return False
    n = max(1, math.ceil(choice.refinement * choice.needed))
    now, interval = damping_rate(elastic, surroundings), LONGEST_INTERVAL * span / n
    accurate = now if _FOLLOWS_SLIVERS[choice.method] else context.damping.rate_uncut
    is_slow = accurate * interval <= SLOW_DAMPING and now * interval <= FASTEST_DECAY
    context.damping.interval = LONGEST_INTERVAL if is_slow else 1
    choice.part_end = choice.end
    if elastic.has_tetrahedra == 1 and n > STEPS_BETWEEN_STRAIN_BOUNDS:
        share = STEPS_BETWEEN_STRAIN_BOUNDS / n
        choice.part_end = choice.begin + share * (choice.end - choice.begin)
        n = STEPS_BETWEEN_STRAIN_BOUNDS
    choice.part_seconds = choice.dt * (choice.part_end - choice.begin)
    choice.n_steps = n
    choice.done += n
    return True


@kernel
def _note_motion(choice: StepChoice, context: StepContext) -> None:
    """Note how fast the fastest node is, and how far nodes moved in the part before."""
    before, choice.speed = choice.speed, largest_speed(context.body)
    choice.moved += max(before, choice.speed) * choice.part_seconds


@kernel
def _strained_step(choice: StepChoice, context: StepContext, limit: StepLimit) -> float:
    """Return the largest stable step [s] until the next bound on the strained body.

    Args:
        choice: What the steps depend on.
        context: Body and forces.
        limit: The strained body is evaluated no closer than the number of steps needs.
    """
    elastic, strained = context.elastic, 0.0
    elastic.solid.are_gradients_known = 0
    if elastic.has_tetrahedra == 1:
        if not _is_bound_known(choice, elastic.solid, limit):
            _bound_strained_body(choice, context, limit)
        strained = choice.strained
    highest = max(choice.least, strained + limit.added)
    step: float = stable_step(choice.method, elastic, highest, choice.surroundings)
    return step


@kernel
def _is_bound_known(choice: StepChoice, solid: Solid, limit: StepLimit) -> bool:
    """Return whether the last bound on the strained body still holds, and is as near the truth."""
    if solid.is_bound_current == 0:
        return False
    is_near = choice.strained <= limit.allowed or choice.allowed <= limit.allowed * (
        1.0 + _SAME_LIMIT
    )
    return is_near and choice.moved <= MOTION_BETWEEN_STRAIN_BOUNDS * choice.node_size


@kernel
def _bound_strained_body(choice: StepChoice, context: StepContext, limit: StepLimit) -> None:
    """Bound the frequencies of the body as it is deformed.

    Where the law stiffens as tissue is stretched, the bound is also evaluated where the nodes will
    be at the next one: an exponential law can double its modulus in two steps. The Nystroem method
    begins where the bound is evaluated, and its first stage shares the gradients. Position Verlet
    evaluated them last half a step before: where no tetrahedron has changed since, they are used.
    """
    elastic, body, visits = context.elastic, context.body, context.visits
    solid, strained = elastic.solid, 0.0
    keeps = keeps_gradients(solid)
    is_known = (
        keeps
        and _GRADIENTS[choice.method] == OF_LAST_STEP
        and solid.is_bound_current == 1
        and not math.isinf(choice.moved)
    )
    if stiffens(solid.law):
        highest = max(choice.least, choice.strained + limit.added)  # as it was last
        step = stable_step(choice.method, elastic, highest, choice.surroundings)
        if not math.isinf(step):  # every node is held
            ahead, v = context.stages.last_positions, body.velocities
            seconds = STEPS_BETWEEN_STRAIN_BOUNDS * step
            for i in range(body.n_nodes):
                store_point(ahead, i, point(body.positions, i) + times(seconds, point(v, i)))
            if keeps:
                run_loop(context, DISPLACEMENTS_LAST, 0.0)
                run_loop(context, GRADIENTS, 0.0)
                _average(context)
            strained = strained_frequency(elastic, body, ahead, visits, limit, keeps)
    if keeps and _GRADIENTS[choice.method] == OF_NEXT_STEP:
        run_loop(context, DISPLACEMENTS, 0.0)
        run_loop(context, GRADIENTS, 0.0)
        _average(context)
        solid.are_gradients_known = 1
        is_known = True
    found = strained_frequency(elastic, body, body.positions, visits, limit, is_known)
    choice.strained = max(strained, found)
    choice.allowed = limit.allowed
    choice.moved = 0.0
    solid.is_bound_current = 1


@kernel
def _average(context: StepContext) -> None:
    """Find the stiffness of averaged shear."""
    if averages_shear(context.elastic.solid):
        run_loop(context, AVERAGES, 0.0)
