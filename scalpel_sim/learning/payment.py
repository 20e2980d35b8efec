"""`Payment`: the rewards of a task, from the terms of its score."""

from typing import Any

from scalpel_sim.learning.guide import Guide
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation


class Payment:
    """Pays for each control step the increase of the weighted terms, and for success.

    Args:
        task: The task.
        simulation: At its start, with its score.
    """

    def __init__(self, task: TaskTable, simulation: Simulation) -> None:
        score = simulation.score
        assert isinstance(score, Score)
        self._success, self._score, self._simulation = task.reward.success, score, simulation
        self._weights = task.reward.weights()
        self._guide: Guide | None = None
        self.begin()

    def begin(self) -> None:
        """Begin an episode: nothing is done yet."""
        plan = self._score.plan
        if plan is None or "approach" not in self._weights:
            self._guide = None
        elif self._guide is not None and self._guide.plan is plan:
            self._guide.begin()
        else:
            self._guide = Guide(self._simulation, plan)
        self._potential = self._weighted()
        self.is_success = False
        """Whether all conditions of success held after the last control step."""
        self.failed: list[str] = []
        """Conditions that did not hold then."""
        self._is_paid = False

    def after_step(self) -> float:
        """Return the reward of a control step that was done. Success is paid once."""
        now = self._weighted()
        reward, self._potential = now - self._potential, now
        self.failed = self._score.failed(self.terms) or []
        self.is_success = self._score.asks and not self.failed
        if self.is_success and not self._is_paid:
            reward += self._success
            self._is_paid = True
        return reward

    def state(self) -> dict[str, Any]:
        """Return all that the next reward depends on besides the simulation, as JSON has it."""
        holders = [] if self._guide is None else self._guide.holders.tolist()
        return {
            "potential": self._potential,
            "is_success": self.is_success,
            "is_paid": self._is_paid,
            "guide": holders,
        }

    def return_to(self, state: dict[str, Any]) -> None:
        """Return to what `state` returned, after `begin`."""
        self._potential, self.is_success = state["potential"], state["is_success"]
        self._is_paid = state["is_paid"]
        if self._guide is not None:
            self._guide.holders[:] = state["guide"]
        self.terms = self._score.terms()

    def _weighted(self) -> float:
        """Return the weighted sum of the terms now."""
        simulation = self._simulation
        self.terms = self._score.terms()
        """Terms of the score after the last control step, by name."""
        terms = self.terms
        if self._guide is not None:
            terms = dict(terms)
            tip = simulation.frame.segment_to_tissue(simulation.blade.segment).tip
            terms["approach"] = self._guide.way(tip, self._score.is_covered)
        return sum(weight * terms.get(name, 0.0) for name, weight in self._weights.items())
