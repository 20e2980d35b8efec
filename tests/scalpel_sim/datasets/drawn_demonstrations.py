"""Episodes of numbers that are drawn: what writers do with them does not depend on a simulation."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from scalpel_sim.datasets.demonstration import DatasetLayout, DatasetQuantity, Seen, Transition

SIZE = (12, 16)
"""Height and width of an image."""

LAYOUT = DatasetLayout(
    fps=50,
    robot="arm",
    observations=(
        DatasetQuantity("blade", (3,), ("blade_x", "blade_y", "blade_z"), is_of_hand=True),
        DatasetQuantity("left", (2,), ("left_x", "left_open"), is_of_hand=True),
        DatasetQuantity("wrench", (6,), tuple(f"wrench_{i}" for i in range(6))),
        DatasetQuantity("wrench_peak", (1,), ("wrench_peak",)),
        DatasetQuantity("points:4", (4, 3)),
    ),
    images={"endoscope": SIZE},
    action=DatasetQuantity("action", (2,), ("blade_move_x", "left_jaws")),
)


class DrawnDemonstration:
    """An episode whose numbers are drawn.

    Args:
        seed: Draws them.
        n: Number of control steps.
        error: Raised after them; None: it ends.
    """

    task = "Cut along the line."
    scene_text = 'name = "drawn"\n'

    def __init__(self, seed: int, n: int, error: BaseException | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.seen = [_drawn(rng, i) for i in range(n + 1)]
        self.actions = rng.normal(size=(n, 2)).astype(np.float32)
        self.rewards = rng.normal(size=n).astype(np.float32)
        self._error = error

    def transitions(self) -> Iterator[Transition]:
        last = len(self.actions) - 1
        for i, action in enumerate(self.actions):
            before, after = self.seen[i : i + 2]
            done = i == last
            yield Transition(before, action, float(self.rewards[i]), done, done, after)
        if self._error is not None:
            raise self._error

    def provenance(self) -> dict[str, Any]:
        return {"scene": "drawn", "task": self.task, "steps": len(self.actions), "success": True}


def _drawn(rng: np.random.Generator, i: int) -> Seen:
    observations = {
        each.name: rng.normal(size=each.shape).astype(np.float32) for each in LAYOUT.observations
    }
    images = {"endoscope": rng.integers(0, 256, (*SIZE, 3), np.uint8)}
    return Seen(observations, images, np.array([0.02 * i, *rng.normal(size=3)]))
