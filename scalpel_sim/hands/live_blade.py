"""The blade as a person leads it."""

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.hand import Hand
from scalpel_sim.hands.limited_pose import LimitedPose
from scalpel_sim.hands.pose_record import PoseRecord
from scalpel_sim.hands.resting_path import RestingPath
from tissue import BladeSegment, FloatArray

BLADE = "scalpel"
"""What the page calls the instrument of the first arm."""


class LiveBlade:
    """See `Instrument`. Its rows are those of `LED_COLUMNS`.

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
        """See `Instrument.advance`."""
        # The record begins at the start.
        if moves and self._record.has_begun and self.pose.step():
            self._take_pose()
        self._record.add(t, [*self.numbers, float(is_engaged)])

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        self._path.lead(t)

    def finish(self, t: float) -> None:
        """See `Instrument.finish`."""
        self._record.finish(t)

    def take_rows(self) -> list[list[float]]:
        """See `Instrument.take_rows`."""
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
