"""Blade and graspers as a person leads them, and records of where they were led."""

from typing import Protocol

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.grasper import HALF_PAD, GuidedGrasper
from scalpel_sim.arm.hand import Hand
from scalpel_sim.hands.limited_pose import LimitedPose
from scalpel_sim.instruments.blade_instrument import BLADE
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint, edge_of_grasper
from scalpel_sim.strokes.stroke import Stroke, poses_of_edges
from scalpel_sim.tables.values import WIDEST_OPENING
from tissue import BladeSegment, FloatArray

JAW_SPEED = 0.03
"""Speed at which the pads come together, and apart [m/s]: the scripts of the scenes close them by
9 mm in 0.3 s."""


class LiveInstrument(Protocol):
    """An instrument that a person leads when they have chosen it, and which rests else."""

    name: str
    """What the page calls it."""
    pose: LimitedPose
    """Where it is, and where it is wanted."""

    @property
    def is_closed(self) -> bool | None:
        """Whether its jaws are closed, or on their way there; None: it has none."""

    @property
    def numbers(self) -> list[float]:
        """Where it is led, tissue frame, and how far its jaws are open."""

    @property
    def tip(self) -> FloatArray:
        """What of it is led, in the world [m], shape (3,)."""

    def close_jaws(self, closed: bool) -> None:
        """Close or open its jaws, if it has any."""

    def advance(self, t: float, *, is_engaged: bool, moves: bool) -> None:
        """Go on to time `t` [s], and record where it is.

        Args:
            t: A frame after the last one [s].
            is_engaged: Whether a person leads it.
            moves: Whether it goes on; else it rests where it is.
        """

    def finish(self, t: float) -> None:
        """End its record at time `t` [s]."""

    def take_rows(self) -> list[list[float]]:
        """Return the rows that were recorded since the last call."""


class LiveBlade:
    """See `LiveInstrument`. Its rows are those of `LED_COLUMNS`.

    Args:
        hand: Holds the blade already, at the start.
        start: Where it rests at first, tissue frame.
        frame: Where the tissue lies in the world.
        workspace: Lowest and highest place of the middle of the edge [m], shape (2, 3).
        dt: Length of a frame [s].
    """

    is_closed = None

    def __init__(
        self,
        hand: Hand,
        start: BladeSegment,
        frame: TissueFrame,
        workspace: FloatArray,
        dt: float,
    ) -> None:
        self.name = BLADE
        self._frame = frame
        self._path = RestingPath(hand, start, frame)
        self.half = self._path.half
        """Half the length of the edge [m]."""
        self.pose = LimitedPose(self._path.middle, self._path.rotation, workspace, dt)
        self.numbers = [float(number) for part in start for number in part]
        """Tip, heel and forward of the pose that leads, tissue frame."""
        self._record = PoseRecord()

    @property
    def tip(self) -> FloatArray:
        """Where the tip is led [m], world frame, shape (3,)."""
        return self._frame.points_to_world(np.array(self.numbers[:3]))

    def close_jaws(self, closed: bool) -> None:
        """It has none."""

    def advance(self, t: float, *, is_engaged: bool, moves: bool) -> None:
        """See `LiveInstrument.advance`."""
        # The record begins at the start.
        if moves and self._record.has_begun and self.pose.step():
            self._take_pose()
        self._record.add(t, [*self.numbers, float(is_engaged)])

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        self._path.lead(t)

    def finish(self, t: float) -> None:
        """See `LiveInstrument.finish`."""
        self._record.finish(t)

    def take_rows(self) -> list[list[float]]:
        """See `LiveInstrument.take_rows`."""
        return self._record.take_rows()

    def _take_pose(self) -> None:
        """Lead by the pose as a `Stroke` reads it from the record: that rounds it once more."""
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, self.pose.rotation)
        _, along, back = axes.reshape(3, 3).T
        middle, to_tip = self.pose.middle, self.half * along
        pose = BladeSegment(middle + to_tip, middle - to_tip, -back)
        self.numbers = [number for part in pose for number in part.tolist()]
        self._path.take(pose)


class LiveGrasper:
    """See `LiveInstrument`. Its rows are those of `GRASP_COLUMNS`.

    Its jaws close and open as far as they do in a motion. Where they only rest there, they close
    and open as far as they can.

    Args:
        grasper: At the start of the motion.
        motion: Where it rests at first, tissue frame.
        frame: Where the tissue lies in the world.
        workspace: Lowest and highest place of the middle between the pads [m], shape (2, 3).
        dt: Length of a frame [s].
    """

    def __init__(
        self,
        grasper: GuidedGrasper,
        motion: GraspMotion,
        frame: TissueFrame,
        workspace: FloatArray,
        dt: float,
    ) -> None:
        self.name = motion.name
        self._grasper, self._frame, self._dt = grasper, frame, dt
        has_moved_jaws = motion.pads[0] < motion.pads[1]
        self._closed, self._open = motion.pads if has_moved_jaws else (0.0, WIDEST_OPENING)
        start = motion.start
        self._path = RestingPath(grasper.hand, self._edge(start), frame)
        self.pose = LimitedPose(self._path.middle, self._path.rotation, workspace, dt)
        self._at = start
        self._wanted_opening = start.opening
        self._record = PoseRecord()

    @property
    def is_closed(self) -> bool:
        """Whether its jaws are closed, or on their way there."""
        return self._wanted_opening < 0.5 * (self._closed + self._open)

    @property
    def numbers(self) -> list[float]:
        """Place, approach, across and opening, tissue frame."""
        return [*(float(number) for part in self._at[1:4] for number in part), self._at.opening]

    @property
    def tip(self) -> FloatArray:
        """Where the middle between the pads is led [m], world frame, shape (3,)."""
        return self._frame.points_to_world(np.array(self._at.at))

    def close_jaws(self, closed: bool) -> None:
        """Close or open the jaws."""
        self._wanted_opening = self._closed if closed else self._open

    def advance(self, t: float, *, is_engaged: bool, moves: bool) -> None:
        """See `LiveInstrument.advance`."""
        if moves and self._record.has_begun:
            if self.pose.step():
                self._take_pose()
            self._move_jaws()
        self._record.add(t, [*self.numbers, float(is_engaged)])

    def lead(self, t: float) -> None:
        """Lead it to its pose and opening at time `t` [s], a step after the last one."""
        self._path.lead(t)
        self._grasper.open_to(self._at.opening)

    def finish(self, t: float) -> None:
        """See `LiveInstrument.finish`."""
        self._record.finish(t)

    def take_rows(self) -> list[list[float]]:
        """See `LiveInstrument.take_rows`."""
        return self._record.take_rows()

    def _edge(self, at: Waypoint) -> BladeSegment:
        return edge_of_grasper(at, HALF_PAD, HALF_PAD, self.name)

    def _take_pose(self) -> None:
        """Lead by the pose as a `GraspMotion` reads it from the record."""
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, self.pose.rotation)
        across, along, _ = axes.reshape(3, 3).T
        at = self.pose.middle
        self._at = self._at._replace(
            at=at.tolist(), approach=along.tolist(), across=across.tolist()
        )
        self._path.take(self._edge(self._at))

    def _move_jaws(self) -> None:
        """Move the jaws by one frame towards the wanted opening."""
        step = JAW_SPEED * self._dt
        way = self._wanted_opening - self._at.opening
        to = self._wanted_opening if abs(way) <= step else self._at.opening + np.sign(way) * step
        self._at = self._at._replace(opening=float(to))


class RestingPath:
    """A path of one pose, and the hand that is led to it.

    It leads the hand to the same bits as a stroke with that pose in a row does.

    Args:
        hand: Holds an instrument already, at the pose.
        start: The first pose, tissue frame.
        frame: Where the tissue lies in the world.
    """

    def __init__(self, hand: Hand, start: BladeSegment, frame: TissueFrame) -> None:
        stroke = Stroke([0.0, 1.0], [start, start])
        self._row = stroke.path[0]
        self._follower = StrokeFollower(hand, stroke, frame)

    @property
    def half(self) -> float:
        """Half the length of the edge [m]."""
        return float(self._row[2])

    @property
    def middle(self) -> FloatArray:
        """Where the middle of the edge is [m], shape (3,). A copy."""
        return np.array(self._row[10:13])

    @property
    def rotation(self) -> FloatArray:
        """How the edge is turned: its +y is along it, and its -z cuts (w, x, y, z). A copy."""
        return np.array(self._row[3:7])

    def take(self, pose: BladeSegment) -> None:
        """Replace the pose by one of the same length."""
        tip, heel, forward = (part[None] for part in pose)
        middles, rotations, _ = poses_of_edges(tip, heel, forward)
        self._row[3:7], self._row[10:13] = rotations[0], middles[0]

    def lead(self, t: float) -> None:
        """Lead the instrument to the pose at time `t` [s], a step after the last one."""
        self._follower.lead(t)


class PoseRecord:
    """What a hand did, frame by frame. Of rows in turn that are the same, two are enough."""

    def __init__(self) -> None:
        self._rows: list[list[float]] = []
        self._last: tuple[float, list[float]] | None = None
        self._is_kept = False

    @property
    def has_begun(self) -> bool:
        """Whether there is a row yet."""
        return self._last is not None

    def add(self, t: float, row: list[float]) -> None:
        """Record a row at time `t` [s], and the one before where that had been left out.

        Of rows in turn that are the same, the first and the last are enough.
        """
        is_new = self._last is None or self._last[1] != row
        if is_new:
            if self._last is not None and not self._is_kept:
                self._rows.append([self._last[0], *self._last[1]])
            self._rows.append([t, *row])
        self._last, self._is_kept = (t, row), is_new

    def finish(self, t: float) -> None:
        """End the record at time `t` [s] with the last row."""
        if self._last is not None and (t > self._last[0] or not self._is_kept):
            self._rows.append([t, *self._last[1]])

    def take_rows(self) -> list[list[float]]:
        """Return the rows since the last call, each after its time."""
        rows, self._rows = self._rows, []
        return rows
