"""Tasks: how often experts and baselines succeed, and what a control step costs."""

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest

from benchmarks.timing import TurnWatch
from scalpel_sim.learning.episode import FULL, KINEMATIC, Episode
from scalpel_sim.learning.rollout import POLICIES, Policy, PolicyMaker, run_episode
from scalpel_sim.scene.read import TASK_SCENES, scene_called
from scalpel_sim.validate.speed.machine import processor_name
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.watch import SILENT
from tissue import FloatArray

_PAGE = Path(__file__).parents[2] / "docs" / "benchmark.md"
"""Page whose table is replaced."""

_BEGIN, _END = "<!-- begin of the table -->", "<!-- end of the table -->"

_FULL_SHARE = 5
"""Of as many episodes one is done with whole arms too: they take several times as long."""


class Rate(NamedTuple):
    """Successes of a policy."""

    successes: int
    episodes: int

    def __str__(self) -> str:
        """Return the rate in percent, with Wilson's interval of 95 %."""
        ends = binomtest(self.successes, self.episodes).proportion_ci(method="wilson")
        rate = 100.0 * self.successes / self.episodes
        return f"{rate:.0f} ({100.0 * ends.low:.0f} to {100.0 * ends.high:.0f})"


class TaskFigures(NamedTuple):
    """Figures of a task."""

    name: str
    tetrahedra: int
    rates: dict[str, Rate]
    """Of each policy; `full` is the expert with whole arms."""
    steps: int
    """Control steps of the expert, median."""
    milliseconds: float
    """CPU time of one of them without the expert's own [ms], median over episodes of the mean."""
    reset: float
    """CPU time of a reset [ms], median."""


def tasks(
    *names: str,
    episodes: int = 100,
    out: Path = Path("docs"),
    watch: TurnWatch = SILENT,
) -> BenchmarkResult:
    """Do episodes of each task by its expert, at random and by doing nothing: benchmark.md.

    Args:
        names: Tasks; all without.
        episodes: Episodes of each policy; a fifth of them with whole arms.
        out: Folder of the page, whose table is replaced.
        watch: Receives the progress.
    """
    chosen = names or TASK_SCENES
    watch.begin(len(chosen))
    rows = []
    for name in chosen:
        rows.append(_measured(name, episodes))
        watch.tick(name)
    lines = [_HEAD, *(_row(each) for each in rows)]
    lines.append(f"\nMeasured on: {processor_name()}; {episodes} episodes each.")
    if not names:
        page = _PAGE.read_text(encoding="utf-8")
        before, rest = page.split(_BEGIN)
        text = f"{before}{_BEGIN}\n{chr(10).join(lines)}\n{_END}{rest.split(_END)[1]}"
        out.mkdir(parents=True, exist_ok=True)
        (out / _PAGE.name).write_text(text, encoding="utf-8")
    return BenchmarkResult([], [], lambda console: console.print("\n".join(lines), soft_wrap=True))


_HEAD = (
    "| task | tetrahedra | expert | expert, whole arms | random | idle | steps | ms a step | ms a "
    "reset |\n|---|---|---|---|---|---|---|---|---|"
)


def _row(task: TaskFigures) -> str:
    """Return the row of a task."""
    rates = " | ".join(str(task.rates[each]) for each in ("expert", FULL, "random", "idle"))
    return (
        f"| `{task.name}` | {task.tetrahedra:,} | {rates} | {task.steps} | "
        f"{task.milliseconds:.1f} | {task.reset:.1f} |"
    )


class _Clock:
    """CPU time of the control steps of an episode, without that of its policy.

    Args:
        make: Makes the policy.
    """

    def __init__(self, make: PolicyMaker) -> None:
        self._make, self._begin, self._of_policy = make, 0.0, 0.0

    def make(self, episode: Episode, rng: np.random.Generator) -> Policy:
        """Make the policy; the first control step begins after that."""
        act = self._make(episode, rng)

        def timed() -> FloatArray:
            before = time.process_time()
            action = act()
            self._of_policy += time.process_time() - before
            return action

        self._begin = time.process_time()
        return timed

    def seconds(self) -> float:
        """Return the CPU time of the control steps so far [s]."""
        return time.process_time() - self._begin - self._of_policy


def _measured(name: str, episodes: int) -> TaskFigures:
    """Return the figures of a task."""
    scene = scene_called(name)
    episode = Episode(scene, KINEMATIC)
    tetrahedra = int(episode.simulation.link.describe().n_tetrahedra)
    rates, steps, costs, resets = {}, [], [], []
    for policy, make in POLICIES.items():
        n = 0
        for seed in range(episodes):
            before = time.process_time()
            episode.reset(np.random.default_rng(seed))
            resets.append(time.process_time() - before)
            clock = _Clock(make)
            end = run_episode(episode, clock.make, seed)
            if policy == "expert":
                steps.append(end.n_steps)
                costs.append(clock.seconds() / end.n_steps)
            n += end.is_success
        rates[policy] = Rate(n, episodes)
    full = Episode(scene, FULL)
    seeds = range(0, episodes, _FULL_SHARE)
    n = sum(run_episode(full, POLICIES["expert"], seed).is_success for seed in seeds)
    rates[FULL] = Rate(n, len(seeds))
    return TaskFigures(
        name,
        tetrahedra,
        rates,
        round(float(np.median(steps))),
        1e3 * float(np.median(costs)),
        1e3 * float(np.median(resets)),
    )
