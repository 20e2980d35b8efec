"""Relaxation (RX) of an increment in one call: contacts, blade, motion, anchors of the edge.

One loop of steps for every method that moves all nodes together (`tissue.integrators.methods`).

Each call from Python costs 1 to 4 us, more where the body has filled the cache since the last one:
with a call for each stage an increment took 40 to 60 us besides what the body costs. Where a stage
needs room, a call returns; after room was made the next call continues with that stage.
"""

from typing import Final, NamedTuple

from tissue.blade.blade_context import (
    GRID_IS_FULL,
    NOT_SEARCHED,
    SEARCHED,
    BladeContext,
    release_sides,
    update_anchors,
    update_faces,
)
from tissue.blade.edge import Edge
from tissue.contact.response.stiffness import Limits
from tissue.contact.search.search_state import SearchState
from tissue.contact.search_stages import DONE, wake_contacts
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.elasticity.relaxed_stress import relaxes
from tissue.forces.contact_frequencies import frequency_of_contacts
from tissue.forces.step_context import StepContext
from tissue.forces.terms import end_substep
from tissue.integrators.core_motion import hold_cores_at_geoms
from tissue.integrators.damping import damp_if_due, relax_stress
from tissue.integrators.methods import NYSTROEM, RUNGE_KUTTA
from tissue.integrators.nystroem import nystroem_step
from tissue.integrators.runge_kutta import runge_kutta_step
from tissue.integrators.step_choice import StepChoice, wake
from tissue.integrators.step_size import (
    begin_increment,
    next_part,
    note_rest,
    room_for_contact,
)
from tissue.integrators.verlet import verlet_step
from tissue.mesh.bounding_boxes import write_bounds

RELAXED: Final = 0
"""The increment is done."""
NOT_FINITE: Final = -1
"""The increment is done, and the position of a node is not a finite number."""
UNSTABLE: Final = -2
"""The motion became unstable; the increment is not done."""

LACKS_CONTACTS: Final = 10
"""Contacts are to be searched: this and what `wake_contacts` returned. They are a program of their
own, which settling a body needs, too: as a part of this one they would be compiled twice."""

FIND_CONTACTS: Final = 0
"""Stage in which an increment begins: the search for contacts."""
_FACES, _STEPS, _ANCHORS, _ANCHORS_AGAIN = 1, 2, 3, 4
"""Those that follow; the last one where the grid was full, and is new now."""


class _Part(NamedTuple):
    """A part of a time step."""

    dt: float
    """Length of the time step [s]."""
    begin: float
    """Fraction of the time step at which the increment begins."""
    end: float
    """Fraction of the time step at which it ends."""


class Relaxation(Arrays, two_precisions=True):
    """Everything that the relaxation of an increment reads and writes."""

    stage: IntCell
    """Where the next call continues."""
    has_faces: IntCell
    """1 if the blade has side faces, 0 for a line that cuts."""
    step: StepContext
    """Everything that the integrator reads and writes."""
    choice: StepChoice
    """Into how many steps the increment is divided."""
    blade: BladeContext
    """Everything that searches of the blade read and write."""
    contacts: SearchState
    """Data of the search for contacts."""
    limits: Limits
    """Limits of the stiffness of contacts."""
    nodes: IntArray
    """0, 1, 2, ... up to the room for nodes."""


@kernel
def relax(
    relaxation: Relaxation,
    edge: Edge,
    has_blade: bool,
    dt: float,
    begin: float,
    end: float,
    held: float,
    is_again: bool,
) -> int:
    """Relax by an increment; return RELAXED, or what went wrong, or what needs room.

    `relaxation.choice` says how many steps were taken, and the geoms what work they did.

    Args:
        relaxation: Written.
        edge: The cutting edge over the time step.
        has_blade: Whether there is one.
        dt: Length of the time step [s].
        begin: Fraction of the time step at which the increment begins.
        end: Fraction of the time step at which it ends.
        held: Largest part of attachments in w^2 of the body [1/s2].
        is_again: Whether a call before lacked room.
    """
    choice, step, part = relaxation.choice, relaxation.step, _Part(dt, begin, end)
    if not is_again:
        relaxation.stage = FIND_CONTACTS
        step.geoms.work = step.geoms.dissipated = 0.0
        if step.geoms.n_contacts > 0:
            wake(choice)
    outcome = _take_contacts(relaxation, part, held)
    if outcome != RELAXED:
        return outcome
    outcome = _begin(relaxation, edge, has_blade, part)
    if outcome != RELAXED:
        return outcome
    if relaxation.stage == _STEPS:
        while next_part(choice, step):
            parts = choice.begin, choice.part_end, choice.n_steps
            take_steps(step, choice.method, edge, choice.dt, *parts)
    return _end(relaxation, edge, has_blade, end)


@kernel
def take_steps(
    context: StepContext, method: int, edge: Edge, dt: float, begin: float, end: float, n: int
) -> None:
    """Take `n` steps of a method, each with its damping, its contact and the slip of the blade.

    Args:
        context: What takes part.
        method: Number of the method, as in `tissue.integrators.methods`.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        begin: Fraction of the time step at which to begin.
        end: Fraction of the time step at which to end.
        n: Number of steps from `begin` to `end`.
    """
    share = (end - begin) / n
    for i in range(n):
        at = begin + i * share
        damp_if_due(context, method, i, n, share * dt, dt)
        _take_step(context, method, edge, dt, at, share)
        end_substep(context, edge, dt, share, at + share)
        if context.geoms.n_contacts > 0:
            hold_cores_at_geoms(context)


@kernel
def _take_step(
    context: StepContext, method: int, edge: Edge, dt: float, at: float, share: float
) -> None:
    """Take one step of a method; see `take_steps`."""
    if method == RUNGE_KUTTA:
        runge_kutta_step(context, edge, dt, at, share)
    elif method == NYSTROEM:
        nystroem_step(context, edge, dt, at, share)
    else:
        verlet_step(context, edge, dt, at, share)


@kernel
def _take_contacts(relaxation: Relaxation, part: _Part, held: float) -> int:
    """Take the contacts of an increment, but of a body at rest; return what they lack."""
    if relaxation.stage != FIND_CONTACTS:
        return RELAXED
    choice, step = relaxation.choice, relaxation.step
    search, limits = relaxation.contacts, relaxation.limits
    span = part.dt * (part.end - part.begin)
    if span > 0.0 and choice.is_at_rest == 0:
        outcome = wake_contacts(search, step.body)
        if outcome != DONE:
            choice.room = room_for_contact(choice, step, span)
            return LACKS_CONTACTS + outcome
    choice.of_contact = held + frequency_of_contacts(step, search, limits)
    relaxation.stage = _FACES
    return RELAXED


@kernel
def _begin(relaxation: Relaxation, edge: Edge, has_blade: bool, part: _Part) -> int:
    """Find the faces that the blade may touch, and begin the steps; return what needs room."""
    if relaxation.stage != _FACES:
        return RELAXED
    if relaxation.has_faces == 1:
        if has_blade:
            n_nodes = relaxation.step.body.n_nodes
            outcome = update_faces(relaxation.blade, edge, part.begin, relaxation.nodes, n_nodes)
            if outcome != NOT_SEARCHED and outcome != SEARCHED:
                return outcome
        else:
            release_sides(relaxation.step.blade)
    begin_increment(relaxation.choice, relaxation.step, part.dt, part.begin, part.end)
    relaxation.stage = _STEPS
    return RELAXED


@kernel
def _end(relaxation: Relaxation, edge: Edge, has_blade: bool, end: float) -> int:
    """Run what follows the steps; return RELAXED, or what went wrong, or what needs room."""
    step, choice = relaxation.step, relaxation.choice
    if relaxation.stage == _STEPS:
        relaxation.stage = FIND_CONTACTS
        if choice.is_unstable == 1:
            return UNSTABLE
        if choice.done > 0:
            note_rest(choice, step)
            if relaxes(step.elastic.solid):
                relax_stress(step, choice.span)
            if not write_bounds(step.body, relaxation.blade.bounds):
                return NOT_FINITE
        relaxation.stage = _ANCHORS
    if has_blade:
        is_again = relaxation.stage == _ANCHORS_AGAIN
        external, n_nodes = step.stages.external, step.body.n_nodes
        outcome = update_anchors(
            relaxation.blade, external, edge, end, relaxation.nodes, n_nodes, is_again
        )
        if outcome == GRID_IS_FULL:
            relaxation.stage = _ANCHORS_AGAIN
            return GRID_IS_FULL
    relaxation.stage = FIND_CONTACTS
    return RELAXED
