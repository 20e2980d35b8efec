"""`Episode`: a task that a policy does, control step by control step. It needs no Gymnasium."""

import logging
import math
import textwrap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bridge import CouplingError
from scalpel_sim.arm.arm import ArmError
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.scene_graspers import motions_of
from scalpel_sim.learning.episode_state import (
    EpisodeState,
    generator_at,
    settings_of,
    state_of_generator,
)
from scalpel_sim.learning.felt_wrench import FeltWrench
from scalpel_sim.learning.observations import Observer, Sensor, Shown
from scalpel_sim.learning.payment import Payment
from scalpel_sim.learning.policy_hand import PolicyHand
from scalpel_sim.learning.variation import Variation
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.act_table import ActTable, hands_led
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.scene.observe_table import ObserveTable, quantities_shown
from scalpel_sim.scene.read import read_scene, scene_called
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scoring.score import Score
from scalpel_sim.strokes.kind import StrokeTable
from tissue import FloatArray, StateError, TissueError, Wrench

KINEMATIC, FULL = "kinematic", "full"
"""Levels: instruments that are where their hands are, or arms that MuJoCo simulates."""

FAULTS = (TissueError, CouplingError, ArmError, ValueError)
"""Errors of a simulation that end an episode, and not the process. Of a blade, a grip or a geom
that meets what it cannot bear, it is a ValueError."""

_log = logging.getLogger("scalpel_sim")

_LONGEST_REPR = 100
"""Characters of a wrong action that its error repeats."""

_NEVER_MENDED = ("off_plan", "spared", "force", "strain_above", "healthy")
"""Conditions that no later step makes hold again."""


class Outcome(NamedTuple):
    """Outcome of a control step."""

    reward: float
    """Increase of the weighted terms, and what success is worth."""
    terminated: bool
    """Whether the task is done, or can no longer be done."""
    truncated: bool
    """Whether its time is over, or the simulation failed."""
    fault: str | None
    """Error with which the simulation failed; None: it did not."""
    failed: tuple[str, ...]
    """Conditions of success that can no longer hold."""


class Episode:
    """A task of a scene, over and over: prepared once, and put back to its start by `reset`.

    Args:
        scene: A scene with a task: its name, a TOML file, or the scene itself.
        arm: `KINEMATIC` or `FULL`; None: what `[act]` of the scene says.

    Raises:
        UsageError: there is no such scene or level, or the scene has no task.
        ValueError: parts of it do not fit together.
    """

    def __init__(self, scene: str | Path | Scene, arm: str | None = None) -> None:
        scene = task_scene(scene)
        if arm not in (None, KINEMATIC, FULL):
            raise UsageError(f"arm is '{arm}'; it must be {KINEMATIC} or {FULL}")
        if scene.task is None:
            raise UsageError(f"the scene '{scene.name}' has no [task]: there is nothing to learn")
        self.scene, self.task = scene, scene.task
        """The scene, and its task."""
        self.act_table = scene.act or ActTable()
        """Actions and their limits."""
        self.arm = arm or self.act_table.arm
        """`KINEMATIC` or `FULL`."""
        step = self.act_table.step
        self.simulation = simulation = prepare(
            scene,
            is_led=True,
            records=False,
            frame_seconds=step if self.arm == KINEMATIC else None,
        )
        """The simulation."""
        self.motions = motions_of(scene.graspers)
        """Motions of the graspers in the scene's script."""
        names = [each.name for each in scene.graspers]
        led = hands_led(self.act_table, names)
        self.hand = PolicyHand(simulation, self.act_table, led, self.motions)
        """The hand that the actions lead."""
        self.hand.take_over(simulation)
        observe = scene.observe or ObserveTable()
        has_plan = self.score.plan is not None
        self._observer = Observer(
            simulation, quantities_shown(observe, names, has_plan=has_plan), step
        )
        self._sensor = observe.sensor
        self.n_steps = 0
        """Control steps of this episode so far."""
        self.fault: str | None = None
        """Error with which the simulation failed; None: it did not."""
        self._felt = FeltWrench(simulation)
        self._payment = Payment(self.task, simulation)
        self.rng = np.random.default_rng(0)
        """All that is random in the episode is drawn from it."""
        self._observation: dict[str, FloatArray] = {}
        self._settings = settings_of(scene, self.arm)
        self._rest()  # a record begins with a frame at rest
        simulation.note_start()
        self._variation = Variation(simulation, scene)
        self.drawn: dict[str, float] = {}
        """Numbers of `[[vary]]` in this episode, by name."""
        self.reset(self.rng)  # points that are shown are chosen before a cut

    @property
    def strokes(self) -> tuple[StrokeTable, ...]:
        """Strokes of the scene; in this episode traced ones lie where the line of the task does."""
        return self._variation.strokes(self.drawn)

    @property
    def score(self) -> Score:
        """The score so far."""
        score = self.simulation.score
        assert isinstance(score, Score)
        return score

    @property
    def terms(self) -> dict[str, float]:
        """Terms of the score after the last control step, by name, in SI units."""
        return dict(self._payment.terms)

    @property
    def is_success(self) -> bool:
        """Whether all conditions of success held after the last control step."""
        return self._payment.is_success

    @property
    def action_names(self) -> tuple[str, ...]:
        """Name of each number of an action, which is within plus or minus 1."""
        return self.hand.action_names

    @property
    def shapes(self) -> dict[str, Shown]:
        """Shape and bounds of each array of an observation."""
        return self._observer.shapes()

    @property
    def max_steps(self) -> int | None:
        """Control steps after which the time of the task is over; None: it has none."""
        seconds = self.task.seconds
        return None if seconds is None else math.ceil(seconds / self.act_table.step)

    def reset(
        self, rng: np.random.Generator, variation: Mapping[str, float] | None = None
    ) -> dict[str, FloatArray]:
        """Begin an episode; return the first observation.

        Args:
            rng: All that is random is drawn from it.
            variation: Numbers of `[[vary]]` by name, all of them, as `drawn` has had them; None:
                they are drawn.

        Raises:
            UsageError: a number is missing, unknown or out of its range.
        """
        given = None if variation is None else self._variation.checked(variation)
        self.rng = rng
        self.simulation.reset()
        drawn = self._variation.draw(rng)  # in any case: then noise is the same
        self.drawn = drawn if given is None else given
        self._variation.apply(self.drawn)
        self._start_elsewhere()
        self.n_steps, self.fault = 0, None
        sensor = self._variation.sensor(self._sensor, self.drawn)
        self._observer.begin(Sensor(sensor, self.act_table.step, rng))
        self._payment.begin()
        self._observation = self._observer.now()
        return self._observation

    def act(self, action: FloatArray) -> Outcome:
        """Do an action over a control step.

        Args:
            action: Numbers within plus or minus 1 in the order of `action_names`; others are
                clipped.

        Raises:
            UsageError: it has another shape, or a number is not finite; or the episode has failed.
        """
        shape = (len(self.action_names),)
        action = finite_numbers(action, shape, f"an action of '{self.scene.name}' is")
        simulation = self.simulation
        if self.fault is not None:
            raise UsageError("the simulation has failed in this episode: call reset()")
        yields = self.act_table.force is not None
        self.hand.obey(action, self._wrenches() if yields else {})
        self._felt.begin()
        try:
            with _unsaid():
                for _ in range(self.hand.n_frames):
                    simulation.step()
                    self._felt.add()
        except FAULTS as error:
            self.fault = " ".join(str(error).split())
            return Outcome(0.0, False, True, self.fault, ())
        self.n_steps += 1
        self._observation = self._observer.after_step(self._felt.mean, self._felt.peak)
        return self._judged()

    @property
    def observation(self) -> dict[str, FloatArray]:
        """Observation after the last control step, by name, single precision."""
        return self._observation

    def save_state(self) -> EpisodeState:
        """Return the episode as it is now; `to_bytes` of it makes bytes.

        Raises:
            StateError: its simulation has failed.
        """
        if self.fault is not None:
            raise StateError("the simulation has failed in this episode: call reset() first")
        content = {
            "settings": self._settings,
            "n_steps": self.n_steps,
            "variation": self.drawn,
            "payment": self._payment.state(),
            "generator": state_of_generator(self.rng),
            "hand": self.hand.state(),
            "observer": self._observer.state(),
            "observation": {name: each.tolist() for name, each in self._observation.items()},
        }
        return EpisodeState(self.simulation.save_state(), content)

    def load_state(
        self, state: EpisodeState, rng: np.random.Generator | None = None
    ) -> dict[str, FloatArray]:
        """Return to a state, as often as wanted; return the observation of then.

        What follows is to the bit what followed then.

        Args:
            state: Of this episode, or from bytes of an episode of the same scene.
            rng: All that is random from then on is drawn from it; None: from a generator as it was
                then.

        Raises:
            StateError: it is of another task, or of another simulation.
        """
        state.expect(self._settings)
        content = state.content
        rng = generator_at(content["generator"]) if rng is None else rng
        self.rng, self.drawn = rng, dict(content["variation"])
        self.simulation.reset()
        self._variation.apply(self.drawn)  # the plan is none of what its state has
        self.simulation.load_state(state.simulation)
        self.n_steps, self.fault = content["n_steps"], None
        self.hand.return_to(content["hand"])
        sensor = self._variation.sensor(self._sensor, self.drawn)
        self._observer.begin(Sensor(sensor, self.act_table.step, rng))
        self._observer.return_to(content["observer"])
        self._payment.begin()
        self._payment.return_to(content["payment"])
        self._observation = {
            name: np.array(each, np.float32) for name, each in content["observation"].items()
        }
        return self._observation

    def _judged(self) -> Outcome:
        """Judge the control step that was done."""
        reward = self._payment.after_step()
        never = tuple(name for name in self._payment.failed if name in _NEVER_MENDED)
        late = self.max_steps is not None and self.n_steps >= self.max_steps
        ended = self.is_success or bool(never)
        return Outcome(reward, ended, late and not ended, None, never)

    def _start_elsewhere(self) -> None:
        """Put hands where they start in this episode; ways count from there."""
        starts = self._variation.starts(self.drawn)
        if not starts:
            return
        if self.arm == KINEMATIC:
            self.hand.put(starts, self.simulation)
        else:
            for _ in range(self.hand.go(starts)):
                self._rest()
        for each in self.score.hands:
            each.begin_way()

    def _rest(self) -> None:
        """Do a control step at rest."""
        with _unsaid():
            for _ in range(self.hand.n_frames):
                self.simulation.step()

    def _wrenches(self) -> dict[str, Wrench]:
        """Return the wrench on each instrument, world frame."""
        simulation = self.simulation
        found = {each.name: each.wrench for each in simulation.graspers}
        return {BLADE_NAME: simulation.blade.wrench, **found}


def task_scene(given: str | Path | Scene) -> Scene:
    """Return a scene that is given by its name, or by its file.

    Raises:
        UsageError: it cannot be read, or is none of these.
    """
    if isinstance(given, Scene):
        return given
    if isinstance(given, Path) or (isinstance(given, str) and given.endswith(".toml")):
        return read_scene(given)
    if isinstance(given, str):
        return scene_called(given)
    raise UsageError(f"scene is {given!r}; it must be the name of a scene, a TOML file, or a Scene")


def finite_numbers(given: Any, shape: tuple[int, ...], what: str) -> FloatArray:
    """Return actions as an array.

    Args:
        given: An array, or lists of numbers.
        shape: Shape that it must have.
        what: What it is, as the message begins: `an action is`.

    Raises:
        UsageError: it has another shape, or does not consist of finite numbers.
    """
    try:
        array = np.asarray(given)
        is_right = array.shape == shape and array.dtype.kind in "biuf" and np.isfinite(array).all()
    except ValueError:  # rows of several lengths
        is_right = False
    if not is_right:
        n = " x ".join(map(str, shape))
        said = textwrap.shorten(repr(given), _LONGEST_REPR)
        raise UsageError(f"{what} {n} finite numbers, not {said}")
    return array.astype(np.float64)


@contextmanager
def _unsaid() -> Iterator[None]:
    """Log nothing of what a person would be told of a run: that jaws closed on nothing, and where.

    A policy that learns does it thousands of times.
    """
    was_disabled, _log.disabled = _log.disabled, True
    try:
        yield
    finally:
        _log.disabled = was_disabled
