"""`ExpertDemonstration`: a task that its expert does, by the actions of a policy."""

from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from scalpel_sim.datasets.demonstration import DatasetLayout, Transition
from scalpel_sim.datasets.hand_poses import poses_of_hands
from scalpel_sim.datasets.taking import (
    DatasetRequest,
    ShowProgress,
    layout_of,
    open_cameras,
    seen_now,
    unseen_progress,
)
from scalpel_sim.errors import Interrupted, RunError
from scalpel_sim.learning.episode import Episode
from scalpel_sim.learning.expert import Expert
from scalpel_sim.learning.look_variation import LookVariation
from scalpel_sim.learning.rollout import LONGEST_EPISODE
from scalpel_sim.runs.file_names import SCENE
from scalpel_sim.scene.act_table import ActTable, hands_led
from scalpel_sim.scene.observe_table import ObserveTable
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.scene.write import scene_text


class ExpertTask:
    """A task of which an expert gives demonstrations. It is prepared once, for the first of them.

    Args:
        scene: A scene with a task.
        request: What is taken.
        progress: Returns what is called after each control step, while it is entered.
        stop_reason: Returns why the work is to end now; None: it goes on.

    Raises:
        UsageError: its frames make no such control steps.
    """

    def __init__(
        self,
        scene: Scene,
        request: DatasetRequest = DatasetRequest(),
        *,
        progress: ShowProgress = unseen_progress,
        stop_reason: Callable[[], str | None] = lambda: None,
    ) -> None:
        act, observe = scene.act or ActTable(), scene.observe or ObserveTable()
        if request.fps is not None:
            act = structs.replace(act, step=1.0 / request.fps)
        self.scene = changed(scene, act=act)
        """The scene, with the control step that was requested."""
        self.task = request.task or scene.about or scene.name
        """The task in words."""
        self.cameras = observe.cameras if request.cameras is None else tuple(request.cameras)
        """Cameras and the sizes of their images."""
        self.fps = round(1.0 / act.step)
        """Control steps a second."""
        self.hands = hands_led(act, [each.name for each in scene.graspers])
        """Names of the hands that the expert leads."""
        self.progress, self.stop_reason = progress, stop_reason

    @cached_property
    def episode(self) -> Episode:
        """The task, prepared.

        Raises:
            UsageError: the scene has none.
        """
        return Episode(self.scene)


class ExpertDemonstration:
    """A demonstration of an expert. See `Demonstration`.

    Args:
        of: The task.
        seed: Seed of all that is random: `reset(seed=seed)` of the environment begins alike.
    """

    def __init__(self, of: ExpertTask, seed: int) -> None:
        self._of, self._seed = of, seed
        self.name = f"{of.scene.name}, seed {seed}"
        """Name of it in messages."""
        self.task, self.cameras, self.fps, self.hands = of.task, of.cameras, of.fps, of.hands
        self._n_steps, self._is_success = 0, False
        self._terms: dict[str, float] = {}
        self._variation: dict[str, float] = {}

    @property
    def scene_text(self) -> str:
        """The scene, as a file has it; "" where its body is in no table."""
        return scene_text(self._of.scene, Path(SCENE)) or ""

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of the numbers that are observed."""
        return tuple(self._of.episode.shapes)

    def layout(self) -> DatasetLayout:
        """Return what each control step has.

        Raises:
            UsageError: no camera has such a name.
        """
        episode = self._of.episode
        with open_cameras(episode.simulation, self.cameras):
            return layout_of(episode.simulation, episode.shapes, self)

    def transitions(self) -> Iterator[Transition]:
        """Yield its control steps.

        Raises:
            Interrupted: it is to end.
            RunError: the simulation failed.
        """
        episode = self._of.episode
        simulation, most = episode.simulation, episode.max_steps or LONGEST_EPISODE
        episode.reset(np.random.default_rng(self._seed))
        self._variation = dict(episode.drawn)
        expert = Expert(episode)
        with (
            open_cameras(simulation, self.cameras) as cameras,
            self._of.progress(most * simulation.dt * episode.hand.n_frames) as after_step,
        ):
            LookVariation(self._of.scene, simulation.frame).apply(cameras, episode.drawn)
            before = seen_now(simulation, episode.observation, poses_of_hands(simulation), cameras)
            is_done = False
            while not is_done:
                reason = self._of.stop_reason()
                if reason is not None:
                    raise Interrupted(reason)
                action = expert.action()
                outcome = episode.act(action)
                if outcome.fault is not None:
                    raise RunError(f"{self.name}: after {simulation.time:.3f} s: {outcome.fault}")
                after_step(simulation)
                is_done = outcome.terminated or outcome.truncated or episode.n_steps >= most
                after = seen_now(
                    simulation, episode.observation, poses_of_hands(simulation), cameras
                )
                yield Transition(
                    before,
                    action.astype(np.float32),
                    outcome.reward,
                    is_done,
                    episode.is_success,
                    after,
                )
                before = after
        self._n_steps, self._is_success = episode.n_steps, episode.is_success
        terms = episode.score.terms()
        self._terms = {name: each for name, each in terms.items() if np.isfinite(each)}

    def provenance(self) -> dict[str, Any]:
        """Return where it comes from, and how it ended: for JSON."""
        return {
            "run": self.name,
            "scene": self._of.scene.name,
            "task": self.task,
            "led_by": "an expert",
            "seed": self._seed,
            "variation": self._variation,
            "arm": self._of.episode.arm,
            "steps": self._n_steps,
            "steps_faster_than_limits": 0,
            "success": self._is_success,
            "score": self._terms,
            "scene_file": self.scene_text,
        }
