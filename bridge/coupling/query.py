"""A question to the tissue and its answer: waited for, or awaited while the arm goes on."""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from bridge.link import TissueLink
from bridge.poses import motion, moved
from tissue import BladeSegment, BladeSweep, StageTimes, StepResult, Wrench

_LONGEST_STEP = 0.5
"""[s]. A tissue that was silent for longer has lost the rest of the time: it would otherwise come
ever later, by the time that making up for it takes."""


class Leg(NamedTuple):
    """A part of the way of the blade, and how long it took."""

    sweep: BladeSweep | None
    """None: no blade near."""
    seconds: float


class Answer(NamedTuple):
    """What the tissue did with what it was asked."""

    result: StepResult
    pose: BladeSegment
    """To which the blade came in it."""
    seconds: float
    """Which it lasted."""
    last_leg: Wrench
    """On the mean over the last leg; its point is the tip at the end."""
    sweep: BladeSweep | None
    """What the blade did in that; None: no blade near."""

    @property
    def middle(self) -> BladeSegment:
        """Where the blade was in the middle of the last leg."""
        if self.sweep is None:
            return self.pose
        return moved(self.sweep.t0, 0.5 * motion(*self.sweep))


class Inquiry:
    """Asks the tissue to live up to now, once at a time.

    Args:
        link: The tissue.
        waits: Whether `ask` returns only when the answer is there, so that a run does not depend on
            how long it takes. Otherwise the tissue is asked in a thread, for an arm that cannot
            wait.
    """

    def __init__(self, link: TissueLink, waits: bool) -> None:
        self._link = link
        self._thread = None if waits else ThreadPoolExecutor(1, thread_name_prefix="tissue")
        self._asked: Future[Answer] | None = None
        self._answer: Answer | None = None

    @property
    def is_open(self) -> bool:
        """Whether an answer has not been taken yet."""
        return self._asked is not None or self._answer is not None

    def ask(self, legs: Sequence[Leg], pose: BladeSegment) -> None:
        """Ask for the steps of a way at whose end the blade is at `pose`.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        if self._thread is None:
            self._answer = self._step(legs, pose)
        else:
            self._asked = self._thread.submit(self._step, legs, pose)

    def answer(self) -> Answer | None:
        """Return the answer, once; None where there is none yet.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        if self._asked is not None and self._asked.done():
            self._answer, self._asked = self._asked.result(), None
        answer, self._answer = self._answer, None
        return answer

    def _step(self, legs: Sequence[Leg], pose: BladeSegment) -> Answer:
        results = [self._link.step(leg.sweep, min(leg.seconds, _LONGEST_STEP)) for leg in legs]
        seconds = [leg.seconds for leg in legs]
        last_leg = results[-1].wrench
        return Answer(_together(results, seconds), pose, sum(seconds), last_leg, legs[-1].sweep)


def _together(results: Sequence[StepResult], seconds: Sequence[float]) -> StepResult:
    """Return the last result with the wrench, the times and the counts of all steps."""
    last = results[-1]
    if len(results) == 1:
        return last
    force, torque = np.zeros(3), np.zeros(3)
    for result, duration in zip(results, seconds, strict=True):
        share = duration / sum(seconds)
        wrench, lever = result.wrench, result.wrench.point - last.wrench.point
        force += share * wrench.force
        torque += share * (wrench.torque + np.cross(lever, wrench.force))
    return last._replace(
        wrench=Wrench(force, torque, last.wrench.point),
        n_substeps=sum(result.n_substeps for result in results),
        profile=StageTimes(*np.sum([result.profile for result in results], axis=0).tolist()),
    )
