"""Environments: control steps without arms beside whole arms, resets, images, and processes."""

import os
import time
from collections.abc import Callable

import numpy as np
from msgspec import structs

from benchmarks.timing import Rounds, TurnWatch
from scalpel_sim.camera.gl_context import RenderError
from scalpel_sim.learning import Episode, Expert, TissueVectorEnv
from scalpel_sim.learning.episode import FULL, KINEMATIC
from scalpel_sim.learning.images import ImageTaker
from scalpel_sim.scene.observe_table import CameraTable, ObserveTable
from scalpel_sim.scene.read import TASK_SCENES, scene_called
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.measurements import CPU, HIGHER, WALL, BenchmarkResult, Clock
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT
from tissue import FloatArray

_BODIES = ("slab", "organ")
"""Scenes beside the tasks: a small and a large body."""

_CAMERA = CameraTable(name="overview", size=(128, 128))
"""Camera of a scene without a task."""

_IN_ALL = Clock(CPU.name, time.process_time)
"""CPU time of all threads: those that draw an image, too."""

_MOST_DRAWN = 50
"""Control steps after which images are taken in a round, at most."""

_N_ENVS = 4
"""Environments that one process has, or two share."""

_N_WORKERS = (1, 2)
"""Numbers of processes."""


def environments(
    *names: str,
    steps: int = 400,
    many: str = "incise-v0",
    runs: Rounds = 5,
    watch: TurnWatch = SILENT,
) -> BenchmarkResult:
    """Time what a policy waits for: control steps, resets and images, and several processes.

    The expert does the same episode without arms and with whole ones, in turns. For example:

    ```console
    python -m benchmarks environments incise-v0 ligament-v0 --runs 3
    ```

    Args:
        names: Scenes and tasks [default: slab, organ, and all tasks].
        steps: Control steps of an episode at most.
        many: Task that several processes do.
        runs: Number of rounds.
        watch: Receives the progress.
    """
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    chosen = names or (*_BODIES, *TASK_SCENES)
    watch.begin(len(chosen) + 1)
    rows = Rows("environments", CPU)
    for name in chosen:
        _time_episodes(rows, name, steps, runs)
        watch.tick(name)
    _time_processes(rows, many, steps, runs)
    watch.tick(many)
    about = (
        "Control steps of 20 ms, of the expert in whole episodes that vary: the action is worked "
        "out before the clock starts, the observation and the reward are in it. Images are those "
        "of the cameras of the task, all together. Processes: environments one after the other in "
        f"one process, or shared by two, {_N_ENVS} in all, with random actions, resets and the "
        f"copy of what is observed. They need idle cores: the load was {load:.1f} at the start."
    )
    return rows.table("environments", about)


def _time_episodes(rows: Rows, name: str, steps: int, runs: int) -> None:
    """Add the figures of a scene."""
    scene = _as_task(scene_called(name))
    episodes = {arm: Episode(scene, arm) for arm in (KINEMATIC, FULL)}
    size = int(episodes[KINEMATIC].simulation.link.describe().n_tetrahedra)
    rates: dict[str, list[float]] = {arm: [] for arm in episodes}
    resets: list[FloatArray] = []
    images: list[FloatArray] = []
    taker = _taker_of(rows, episodes[KINEMATIC], size)
    with no_garbage_collection():
        for n in range(runs + 1):
            for arm, episode in episodes.items():
                reset, taken = _episode_times(episode, n, steps)
                if n == 0:  # loads and compiles
                    continue
                rates[arm].append(1.0 / float(taken.mean()))
                if arm == KINEMATIC:
                    resets.append(np.array([reset]))
            if n > 0 and taker is not None:
                images.append(_image_times(episodes[KINEMATIC], n, steps, taker))
    for arm, title in ((KINEMATIC, "no arms"), (FULL, "whole arms")):
        rows.values(f"{name}: {title}", size, rates[arm], "steps/s", better=HIGHER, clock=CPU.name)
    ratios = np.array(rates[KINEMATIC]) / np.array(rates[FULL])
    rows.values(f"{name}: ratio of both", size, ratios.tolist(), "1", better=HIGHER, clock=CPU.name)
    rows.times(f"{name}: reset", size, resets)
    if taker is not None:
        taker.close()
        rows.times(f"{name}: images", size, images)


def _as_task(scene: Scene) -> Scene:
    """Return a scene with a task; one that has none gets one without conditions, and a camera."""
    if scene.task is not None:
        return scene
    return structs.replace(scene, task=TaskTable(), observe=ObserveTable(cameras=(_CAMERA,)))


def _taker_of(rows: Rows, episode: Episode, size: int) -> ImageTaker | None:
    """Return what takes the images of a task; None where it shows none, or nothing can draw."""
    if not (episode.scene.observe or ObserveTable()).cameras:
        return None
    taker = ImageTaker(episode)
    try:
        taker.take()
    except RenderError as error:
        rows.skip(f"{episode.scene.name}: images", size, str(error))
        return None
    return taker


def _episode_times(episode: Episode, seed: int, steps: int) -> tuple[float, FloatArray]:
    """Return the CPU time of a reset, and of each control step of the expert [s]."""
    rng = np.random.default_rng(seed)
    reset = _seconds(CPU, lambda: episode.reset(rng))
    expert, taken = Expert(episode), list[float]()
    for _ in range(steps):
        action = expert.action()
        begin = CPU.now()
        outcome = episode.act(action)
        taken.append(CPU.now() - begin)
        if outcome.terminated or outcome.truncated:
            break
    return reset, np.array(taken)


def _image_times(episode: Episode, seed: int, steps: int, taker: ImageTaker) -> FloatArray:
    """Return the CPU time of all images of each control step [s]; a pass of its own.

    What draws takes the caches, and control steps between images would take longer.
    """
    episode.reset(np.random.default_rng(seed))
    taker.begin()
    expert, drawn = Expert(episode), list[float]()
    for _ in range(min(steps, _MOST_DRAWN)):
        outcome = episode.act(expert.action())
        drawn.append(_seconds(_IN_ALL, taker.take))
        if outcome.terminated or outcome.truncated:
            break
    return np.array(drawn)


def _time_processes(rows: Rows, name: str, steps: int, runs: int) -> None:
    """Add control steps a second of environments in one process, and shared by two."""
    scene = _as_task(scene_called(name))
    made: list[TissueVectorEnv] = []
    try:
        made += [TissueVectorEnv(scene, _N_ENVS, workers) for workers in _N_WORKERS]
        rates = np.array([[_rate_of(envs, n, steps) for envs in made] for n in range(runs + 1)])[1:]
    finally:
        for envs in made:
            envs.close()
    for workers, values in zip(_N_WORKERS, rates.T.tolist(), strict=True):
        rows.values(
            f"{name}: processes: {workers}", None, values, "steps/s", better=HIGHER, clock=WALL.name
        )
    ratios = (rates[:, 1] / rates[:, 0]).tolist()
    rows.values(f"{name}: two over one", None, ratios, "1", better=HIGHER, clock=WALL.name)


def _rate_of(envs: TissueVectorEnv, seed: int, steps: int) -> float:
    """Return the control steps a second of environments with random actions."""
    rng = np.random.default_rng(seed)
    envs.reset(seed=seed)
    actions = rng.uniform(-1.0, 1.0, (steps, *(envs.action_space.shape or ())))
    taken = _seconds(WALL, lambda: [envs.step(each) for each in actions])
    return steps * envs.num_envs / taken


def _seconds(clock: Clock, do: Callable[[], object]) -> float:
    """Return the time that something takes [s]."""
    begin = clock.now()
    do()
    return clock.now() - begin
