"""`RepeatedRun`: a run that is done again, frame by frame as it was, while it is observed."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from bridge import InProcessLink
from scalpel_sim.camera.camera import Camera
from scalpel_sim.datasets.demonstration import DatasetLayout, Seen, Transition
from scalpel_sim.datasets.hand_poses import HandActions, poses_of_hands
from scalpel_sim.datasets.recorded_runs import RecordedRun
from scalpel_sim.datasets.taking import (
    DatasetRequest,
    ShowProgress,
    layout_of,
    open_cameras,
    seen_now,
    unseen_progress,
)
from scalpel_sim.errors import Interrupted, UsageError
from scalpel_sim.learning.felt_wrench import FeltWrench
from scalpel_sim.learning.observations import Observer, Sensor
from scalpel_sim.learning.payment import Payment
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.recording.growing_file import FileSum
from scalpel_sim.recording.recording import Recording
from scalpel_sim.runs.resumption import RepeatedFrames, Resumption
from scalpel_sim.scene.act_table import ActTable, hands_led
from scalpel_sim.scene.observe_table import ObserveTable, SensorTable, quantities_shown
from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation, no_garbage_collection

_MILLISECONDS_PER_S = 1000

_WHOLE = 1e-9
"""Part of a frame by which a control step may be longer or shorter than whole ones: rounding."""


_FASTEST_ACTION = 1.0 + 1e-5
"""Number of an action beyond which it is faster than the limits: 1, and single precision."""


class RepeatedRun:
    """A run that is done again to the bit, and its control steps. See `Demonstration`.

    Args:
        run: The run.
        request: What is taken of it.
        progress: Returns what is called after each frame of so many seconds, while it is entered.
        stop_reason: Returns why the work is to end now; None: it goes on.

    Raises:
        UsageError: its frames make no such control steps, or it has fewer than one.
    """

    def __init__(
        self,
        run: RecordedRun,
        request: DatasetRequest = DatasetRequest(),
        *,
        progress: ShowProgress = unseen_progress,
        stop_reason: Callable[[], str | None] = lambda: None,
    ) -> None:
        self.run, scene = run, run.scene
        """The run."""
        self.name = str(run.folder)
        """Name of it in messages."""
        self.task = request.task or scene.about or scene.name
        """The task in words."""
        self.scene_text = run.scene_text
        """The scene, as its file has it."""
        self.act = scene.act or ActTable()
        """Limits of its actions."""
        self.fps = request.fps or round(1.0 / self.act.step)
        """Control steps a second."""
        self.hands = hands_led(self.act, [each.name for each in scene.graspers])
        """Names of the hands whose actions are taken."""
        observe = scene.observe or ObserveTable()
        self.cameras = observe.cameras if request.cameras is None else tuple(request.cameras)
        """Cameras and the sizes of their images."""
        names = [each.name for each in scene.graspers]
        self.keys = quantities_shown(observe, names, has_plan=scene.task is not None)
        """Names of the numbers that are observed."""
        self._progress, self._stop_reason = progress, stop_reason
        self._success: bool | None = None
        self._terms: dict[str, float] = {}
        self._n_steps = self._n_fast = 0

    def layout(self) -> DatasetLayout:
        """Return what each control step has. It takes the time of preparing the scene.

        Raises:
            UsageError: no camera has such a name.
        """
        simulation = _prepared(self.run)
        observer = Observer(simulation, self.keys, 1.0 / self.fps)
        with open_cameras(simulation, self.cameras):
            return layout_of(simulation, observer.shapes(), self)

    def transitions(self) -> Iterator[Transition]:
        """Yield its control steps.

        Raises:
            Interrupted: it is to end.
            RunError: a frame is not what it was.
            UsageError: it has none.
        """
        recorded, simulation = self.run.rows(), _prepared(self.run)
        n_frames = self._frames_a_step(simulation.dt)
        n_steps = len(recorded) // n_frames
        if not n_steps:
            raise UsageError(
                f"{self.run.folder}: the run has {len(recorded)} frames, and a control step "
                f"{n_frames}; a demonstration has one step at least"
            )
        with (
            open_cameras(simulation, self.cameras) as cameras,
            self._progress(n_steps / self.fps) as after_frame,
            no_garbage_collection(),
        ):
            steps = _Steps(self, simulation, cameras, recorded)
            before = steps.seen_first()
            for i in range(n_steps):
                for _ in range(n_frames):
                    steps.step()
                    after_frame(simulation)
                reason = self._stop_reason()
                if reason is not None:
                    raise Interrupted(reason)
                transition = steps.transition(before, is_last=i == n_steps - 1)
                self._n_fast += bool(np.abs(transition.action).max() > _FASTEST_ACTION)
                yield transition
                before = transition.after
            self._n_steps, self._success, self._terms = n_steps, *steps.outcome()

    def provenance(self) -> dict[str, Any]:
        """Return where it comes from, and how it ended: for JSON."""
        run = self.run
        return {
            "run": run.folder.name,
            "scene": run.scene.name,
            "task": self.task,
            "led_by": "a hand" if run.is_led else "a script",
            "sha256": run.sums(),
            "repeated_to_the_bit": True,
            "steps": self._n_steps,
            "steps_faster_than_limits": self._n_fast,
            "success": self._success,
            "score": self._terms,
            "scene_file": run.scene_text,
        }

    def _frames_a_step(self, dt: float) -> int:
        """Return the number of frames of a control step.

        Raises:
            UsageError: it is not whole.
        """
        frames = 1.0 / (self.fps * dt)
        if abs(frames - round(frames)) > _WHOLE * frames or round(frames) < 1:
            whole = [n for n in range(10, 101) if _MILLISECONDS_PER_S % n == 0]
            raise UsageError(
                f"--fps is {self.fps}, and a control step would have {frames:.4g} frames of "
                f"{dt:g} s; it has a whole number of them with {', '.join(map(str, whole))}"
            )
        return round(frames)


class _Steps:
    """The control steps of a run that is done again.

    Args:
        repeated: The run.
        simulation: At its start.
        cameras: Cameras that see it, by name.
        recorded: Its rows of then.
    """

    def __init__(
        self,
        repeated: RepeatedRun,
        simulation: Simulation,
        cameras: dict[str, Camera],
        recorded: Recording,
    ) -> None:
        run, step = repeated.run, 1.0 / repeated.fps
        self._simulation, self._cameras, self._hands = simulation, cameras, repeated.hands
        resumption = Resumption(None, None, recorded, FileSum(), 0, None)
        resumption.load_into(simulation)
        self._frames = RepeatedFrames(resumption, run.folder)
        self._observer = Observer(simulation, repeated.keys, step)
        self._observer.begin(Sensor(SensorTable(), step, np.random.default_rng(0)))
        self._felt = FeltWrench(simulation)
        self._actions = HandActions(repeated.act, repeated.hands, step, poses_of_hands(simulation))
        score, task = simulation.score, run.scene.task
        self._payment = None
        if task is not None and isinstance(score, Score):
            self._payment = Payment(task, simulation)

    def step(self) -> None:
        """Do a frame, which must be what it was."""
        self._simulation.step()
        self._frames.check(self._simulation.recording)
        self._felt.add()

    def seen_first(self) -> Seen:
        """Return what is observed before the first frame."""
        poses = poses_of_hands(self._simulation)
        return seen_now(self._simulation, self._observer.now(), poses, self._cameras)

    def transition(self, before: Seen, *, is_last: bool) -> Transition:
        """Return the control step whose frames were done.

        Args:
            before: What was observed at its begin.
            is_last: Whether the run ends with it.
        """
        poses = poses_of_hands(self._simulation)
        observed = self._observer.after_step(self._felt.mean, self._felt.peak)
        after = seen_now(self._simulation, observed, poses, self._cameras)
        self._felt.begin()
        reward = 0.0 if self._payment is None else self._payment.after_step()
        is_success = self._payment is not None and self._payment.is_success
        return Transition(before, self._actions.until(poses), reward, is_last, is_success, after)

    def outcome(self) -> tuple[bool | None, dict[str, float]]:
        """Return whether the task is done, None where nothing asks, and the terms of the score."""
        score = self._simulation.score
        if self._payment is None or score is None:
            return None, {}
        terms = {name: each for name, each in score.terms().items() if np.isfinite(each)}
        return self._payment.is_success, terms


def _prepared(run: RecordedRun) -> Simulation:
    """Return the simulation of a run, at its start.

    Its frames are recorded, so that they can be compared.
    """
    tissue = make_tissue(run.scene)
    return prepare(run.scene, InProcessLink(tissue, run.scene.name))
