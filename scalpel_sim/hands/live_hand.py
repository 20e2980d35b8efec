"""A hand that a person leads: it moves towards where they want it, and what it did is recorded."""

import math
import time
from collections import deque
from collections.abc import Callable

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.hand import Hand
from scalpel_sim.arm.stroke_follower import StrokeFollower
from scalpel_sim.hands.commands import (
    LONGEST_SILENCE,
    Command,
    End,
    Engage,
    Move,
    Release,
    Turn,
)
from scalpel_sim.strokes.stroke import Stroke, poses_of_edges
from tissue import FloatArray

MOST_SPEED = 0.2
"""Highest speed of the middle of the edge [m/s]: three times that of an unhurried incision, and a
tenth of `FASTEST`. A faster blade would skip elements in a frame."""

MOST_TURN_RATE = 2.0
"""Highest rate at which the blade turns [rad/s]: the ends of an edge of 80 mm then move at 0.08 m/s
more."""

FOLLOWING_TIME = 0.02
"""Time constant with which the hand follows [s]: a page sends a move every 16 ms, and between two
of them the blade should not stop."""

FARTHEST_AHEAD, MOST_AHEAD_TURN = 0.04, 0.4
"""How far the wanted pose may be ahead of the hand [m, rad]: what it does in a fifth of a second.
What is asked beyond is lost, so that the blade stops soon after the person does."""

ARRIVED, ARRIVED_TURN = 1e-7, 1e-6
"""Distance [m] and angle [rad] from the wanted pose at which the hand is there: a thousandth of a
frame's motion."""


class LiveHand:
    """Leads a hand as commands say, in place of a `StrokeFollower`.

    It starts at the start of a stroke, and is released. Commands say how to move from where it
    wants to be, never where to be, so that nothing jumps when it is engaged again.

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
        self.commands: deque[Command] = deque()
        """What it is asked to do; any thread may append."""
        self.stamp: float | None = None
        """Stamp of the newest command that it has obeyed; None: there was none yet."""
        self.is_engaged = False
        """Whether it leads the blade."""
        self.ended_at: float | None = None
        """Simulated time at which the stroke has ended [s]; from then on it rests."""
        self._frame, self._workspace, self._clock = frame, workspace, clock
        self._dt, self._seconds = dt, seconds
        self._heard_at = -math.inf
        start = stroke.start
        self._resting = Stroke([0.0, 1.0], [start, start])
        """Its path has one row, the pose that leads now, which is written over."""
        self._follower = StrokeFollower(hand, self._resting, frame)
        path = self._resting.path[0]
        self._half = float(path[2])
        self._rotation, self._middle = path[3:7].copy(), path[10:13].copy()
        self._wanted_rotation, self._wanted = self._rotation.copy(), self._middle.copy()
        self._numbers = [float(number) for part in start for number in part]
        self._rows: list[list[float]] = []
        self._last: tuple[float, list[float]] | None = None
        self._is_kept = False

    @property
    def tip(self) -> FloatArray:
        """Where the tip is led [m], world frame, shape (3,)."""
        return self._frame.points_to_world(np.array(self._numbers[:3]))

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        if self.ended_at is None:
            has_ended = self._obey() or t >= self._seconds
            if self._last is not None and not has_ended:  # the record begins at the start
                self._step()
            self._record(t)
            if has_ended:
                self.finish(max(t, self._dt))
        self._follower.lead(t)

    def finish(self, t: float) -> None:
        """End the stroke at time `t` [s], after its last frame, unless it has ended before."""
        if self.ended_at is None:
            self.ended_at = t
            self._let_go()
            if self._last is not None and (t > self._last[0] or not self._is_kept):
                self._rows.append([t, *self._last[1]])

    def take_rows(self) -> list[list[float]]:
        """Return the rows of `LED_COLUMNS` that were recorded since the last call."""
        rows, self._rows = self._rows, []
        return rows

    def _obey(self) -> bool:
        """Do what the commands say; return whether one of them ends the stroke."""
        has_ended = False
        while self.commands:
            command = self.commands.popleft()
            self._heard_at = self._clock()
            if isinstance(command, Move | Turn):
                self.stamp = command.stamp
                if self.is_engaged:
                    self._want(command)
            elif isinstance(command, Engage):
                self.is_engaged = True
            elif isinstance(command, Release):
                self._let_go()
            elif isinstance(command, End):
                has_ended = True
        if self.is_engaged and self._clock() - self._heard_at > LONGEST_SILENCE:
            self._let_go()
        return has_ended

    def _let_go(self) -> None:
        """Rest where it is."""
        self.is_engaged = False
        self._wanted[:] = self._middle
        self._wanted_rotation[:] = self._rotation

    def _want(self, command: Move | Turn) -> None:
        """Move or turn the wanted pose, as far as it may be ahead."""
        by = self._frame.vectors_to_tissue(np.array(command.by))
        if isinstance(command, Move):
            ahead = np.clip(self._wanted + by, *self._workspace) - self._middle
            self._wanted = self._middle + _shortened(ahead, FARTHEST_AHEAD)
        else:
            turn, turned = np.array([1.0, 0.0, 0.0, 0.0]), np.empty(4)
            mujoco.mju_quatIntegrate(turn, by, 1.0)
            mujoco.mju_mulQuat(turned, turn, self._wanted_rotation)
            ahead = np.empty(3)
            mujoco.mju_subQuat(ahead, turned, self._rotation)
            self._wanted_rotation = self._rotation.copy()
            mujoco.mju_quatIntegrate(self._wanted_rotation, _shortened(ahead, MOST_AHEAD_TURN), 1.0)

    def _step(self) -> None:
        """Go one frame towards the wanted pose."""
        way, turn = self._wanted - self._middle, np.empty(3)
        mujoco.mju_subQuat(turn, self._wanted_rotation, self._rotation)
        distance, angle = math.hypot(*way.tolist()), math.hypot(*turn.tolist())
        if distance <= ARRIVED and angle <= ARRIVED_TURN:
            return
        share = 1.0 - math.exp(-self._dt / FOLLOWING_TIME)
        if distance > ARRIVED:
            self._middle += way * min(share, MOST_SPEED * self._dt / distance)
        if angle > ARRIVED_TURN:
            mujoco.mju_quatIntegrate(
                self._rotation, turn, min(share, MOST_TURN_RATE * self._dt / angle)
            )
            mujoco.mju_normalize4(self._rotation)
        self._take_pose()

    def _take_pose(self) -> None:
        """Lead by the pose as a `Stroke` reads it from the record: that rounds it once more."""
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, self._rotation)
        _, along, back = axes.reshape(3, 3).T
        tip, heel = self._middle + self._half * along, self._middle - self._half * along
        self._numbers = [*tip.tolist(), *heel.tolist(), *(-back).tolist()]
        middles, rotations, _ = poses_of_edges(tip[None], heel[None], -back[None])
        path = self._resting.path[0]
        path[3:7], path[10:13] = rotations[0], middles[0]

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


def _shortened(vector: FloatArray, longest: float) -> FloatArray:
    """Return a vector of at most that length."""
    length = math.hypot(*vector.tolist())
    return vector if length <= longest else vector * (longest / length)
