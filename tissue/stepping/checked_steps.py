"""`RepeatedSteps`: the step of `Tissue`, which is checked, and done again where it went wrong.

A step that is not accepted is rolled back: the state that was saved last is loaded, and the steps
since are done again, which gives the same bits. Then it is tried with steps of the integrator of
half the length, a quarter, an eighth. If that fails too, the body stays as it was before the step,
and stops.
"""

import logging
from abc import abstractmethod
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from tissue.blade.edge import Edge
from tissue.core.array_types import IntArray
from tissue.core.three_vectors import BladeSweep
from tissue.cutting.incision import NoRoomError
from tissue.integrators.unstable import REMEDY, UnstableError
from tissue.loads.step_inputs import StepInputs, give_inputs, inputs_of
from tissue.mesh.body import Body
from tissue.state.saved_body import SavedBody
from tissue.state.step_log import StepLog, StepState
from tissue.stepping.energy_audit import Audit
from tissue.stepping.judgement import StepWatch
from tissue.types import StepResult, TissueError

MOST_REPEATS = 3
"""Tries after a step went wrong, each with steps of the integrator of half the length."""

NODES_NAMED = 5
"""Nodes that an error names at most, the worst first."""

_BEFORE = "a number of its state was not finite before the step"
Returned = TypeVar("Returned")
_log = logging.getLogger("tissue")


class RepeatedSteps(SavedBody):
    """A body whose steps are checked, and repeated where one went wrong."""

    _audit: Audit
    _edge_now: tuple[Edge, float]
    _watch: StepWatch
    _step_log: StepLog
    _n_repeated = 0

    @abstractmethod
    def _advance(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Advance the body; see `step`."""

    @property
    def n_repeated_steps(self) -> int:
        """Number of steps that went wrong, and were done again in shorter ones."""
        return self._n_repeated

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Advance the body by `dt` [s] while the blade does `sweep`.

        A step is accepted if all positions and velocities are finite, no node leaves the box around
        the body faster than nodes move, and the nodes have no more energy than they were given.
        Otherwise it is done again in shorter steps of the integrator, up to three times. If that
        fails, the body stays as it was before the step: it can still be read, but nothing that
        changes it is accepted until `load_state`.

        Args:
            sweep: Motion of the cutting edge, or None where no blade is near.
            dt: Length of the step [s]. It is divided as stability and the speed of the blade need.

        Raises:
            ValueError: the blade has no length, or one that does not fit the mesh; or a number is
                not finite.
            TissueError: the motion of the tissue became unstable, now or before; it names nodes.
        """
        if self._stopped is not None:
            self._expect_moving()
        watch, log = self._watch, self._step_log
        is_finite = watch.is_finite(self._system)
        if self._is_changed:
            if not is_finite:
                raise self._stop(_BEFORE, _worst_nodes(self._body), is_repeated=False)
            self._save_step()
        inputs = inputs_of(sweep, dt, self._loads, self._attachments, self._system)
        if not is_finite:
            return self._repeat(inputs, _BEFORE)
        if inputs.supports is not None:  # nodes may have got other velocities
            watch.look(self._system)
        result, fault = self._try(inputs)
        if result is None:
            return self._repeat(inputs, fault)
        if log.add(inputs, result.n_substeps) or dt == 0.0:  # what that changed is in no account
            self._save_step()
        return result

    def _begin_state(self) -> None:
        """Begin to watch this body, before any cut."""
        super()._begin_state()
        self._watch = StepWatch(self._system, self.material.wave_speed)
        self._step_log = StepLog()

    def _with_room(self, change: Callable[[], Returned]) -> Returned:
        """Do a change that may cut; where lists are full, again with more room."""
        while True:
            state = self._state_now()
            try:
                return change()
            except NoRoomError as error:
                state.restore(self)
                self._make_more_room(error.lacking)

    @abstractmethod
    def _make_more_room(self, lacking: int) -> None:
        """Make twice the room for what lacked it in a cut; see `NoRoomError`."""

    def _try(self, inputs: StepInputs) -> tuple[StepResult | None, str]:
        """Do a step after a look; return its result, or None and what was wrong with it."""
        try:
            result = self._advance(inputs.sweep, inputs.dt)
        except NoRoomError as error:
            refinement = self._global_stepper.refinement
            self._go_back(inputs)
            self._make_more_room(error.lacking)
            self._save_step()
            self._global_stepper.refinement = refinement
            return self._try(inputs)
        except UnstableError as error:
            return None, error.fault
        except ArithmeticError as error:
            return None, f"a number cannot be computed ({error})"
        except BaseException:
            self._is_changed = True  # what was done of it is not in the log
            raise
        energies = result.energies
        residual = 0.0 if energies is None else energies.residual
        amounts = (self._audit.work_of_loads, residual, sum(result.wrench.numbers))
        fault = self._watch.fault(self._system, float(inputs.dt), *amounts)
        return (result, "") if fault is None else (None, fault)

    def _repeat(self, inputs: StepInputs, fault: str) -> StepResult:
        """Do a step again, in shorter steps of the integrator.

        Raises:
            TissueError: it went wrong each time.
        """
        worst = _worst_nodes(self._body)
        self._go_back(inputs)
        state = self._state_now()
        self._watch.look(self._system)
        for i in range(1, MOST_REPEATS + 1):
            self._global_stepper.refinement = 2**i
            result, fault_again = self._try(inputs)
            self._global_stepper.refinement = 1
            if result is not None:
                self._n_repeated += 1
                _log.warning("a step was repeated in steps of 1/%d the length: %s", 2**i, fault)
                self._save_step()
                return result
            fault, worst = fault_again, _worst_nodes(self._body)
            state.restore(self)
        raise self._stop(fault, worst)

    def _go_back(self, inputs: StepInputs) -> None:
        """Go back to before a step with these inputs, which is not in the log."""
        log = self._step_log
        assert log.state is not None
        self._is_changed = True  # until it is saved: this can be interrupted
        log.state.restore(self)
        for each in log.inputs:
            give_inputs(each, self._loads, self._attachments, self._system)
            self._advance(each.sweep, each.dt)
        give_inputs(inputs, self._loads, self._attachments, self._system)

    def _state_now(self) -> StepState:
        return StepState(self, self._step_log.spares)

    def _save_step(self) -> None:
        """Save the state, from which on steps are logged."""
        log = self._step_log
        log.state = None  # its memory is used again
        log.begin(self._state_now())
        system, audit = self._system, self._audit
        energies = audit.energies(system, self._edge_now[0])
        residual = 0.0 if energies is None else energies.residual
        self._watch.begin(system, *self._edge_now, audit.work_of_loads, residual)
        self._is_changed = False

    def _stop(self, fault: str, nodes: IntArray, *, is_repeated: bool = True) -> TissueError:
        """Stop the body where it is; return the error that says why, and names nodes.

        `is_repeated`: whether the step was tried in shorter ones.
        """
        x, n = self._body.positions, self.n_nodes
        places = ", ".join(
            f"{node} at ({x[node, 0]:.3g}, {x[node, 1]:.3g}, {x[node, 2]:.3g}) m"
            for node in nodes.tolist()
            if node < n
        )
        tried = f"Steps of the integrator of 1/{2**MOST_REPEATS} the length did not help. {REMEDY}"
        if not is_repeated:
            tried = "What changed the tissue since the last step left it so; no step was taken"
        self._stopped = TissueError(
            f"the motion of the tissue became unstable: {fault}. The worst nodes, before this "
            f"step: {places}. {tried}"
        )
        return self._stopped


def _worst_nodes(body: Body) -> IntArray:
    """Return the nodes that are not finite, or else the fastest; at most `NODES_NAMED`."""
    n = body.n_nodes
    with np.errstate(over="ignore", invalid="ignore"):
        sizes = np.abs(body.velocities[:n]).max(axis=1)
        sizes += 0.0 * np.abs(body.positions[:n]).max(axis=1)
    sizes[np.isnan(sizes)] = np.inf
    found: IntArray = np.argsort(-sizes, kind="stable")[:NODES_NAMED]
    return found
