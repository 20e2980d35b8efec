"""All nodes together, in as many equal steps as stability needs; and which integrator is chosen."""

import math
from operator import is_

from tissue.blade.blade_context import BladeContext
from tissue.core.jit import SameTypes
from tissue.core.limits import MANY_SUBSTEPS, MOST_SUBSTEPS
from tissue.cut_settings import undamped_steps
from tissue.forces.step_context import Increment
from tissue.integrators.driver import (
    LACKS_CONTACTS,
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
from tissue.integrators.step_choice import StepChoice, new_step_choice, wake
from tissue.integrators.threads import Threads
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh

_WAKE = SameTypes(wake)


class GlobalStepper:
    """All nodes together: an `Integrator` that remembers the last bound on the strained body.

    Args:
        method: How they are moved.
        threads: How many threads share the loops over the body.
    """

    moved = None
    moving = None

    def __init__(self, method: Method, threads: int = 1) -> None:
        self.method = method
        self._relax = SameTypes(relax)
        self._threads = Threads(threads) if threads > 1 else None
        self.choice: StepChoice | None = None
        self._relaxation: Relaxation | None = None
        self._parts: tuple[object, ...] = ()
        self.refinement = 1
        """Into how many times as many increments, and these into steps, a time step is divided. It
        is 1, but where a step is repeated."""

    def refine(self, refinement: int) -> None:
        """Divide time steps into that many times as many increments, and these into steps."""
        self.refinement = refinement
        if self.choice is not None:
            self.choice.refinement = refinement

    def relax(
        self, system: TissueModel, arrays: Relaxation, increment: Increment, has_blade: bool
    ) -> int:
        """Relax by an increment; return the steps taken. See `Integrator.relax`."""
        if self._threads is not None:
            self._threads.join(arrays.step)
        is_again = False
        edge, dt, begin, end = increment
        while True:
            numbers = dt, begin, end, system.added_by_attachments
            outcome = self._relax.call(arrays, edge, has_blade, *numbers, is_again)
            if outcome == RELAXED:
                break
            arrays = self._with_room(outcome, system, arrays, dt * (end - begin))
            is_again = True
        n = arrays.choice.done
        if n > 0 and system.increments_to_pieces > 0:
            system.find_new_loose_pieces()
        return n

    def _with_room(
        self, outcome: int, system: TissueModel, arrays: Relaxation, span: float
    ) -> Relaxation:
        """Return the arrays with what an increment of `span` [s] lacked: room, or contacts.

        Raises:
            UnstableError: it lacked nothing, but went wrong.
        """
        if outcome == UNSTABLE:
            choice = arrays.choice
            raise UnstableError(
                f"it would take {choice.needed:.2g} steps of the integrator to continue, where "
                f"tissue at rest takes {math.ceil(choice.at_rest)}"
            )
        if outcome == NOT_FINITE:
            raise not_finite()
        blade = arrays.blade
        if outcome > LACKS_CONTACTS:
            elastic = system.elasticity.arrays
            bounds = elastic.frequency_squared, elastic.highest, arrays.choice.room
            contact = system.contact
            contact.follow_up(outcome - LACKS_CONTACTS, system.body, *bounds, span)
            if contact.search is arrays.contacts and contact.forces is arrays.step.contacts:
                return arrays
        else:
            blade = system.interaction.with_room(outcome, blade)
        return self.arrays(system, blade, arrays.stage)

    def take_steps(self, system: TissueModel, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` steps."""
        if self._threads is not None:
            self._threads.join(system.context)
        take_steps(system.context, self.method.number, *increment, n)

    def _choice_for(self, system: TissueModel) -> StepChoice:
        """Return the choice of steps."""
        choice, n_nodes = self.choice, len(system.body.masses)
        if choice is None or len(choice.no_frequency) != n_nodes:
            where = (system.node_size, system.surroundings, n_nodes)
            self.choice = choice = new_step_choice(self.method.number, *where)
            choice.refinement = self.refinement
        return choice

    def arrays(self, system: TissueModel, blade: BladeContext, stage: int = 0) -> Relaxation:
        """Return the arrays as one struct; another one where an owner has replaced its own.

        `stage`: where an increment continues that lacked room.
        """
        contact, choice = system.contact, self._choice_for(system)
        parts = system.context, choice, blade, contact.search
        if self._relaxation is None or not all(map(is_, parts, self._parts)):
            self._parts = parts
            self._relaxation = Relaxation(
                stage=stage,
                has_faces=int(system.interaction.has_faces),
                step=parts[0],
                choice=choice,
                blade=blade,
                contacts=contact.search,
                limits=contact.limits,
                nodes=system.interaction.all_nodes(system.body),
            )
        return self._relaxation

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Move the body again; `Solid.is_bound_current` says that bounds have changed."""
        self.wake()

    def wake(self) -> None:
        """Move the body again, which may have been at rest."""
        if self.choice is not None:
            _WAKE.call(self.choice)

    def let_rest(self, system: TissueModel) -> None:
        """Move a body that has settled only once something acts on it."""
        self._choice_for(system).resting = TIME_TO_REST

    def body_moved(self, body: Body) -> None:
        """Forget the bound on the strained body: it is another one now."""
        self.choice = None

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
