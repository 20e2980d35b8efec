"""A grasper as a person leads it, and opens and closes its jaws."""

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.grasper import HALF_PAD, GuidedGrasper
from scalpel_sim.hands.limited_pose import LimitedPose
from scalpel_sim.hands.pose_record import PoseRecord
from scalpel_sim.hands.resting_path import RestingPath
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint, edge_of_grasper
from scalpel_sim.tables.grasper import WIDEST_OPENING
from tissue import BladeSegment, FloatArray

JAW_SPEED = 0.03
"""Speed at which the pads come together, and apart [m/s]: the scripts of the scenes close them by
9 mm in 0.3 s."""


class LiveGrasper:
    """See `Instrument`. Its rows are those of `GRASP_COLUMNS`.

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
        """See `Instrument.advance`."""
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
        """See `Instrument.finish`."""
        self._record.finish(t)

    def take_rows(self) -> list[list[float]]:
        """See `Instrument.take_rows`."""
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
        """Have the jaws go one frame towards where they are wanted."""
        step = JAW_SPEED * self._dt
        way = self._wanted_opening - self._at.opening
        to = self._wanted_opening if abs(way) <= step else self._at.opening + np.sign(way) * step
        self._at = self._at._replace(opening=float(to))
