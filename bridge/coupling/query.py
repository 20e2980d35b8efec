"""A query to the tissue and its answer, waited for or taken when it is there."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bridge.collision.broad_phase import Overlaps
from bridge.coupling.driven_bodies import DrivenLoads, DrivenPoses, loads_over, mean_loads
from bridge.driven import FramePose, GeomPoses, mean_wrench
from bridge.link import TissueLink
from bridge.poses import Pose, motion, moved
from tissue import BladeSegment, BladeSweep, StageTimes, StepResult, Wrench

_LONGEST_STEP = 0.5
"""Longest step of a query [s]. The rest of a longer silence is lost: to make up for
it would take ever longer."""


class TimedSweep(NamedTuple):
    """A part of the blade's path and its duration."""

    sweep: BladeSweep | None
    """Motion of the blade; None if it is nowhere near the tissue."""
    seconds: float
    """Duration [s]."""
    driven: DrivenPoses = DrivenPoses()
    """Poses of the driven frames and geoms at its end."""


class PathPart(NamedTuple):
    """A part of the path that the tissue has not done yet."""

    blade: Pose
    """Pose of the blade at its end."""
    seconds: float
    """Duration [s]."""
    driven: DrivenPoses
    """Poses of the driven frames and geoms at its end."""


class SweepsAlong(NamedTuple):
    """A path as the tissue is to do it."""

    parts: list[TimedSweep]
    """Parts of a query."""
    touches: bool
    """Whether the blade may touch tissue."""
    fixtures: tuple[str, ...]
    """Names of the fixtures that it touches."""


class TissueAnswer(NamedTuple):
    """The tissue's answer to a query."""

    result: StepResult
    """Result of the last step, with wrench, times and counts of all steps of the query."""
    pose: BladeSegment
    """Pose of the blade at the end."""
    seconds: float
    """Duration of the query [s]."""
    last_wrench: Wrench
    """Mean wrench over the last part of the path; its point is the tip at the end."""
    last_sweep: BladeSweep | None
    """Last part of the path; None if the blade was nowhere near."""
    loads: DrivenLoads
    """Mean loads on frames and geoms over the query."""

    @property
    def middle_pose(self) -> BladeSegment:
        """Pose of the blade in the middle of the last part of the path."""
        if self.last_sweep is None:
            return self.pose
        return moved(self.last_sweep.t0, 0.5 * motion(*self.last_sweep))


class Query:
    """Advances the tissue to the present, one query at a time.

    Args:
        link: The tissue.
        waits: Whether `start` returns only when the answer is there, so that a run does not depend
            on how long it takes. Otherwise the tissue is queried in a thread, for an arm that
            cannot wait.
    """

    def __init__(self, link: TissueLink, waits: bool) -> None:
        self._link = link
        self._thread = None if waits else ThreadPoolExecutor(1, thread_name_prefix="tissue")
        self._future: Future[TissueAnswer] | None = None
        self._answer: TissueAnswer | None = None

    @property
    def is_pending(self) -> bool:
        """Whether an answer has not been taken yet."""
        return self._future is not None or self._answer is not None

    def start(self, path: Sequence[TimedSweep], pose: BladeSegment) -> None:
        """Start a query for the steps along a path.

        Args:
            path: Parts of the blade's path since the last query, in order.
            pose: Pose of the blade at its end.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        if self._thread is None:
            self._answer = self._step(path, pose)
        else:
            self._future = self._thread.submit(self._step, path, pose)

    def step(
        self, sweep: BladeSweep | None, seconds: float, driven: DrivenPoses = DrivenPoses()
    ) -> StepResult:
        """Advance the tissue along one part of a path, and wait for it; see `TimedSweep`.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        return self._link.step(sweep, min(seconds, _LONGEST_STEP), *driven)

    def wait(self) -> None:
        """Wait for the answer, if there is a request: then the link is free for another one."""
        if self._future is not None:
            self._answer, self._future = self._future.result(), None

    def take_answer(self) -> TissueAnswer | None:
        """Return the answer, once; None if there is none yet.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        if self._future is not None and self._future.done():
            self._answer, self._future = self._future.result(), None
        answer, self._answer = self._answer, None
        return answer

    def _step(self, path: Sequence[TimedSweep], pose: BladeSegment) -> TissueAnswer:
        if len(path) == 1:
            result = self.step(*path[0])
            sweep, duration, _ = path[0]
            loads = loads_over(self._link)
            return TissueAnswer(result, pose, duration, result.wrench, sweep, loads)
        results, parts = [], []
        for part in path:
            results.append(self.step(*part))
            parts.append(loads_over(self._link))
        seconds = [part.seconds for part in path]
        last_wrench, last_sweep = results[-1].wrench, path[-1].sweep
        return TissueAnswer(
            _combined(results, seconds),
            pose,
            sum(seconds),
            last_wrench,
            last_sweep,
            mean_loads(parts, [part.driven for part in path], seconds),
        )


def with_bodies(
    path: Sequence[PathPart], *, frame: FramePose | None = None, geoms: GeomPoses | None = None
) -> list[PathPart]:
    """Return a path with a new frame, or with other geoms, which are at rest."""
    found = []
    for part in path:
        frames = part.driven.frames if frame is None else (*part.driven.frames, frame)
        driven = DrivenPoses(frames, part.driven.geoms if geoms is None else geoms)
        found.append(part._replace(driven=driven))
    return found


def sweeps_along(
    path: Sequence[PathPart],
    before: Pose,
    overlaps: Callable[[Pose, Pose, float], Overlaps],
    *,
    straight: bool,
) -> SweepsAlong:
    """Return the motions of the blade along a path.

    A blade that already holds tissue moves on a straight line, except in the last frame: the
    wrench at one instant is noise, and the mean over a frame is felt. A blade that does not
    hold tissue may run into it: it moves as the arm did, frame by frame, or the tissue would
    find it deep inside.

    Args:
        path: The path.
        before: Pose of the blade at its start.
        overlaps: The broad phase, of two poses and the duration between them [s].
        straight: Whether the blade holds tissue.
    """
    if len(path) == 1:
        (blade, seconds, driven) = path[0]
        touches, fixtures = overlaps(before, blade, seconds)
        sweep = BladeSweep(before.segment, blade.segment) if touches else None
        return SweepsAlong([TimedSweep(sweep, seconds, driven)], touches, fixtures)
    seconds = sum(part.seconds for part in path)
    if straight:
        path = [path[-2]._replace(seconds=seconds - path[-1].seconds), path[-1]]
    pairs = list(pairwise([before, *(part.blade for part in path)]))
    found = [overlaps(*pair, seconds) for pair in pairs]
    fixtures = tuple(dict.fromkeys(name for one in found for name in one.fixtures))
    if not any(one.tissue for one in found):
        return SweepsAlong([TimedSweep(None, seconds, path[-1].driven)], False, fixtures)
    parts = [
        TimedSweep(BladeSweep(t0.segment, t1.segment), part.seconds, part.driven)
        for (t0, t1), part in zip(pairs, path, strict=True)
    ]
    return SweepsAlong(parts, True, fixtures)


def _combined(results: Sequence[StepResult], seconds: Sequence[float]) -> StepResult:
    """Return the last result, with the mean wrench and summed times and counts of all steps."""
    return results[-1]._replace(
        wrench=mean_wrench([result.wrench for result in results], seconds),
        n_substeps=sum(result.n_substeps for result in results),
        stage_times=StageTimes(
            *np.sum([result.stage_times for result in results], axis=0).tolist()
        ),
    )
