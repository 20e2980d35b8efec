"""Integrators of all nodes together, in as many equal steps as stability needs."""

import math
from collections.abc import Callable
from typing import NamedTuple

from tissue.blade.blade_context import BladeContext
from tissue.core.jit import SameTypes
from tissue.integrators.model import TissueModel
from tissue.integrators.options import Global, IntegratorOptions, Verlet
from tissue.integrators.relaxation import (
    FIND_FACES,
    NOT_FINITE,
    RELAXED,
    UNSTABLE,
    Relaxation,
    relax_by_nystroem,
    relax_by_runge_kutta,
    relax_by_verlet,
)
from tissue.integrators.rest import TIME_TO_REST
from tissue.integrators.stability import NYSTROEM, STAGE_DAMPED, VERLET
from tissue.integrators.step_choice import (
    StepChoice,
    begin_increment,
    new_step_choice,
    next_part,
    room_for_contact,
)
from tissue.integrators.step_context import Increment
from tissue.integrators.substeps import (
    nystroem_steps,
    runge_kutta_steps,
    verlet_steps,
)
from tissue.integrators.threaded import Threads
from tissue.integrators.unstable import UnstableError, not_finite
from tissue.laws.law import Law
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh

_ROOM = SameTypes(room_for_contact)


class Method(NamedTuple):
    """A method that advances all nodes together."""

    take_steps: Callable[..., None]
    """Takes a number of steps, as `tissue.integrators.substeps.runge_kutta_steps`."""
    relax: Callable[..., int]
    """A whole increment: `tissue.integrators.relaxation.relax_by_runge_kutta`."""
    limit: int
    """What limits its steps: a constant of `tissue.integrators.stability`."""
    damps_between_steps: bool
    """Whether damping acts between steps; if not, in every stage of them."""


def method_of(options: IntegratorOptions, law: Law) -> Method:
    """Return the method of a choice; for integrators that do not move all nodes, Runge-Kutta.

    These move all nodes where a body settles.
    """
    if isinstance(options, Verlet):
        return Method(verlet_steps, relax_by_verlet, VERLET, True)
    usual = "stage" if law.has_springs else "step"
    if isinstance(options, Global) and (options.damping or usual) == "step":
        return Method(nystroem_steps, relax_by_nystroem, NYSTROEM, True)
    return Method(runge_kutta_steps, relax_by_runge_kutta, STAGE_DAMPED, False)


class GlobalStepper:
    """All nodes together: an `Integrator` that remembers the last bound on the strained body.

    Args:
        method: How they are moved.
        threads: How many threads share the loops over the body.
    """

    moved = None
    moving = None
    _refinement = 1

    def __init__(self, method: Method, threads: int = 1) -> None:
        self.method = method
        self._relax = SameTypes(method.relax)
        self._threads = Threads(threads) if threads > 1 else None
        self._choice: StepChoice | None = None
        self._relaxation: Relaxation | None = None

    @property
    def refinement(self) -> int:
        """Into how many times as many increments, and these into steps, a time step is divided.

        It is 1, but where a step is repeated.
        """
        return self._refinement

    @refinement.setter
    def refinement(self, refinement: int) -> None:
        self._refinement = refinement
        if self._choice is not None:
            self._choice.refinement = refinement

    def relax(
        self, system: TissueModel, blade: BladeContext, increment: Increment, has_blade: bool
    ) -> int:
        """Relax by an increment; return the steps taken. See `Integrator.relax`."""
        contact = system.contact
        edge, dt, begin, end = increment
        choice = self._choice_for(system)
        if increment.span > 0.0 and not choice.is_at_rest and contact.wakes(system.body):
            choice = self._find_contacts(system, increment, choice)
        if self._threads is not None:
            self._threads.join(system.context)
        stage = FIND_FACES
        while True:
            arrays = self._arrays(system, blade, choice, stage)
            outcome = self._relax.call(arrays, edge, has_blade, dt, begin, end)
            if outcome == RELAXED:
                break
            if outcome == UNSTABLE:
                expect_stable(choice)
            if outcome == NOT_FINITE:
                raise not_finite()
            blade, stage = system.with_blade_room(outcome, blade), arrays.stage
        n = choice.done
        if n > 0:
            system.find_new_loose_pieces()
        return n

    def advance(self, system: TissueModel, increment: Increment) -> int:
        """Advance the motion by an increment; return the steps taken."""
        choice = self._find_contacts(system, increment, self._choice_for(system))
        context = system.context
        begin_increment(choice, context, *increment[1:])
        while next_part(choice, context):
            part = increment._replace(begin=choice.begin, end=choice.part_end)
            self.take_steps(system, part, choice.n_steps)
        expect_stable(choice)
        return choice.done

    def take_steps(self, system: TissueModel, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` steps."""
        if self._threads is not None:
            self._threads.join(system.context)
        self.method.take_steps(system.context, *increment, n)

    def _find_contacts(
        self, system: TissueModel, increment: Increment, choice: StepChoice
    ) -> StepChoice:
        """Find the contacts of an increment; return the choice of steps with what they add."""
        room = _ROOM.call(choice, system.context, increment.span)
        system.find_contacts(increment.span, room)
        return self._choice_for(system)

    def _choice_for(self, system: TissueModel) -> StepChoice:
        """Return the choice of steps, with what contact adds to the frequencies now."""
        choice, n_nodes = self._choice, len(system.body.masses)
        if choice is None or len(choice.no_frequency) != n_nodes:
            where = (system.node_size, system.surroundings, n_nodes)
            self._choice = choice = new_step_choice(self.method.limit, *where)
            choice.refinement = self._refinement
        choice.of_contact = system.contact.added_frequency_squared + system.added_by_attachments
        return choice

    def _arrays(
        self, system: TissueModel, blade: BladeContext, choice: StepChoice, stage: int
    ) -> Relaxation:
        """Return the arrays as one struct; another one where an owner has replaced its own.

        `stage`: where the increment goes on. It is given in each call: what an earlier increment,
        or one that was rolled back, has left in the struct means nothing.
        """
        relaxation, step = self._relaxation, system.context
        if (
            relaxation is None
            or relaxation.step is not step
            or relaxation.blade is not blade
            or relaxation.choice is not choice
        ):
            interaction = system.interaction
            self._relaxation = relaxation = Relaxation(
                stage=stage,
                has_faces=int(interaction.has_faces),
                step=step,
                choice=choice,
                blade=blade,
                nodes=interaction.all_nodes(system.body),
            )
        relaxation.stage = stage
        return relaxation

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Move the body again; `Solid.is_bound_current` says that bounds have changed."""
        self.wake()

    def wake(self) -> None:
        """Move the body again, which may have been at rest."""
        if self._choice is not None:
            self._choice.calm, self._choice.is_at_rest = 0.0, 0

    def let_rest(self, system: TissueModel) -> None:
        """Move a body that has settled only once something acts on it."""
        self._choice_for(system).calm = TIME_TO_REST

    def body_moved(self, body: Body) -> None:
        """Forget the bound on the strained body: it is another one now."""
        self._choice = None

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: there are no arrays."""


def expect_stable(choice: StepChoice) -> None:
    """Refuse motion that became unstable.

    Raises:
        UnstableError: it takes too many steps: see `step_choice.MOST_STEPS`.
    """
    if choice.is_unstable:
        raise UnstableError(
            f"it would take {choice.asked:.2g} steps of the integrator to go on, where tissue at "
            f"rest takes {math.ceil(choice.at_rest)}"
        )
