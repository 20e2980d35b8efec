"""All nodes together, in as many equal steps as stability needs; and which integrator is chosen."""

import math

from tissue.blade.blade_context import BladeContext
from tissue.core.jit import SameTypes
from tissue.core.limits import MANY_SUBSTEPS, MOST_SUBSTEPS
from tissue.cut_settings import undamped_steps
from tissue.forces.step_context import Increment
from tissue.integrators.driver import (
    FIND_FACES,
    NOT_FINITE,
    RELAXED,
    UNSTABLE,
    Relaxation,
    relax,
    take_steps,
)
from tissue.integrators.integrator import Integrator, UnstableError, not_finite
from tissue.integrators.methods import Hierarchical, IntegratorOptions, Method
from tissue.integrators.model import TissueModel
from tissue.integrators.resting import TIME_TO_REST
from tissue.integrators.stability import stable_step
from tissue.integrators.step_size import (
    StepChoice,
    new_step_choice,
    room_for_contact,
)
from tissue.integrators.threads import Threads
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh

_ROOM = SameTypes(room_for_contact)

_SURELY_FEW = 0.1
"""Highest frequency and rate of decay times a time step, per step that is allowed, up to which the
longest step need not be computed. It takes some 1.3 steps at most for each of them, by
`tissue.integrators.stability.STABILITY_LIMIT`."""


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
        self._relax = SameTypes(relax)
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
                raise UnstableError(
                    f"it would take {choice.needed:.2g} steps of the integrator to go on, where "
                    f"tissue at rest takes {math.ceil(choice.at_rest)}"
                )
            if outcome == NOT_FINITE:
                raise not_finite()
            blade, stage = system.with_blade_room(outcome, blade), arrays.stage
        n = choice.done
        if n > 0:
            system.find_new_loose_pieces()
        return n

    def take_steps(self, system: TissueModel, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` steps."""
        if self._threads is not None:
            self._threads.join(system.context)
        take_steps(system.context, self.method.number, *increment, n)

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
            self._choice = choice = new_step_choice(self.method.number, *where)
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
            self._choice.resting, self._choice.is_at_rest = 0.0, 0

    def let_rest(self, system: TissueModel) -> None:
        """Move a body that has settled only once something acts on it."""
        self._choice_for(system).resting = TIME_TO_REST

    def body_moved(self, body: Body) -> None:
        """Forget the bound on the strained body: it is another one now."""
        self._choice = None

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: there are no arrays."""


def expect_few_steps(system: TissueModel, method: int, dt: float) -> None:
    """Refuse a time step that takes more than `MOST_SUBSTEPS` steps of the integrator.

    Args:
        system: The body before the step, which is not changed.
        method: Number of the method (`tissue.integrators.methods`).
        dt: Length of the step [s].

    Raises:
        ValueError: it does; the message says why, and how long a step may be.
    """
    elastic, surroundings = system.elasticity.arrays, system.surroundings
    of_body = system.elasticity.frequency_squared
    of_holds = system.added_by_attachments
    squared = of_body + of_holds + system.contact.added_frequency_squared
    rate = surroundings.retardation_time * elastic.highest_of_dampers + surroundings.drag
    if dt * (math.sqrt(squared) + rate) <= _SURELY_FEW * MOST_SUBSTEPS:
        return
    step = stable_step(method, elastic, squared, surroundings)
    if dt <= MOST_SUBSTEPS * step:
        return
    reason = "its elements are small, stiff or light"
    if undamped_steps(math.sqrt(squared), dt) <= MANY_SUBSTEPS:
        reason = "damping in it is strong"
    elif of_holds > of_body:
        reason = "what is attached to it is held stiffly, or damped strongly"
    raise ValueError(
        f"a time step of {dt:.3g} s takes some {dt / step:.3g} steps of the integrator in this "
        f"tissue, because {reason}; at most {MOST_SUBSTEPS:,} are done. Take time steps of at most "
        f"{MOST_SUBSTEPS * step:.2g} s"
    )


def integrator_of(
    options: IntegratorOptions, global_stepper: GlobalStepper, n_nodes: int
) -> Integrator:
    """Return the integrator that a user chose, with room for that many nodes."""
    # Imported late: kernels that are not used cost no start.
    if isinstance(options, Hierarchical):
        from tissue.integrators.bielser_1998.stepper import HierarchicalStepper

        return HierarchicalStepper(options, n_nodes)
    return global_stepper
