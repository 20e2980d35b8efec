"""Times what the checks of a step cost, and the states that are saved to go back to, in a scene.

Usage: PYTHONPATH=. python benchmarks/checked_steps.py [SCENE] [--no-audit], on an idle machine

Processor time of each step of a whole stroke, and of the stages in it; the rest is what is checked
and saved. "a save" is the mean of the steps that saved a state, "others" the median of the others.
"""

import sys
import time
from collections.abc import Callable
from statistics import mean, median

from bridge import InProcessLink
from scalpel_sim import SCENES, prepare
from scalpel_sim.scene.scene import changed
from tissue import BladeSweep, StepResult

MICROSECONDS = 1e6


class Timed:
    """A function, and how long its last call took [us]."""

    def __init__(self, do: Callable[[BladeSweep | None, float], StepResult]) -> None:
        self._do = do
        self.taken = 0.0

    def __call__(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Call it."""
        start = time.thread_time()
        result = self._do(sweep, dt)
        self.taken = MICROSECONDS * (time.thread_time() - start)
        return result


def main() -> None:
    """Print the times."""
    names = [name for name in sys.argv[1:] if not name.startswith("-")] or ["organ"]
    scene = changed(SCENES[names[0]], audit="--no-audit" not in sys.argv)
    simulation = prepare(scene)
    link = simulation.link
    assert isinstance(link, InProcessLink)
    tissue = link.tissue
    whole, stages = Timed(tissue.step), Timed(tissue._stages.advance)
    vars(tissue).update(step=whole)  # before the methods of the classes
    vars(tissue._stages).update(advance=stages)
    simulation.step()
    checked: list[float] = []
    others: list[float] = []
    saves: list[float] = []
    n = round(simulation.duration / simulation.dt)
    for _ in range(n):
        simulation.step()
        is_save = not tissue._steps.inputs
        (saves if is_save else others).append(whole.taken - stages.taken)
        checked.append(stages.taken)
    cost = sum(saves) + sum(others)
    print(f"{names[0]}, {n} steps, {tissue.n_repeated_steps} repeated; processor time [us]")
    print(f"stages {mean(checked):.0f} (median {median(checked):.0f}), checks {cost / n:.1f}")
    print(f"a save {mean(saves):.0f} ({len(saves)} of them), others {median(others):.1f}")
    print(f"share of checks and saves: {100.0 * cost / sum(checked):.1f} %")


if __name__ == "__main__":
    main()
