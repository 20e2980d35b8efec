"""A hand that somebody leads: it moves towards where they want it, and what it did is recorded."""

import abc
import math
import time
from collections import deque
from collections.abc import Callable

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.hand import Hand
from scalpel_sim.arm.stroke_follower import StrokeFollower
from scalpel_sim.hands.commands import LeadingCommand
from scalpel_sim.hands.limited_pose import LimitedPose
from scalpel_sim.strokes.stroke import Stroke, poses_of_edges
from tissue import FloatArray


class LedHand(abc.ABC):
    """Leads a hand towards a wanted pose, in place of a `StrokeFollower`.

    It starts at the start of a stroke, and is released. Whoever leads it says how to move from
    where it wants to be, never where to be, so that nothing jumps when it is engaged again.

    A `Stroke` read from its rows leads a hand to the same bits.

    Args:
        hand: Holds a blade already, at the start of the stroke.
        stroke: Where the blade rests at first, tissue frame.
        frame: Where the tissue lies in the world.
        workspace: Where the middle of the edge may be: see `workspace.workspace`.
        dt: Length of a frame [s].
        seconds: How long it leads at most [s]; then it has ended.
        clock: Wall time [s], by which silence is measured.
    """

    def __init__(
        self,
        hand: Hand,
        stroke: Stroke,
        frame: TissueFrame,
        workspace: FloatArray,
        *,
        dt: float,
        seconds: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.commands: deque[LeadingCommand] = deque()
        """What the page asks it to do."""
        self.stamp: float | None = None
        """Stamp of the newest command of the page that it has obeyed; None: there was none yet."""
        self.is_engaged = False
        """Whether it leads the blade."""
        self.ended_at: float | None = None
        """Simulated time at which the stroke has ended [s]; from then on it rests."""
        self.n_limited = 0
        """Frames in which a limit of speed, turn rate or room held the blade back."""
        self._frame, self._clock = frame, clock
        self._dt, self._seconds = dt, seconds
        self._heard_at = -math.inf
        start = stroke.start
        self._resting = Stroke([0.0, 1.0], [start, start])
        """Its path has one row, the pose that leads now, which is written over."""
        self._follower = StrokeFollower(hand, self._resting, frame)
        self._path = path = self._resting.path[0]
        self._half = float(path[2])
        self._pose = LimitedPose(path[10:13], path[3:7], workspace, dt)
        self._numbers = [float(number) for part in start for number in part]
        self._rows: list[list[float]] = []
        self._last: tuple[float, list[float]] | None = None
        self._is_kept = False

    @abc.abstractmethod
    def _obey(self) -> bool:
        """Do what was asked for since the last frame; return whether the stroke is to end."""

    @property
    def pose(self) -> tuple[float, ...]:
        """Tip, heel and forward of the pose that leads, tissue frame."""
        return tuple(self._numbers)

    @property
    def tip(self) -> FloatArray:
        """Where the tip is led [m], world frame, shape (3,)."""
        return self._frame.points_to_world(np.array(self._numbers[:3]))

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        if self.ended_at is None:
            has_ended = self._obey() or t >= self._seconds
            # The record begins at the start.
            if self._last is not None and not has_ended and self._pose.step():
                self._take_pose()
            self.n_limited += self._pose.was_limited()
            self._record(t)
            if has_ended:
                self.finish(max(t, self._dt))
        self._follower.lead(t)

    def finish(self, t: float) -> None:
        """End the stroke at time `t` [s], after its last frame, unless it has ended before."""
        if self.ended_at is None:
            self.ended_at = t
            self.let_go()
            if self._last is not None and (t > self._last[0] or not self._is_kept):
                self._rows.append([t, *self._last[1]])

    def let_go(self) -> None:
        """Rest where it is."""
        self.is_engaged = False
        self._pose.rest()

    def take_rows(self) -> list[list[float]]:
        """Return the rows of `LED_COLUMNS` that were recorded since the last call."""
        rows, self._rows = self._rows, []
        return rows

    def _take_pose(self) -> None:
        """Lead by the pose as a `Stroke` reads it from the record: that rounds it once more."""
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, self._pose.rotation)
        _, along, back = axes.reshape(3, 3).T
        middle, to_tip = self._pose.middle, self._half * along
        tip, heel = middle + to_tip, middle - to_tip
        self._numbers = [*tip.tolist(), *heel.tolist(), *(-back).tolist()]
        middles, rotations, _ = poses_of_edges(tip[None], heel[None], -back[None])
        self._path[3:7], self._path[10:13] = rotations[0], middles[0]

    def _record(self, t: float) -> None:
        """Record the pose at time `t` [s], and the one before where that had been left out.

        Of poses in turn that are the same, the first and the last are enough.
        """
        row = [*self._numbers, float(self.is_engaged)]
        is_new = self._last is None or self._last[1] != row
        if is_new:
            if self._last is not None and not self._is_kept:
                self._rows.append([self._last[0], *self._last[1]])
            self._rows.append([t, *row])
        self._last, self._is_kept = (t, row), is_new
