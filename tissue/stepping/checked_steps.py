"""`CheckedSteps`: steps that are checked, and done again where they went wrong.

A step that is not accepted is rolled back: the state that was saved last is loaded, and the steps
since are done again, which gives the same bits. Then it is tried with steps of the integrator of
half the length, a quarter, an eighth. If that fails too, the body stays as it was before the step,
and stops.
"""

import logging
import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.memento import Memento, Spares
from tissue.core.three_vectors import BladeSweep
from tissue.cutting.incision import NoRoomError
from tissue.integrators.integrator import REMEDY, UnstableError
from tissue.loads.handles import StepInputs
from tissue.mesh.body import Body
from tissue.mesh.node_motion import is_motion_finite
from tissue.mesh.rigid_cores import CoreCutError
from tissue.state.tissue_state import RULES
from tissue.stepping.energy_audit import RESIDUAL
from tissue.stepping.judgement import StepWatch
from tissue.stepping.stages import FAULT_BEFORE, StepStages
from tissue.types import StepResult, TissueError

MOST_REPEATS = 3
"""Tries after a step went wrong, each with steps of the integrator of half the length."""

NODES_NAMED = 5
"""Nodes that an error names at most, the worst first."""

STEPS_BETWEEN_STATES = 3000
"""Steps of the integrator after which a state is saved. To save one takes as long as six to ten of
them in the organ, and as 40 in a body of 1,000 tetrahedra, so that a run takes 0.3 to 1.3 % longer;
to do steps again, half as long as these in the mean, half a second in the organ, which is rare."""

MOST_FRAMES = 1000
"""Time steps after which one is saved in any case: their inputs are kept."""

Returned = TypeVar("Returned")
_log = logging.getLogger("tissue")


class CheckedSteps:
    """The steps of one tissue, each of which is accepted, or rolled back and repeated.

    Nothing here is a part of the state of the tissue.

    Args:
        stages: The stages of a step, and all that they work on.
    """

    def __init__(self, stages: StepStages) -> None:
        self._stages = stages
        self.n_repeated = 0
        """Number of steps that went wrong, and were done again in shorter ones."""
        self.watch = StepWatch(stages.model, stages.model.body.materials.wave_speed)
        self.inputs: list[StepInputs] = []
        """Forces that acted in each time step since a state was saved."""
        self._state: Memento | None = None
        self._n_substeps = 0
        self._spares = Spares()
        self._is_changed = True
        self._stopped: TissueError | None = None

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Do a step; see `tissue.Tissue.step`."""
        if self._stopped is not None:
            self.expect_moving()
        stages, watch = self._stages, self.watch
        if self._is_changed:
            if not is_motion_finite(stages.model.body):
                raise self._stop(FAULT_BEFORE, _worst_nodes(stages.model.body), is_repeated=False)
            self.save()
        inputs = stages.handles.inputs(sweep, _checked_time_step(dt))
        if inputs.supports is not None:  # nodes may have got other velocities
            watch.look(stages.context)
        result, fault = self._try(inputs)
        if result is None:
            return self._repeat(inputs, fault)
        self.inputs.append(inputs)
        self._n_substeps += result.n_substeps
        is_due = self._n_substeps >= STEPS_BETWEEN_STATES or len(self.inputs) >= MOST_FRAMES
        if is_due or dt == 0.0:  # what that changed is in no account
            self.save()
        return result

    def begin_change(self) -> StepStages:
        """Note that the body is changed by other than a step; return what is changed.

        Raises:
            TissueError: it has stopped.
        """
        self.expect_moving()
        self._is_changed = True
        return self._stages

    def state_loaded(self) -> None:
        """Continue from the state that was loaded, also after the body has stopped."""
        self._stopped, self._is_changed = None, True

    def expect_moving(self) -> None:
        """Refuse what changes a body that has stopped.

        Raises:
            TissueError: it has.
        """
        if self._stopped is not None:
            raise TissueError(
                f"the tissue has stopped, and takes no step or change until a state is loaded "
                f"(`load_state`). Why it stopped: {self._stopped}"
            )

    def release_edge(self, change: Callable[[], Returned]) -> Returned:
        """Do a change that releases the blade first: that cuts at most what it has left uncut."""
        if self._stages.incision.has_begun:
            return self.with_room(change)
        self.begin_change()
        return change()

    def with_room(self, change: Callable[[], Returned]) -> Returned:
        """Do a change that may cut (`begin_change`); where lists are full, again with more room."""
        self.begin_change()
        while True:
            state = self._state_now()
            try:
                return change()
            except NoRoomError as error:
                state.restore()
                self._stages.make_more_room(error.lacking)
            except CoreCutError:
                state.restore()
                raise

    def _try(self, inputs: StepInputs) -> tuple[StepResult | None, str]:
        """Do a step after a test; return its result, or None and what was wrong with it."""
        stages = self._stages
        try:
            result = stages.advance(inputs.sweep, inputs.dt)
        except NoRoomError as error:
            refinement = stages.global_stepper.refinement
            self.go_back(inputs)
            stages.make_more_room(error.lacking)
            self.save()
            stages.global_stepper.refine(refinement)
            return self._try(inputs)
        except UnstableError as error:
            return None, error.fault
        except CoreCutError:
            stages.global_stepper.refine(1)
            self.go_back(inputs)
            self.save()
            raise
        except ArithmeticError as error:
            return None, f"a number cannot be computed ({error})"
        except BaseException:
            self._is_changed = True  # what was done of it is not in the log
            raise
        fault = self.watch.fault(stages.frame_now(), inputs.dt)
        return (result, "") if fault is None else (None, fault)

    def _repeat(self, inputs: StepInputs, fault: str) -> StepResult:
        """Do a step again, in shorter steps of the integrator.

        Raises:
            TissueError: it went wrong each time.
        """
        model, stepper = self._stages.model, self._stages.global_stepper
        worst = _worst_nodes(model.body)
        self.go_back(inputs)
        state = self._state_now()
        self.watch.look(self._stages.context)
        for i in range(1, MOST_REPEATS + 1):
            stepper.refine(2**i)
            result, fault_again = self._try(inputs)
            stepper.refine(1)
            if result is not None:
                self.n_repeated += 1
                _log.warning("a step was repeated in steps of 1/%d the length: %s", 2**i, fault)
                self.save()
                return result
            fault, worst = fault_again, _worst_nodes(model.body)
            state.restore()
        raise self._stop(fault, worst)

    def go_back(self, inputs: StepInputs) -> None:
        """Go back to before a step with these inputs, which is not in the log."""
        stages = self._stages
        assert self._state is not None
        self._is_changed = True  # until it is saved: this can be interrupted
        self._state.restore()
        for each in self.inputs:
            stages.handles.give(each)
            stages.advance(each.sweep, each.dt)
        stages.handles.give(inputs)

    def save(self) -> None:
        """Save the state, from which on inputs are kept."""
        self._state = None  # its memory is used again
        self._state = self._state_now()
        self.inputs.clear()
        self._n_substeps = 0
        audit, context = self._stages.audit, self._stages.context
        edge, when = self._stages.model.interaction.edge_now
        if audit.is_kept:
            audit.update(context, edge, 1.0)
        account = audit.account
        residual = float(account.energies[RESIDUAL])
        self.watch.begin(context, edge, when, account.work_of_loads, residual)
        self._is_changed = False

    def _state_now(self) -> Memento:
        return Memento(self._stages, RULES, self._spares)

    def _stop(self, fault: str, nodes: IntArray, *, is_repeated: bool = True) -> TissueError:
        """Stop the body where it is; return the error that says why, and names nodes.

        `is_repeated`: whether the step was tried in shorter ones.
        """
        body = self._stages.model.body
        x, n = body.positions, body.n_nodes
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


def _checked_time_step(dt: float) -> float:
    """Return a time step [s] as a float: kernels that are called with one take no other number.

    Raises:
        ValueError: it is not finite, or negative.
    """
    if not (math.isfinite(dt) and dt >= 0.0):
        raise ValueError(f"dt is {dt} s; it must be finite and not negative")
    return float(dt)
