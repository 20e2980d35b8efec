"""The blade of an arm as an instrument: the bridge carries it to the tissue."""

import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.instruments.instrument import Controller
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.recording.columns import ColumnGroup, FrameData
from scalpel_sim.strokes.stroke import Stroke
from tissue import Wrench

BLADE = "scalpel"
"""Name of the instrument of the first arm."""

NO_WRENCH = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))


class BladeInstrument:
    """The blade of an arm, which is led along a stroke. See `Instrument`.

    Args:
        arm: Holds the blade, at the start of the stroke.
        stroke: Path of the blade, tissue frame.
        frame: Where the tissue lies in the world.
    """

    name = BLADE

    def __init__(self, arm: DrivenArm, stroke: Stroke, frame: TissueFrame) -> None:
        self._blade, self._hand, self._frame = arm.blade, arm.hand, frame
        self.segment = arm.blade.segment()
        """Edge at the end of the last frame, world frame."""
        self.wrench = NO_WRENCH
        """Wrench of the tissue on the blade in the last frame, world frame."""
        self.stroke = stroke

    @property
    def stroke(self) -> Stroke:
        """Path of the blade, tissue frame."""
        return self._stroke

    @stroke.setter
    def stroke(self, stroke: Stroke) -> None:
        self._stroke = stroke
        self.controller: Controller = StrokeFollower(self._hand, stroke, self._frame)
        """Leads the blade in each frame."""

    @property
    def duration(self) -> float:
        """Simulated time at which the stroke ends [s]."""
        return self._stroke.duration

    @property
    def columns(self) -> ColumnGroup:
        """None of its own: the first columns of each row are of the blade."""
        return ColumnGroup({}, _no_numbers)

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        self.controller.lead(t)

    def follow(self) -> None:
        """Read where the edge is."""
        self.segment = self._blade.segment()

    def apply(self) -> None:
        """Apply `wrench` to the blade.

        Raises:
            BladeError: it is not finite, or too large; see `Blade.apply`.
        """
        self._blade.apply(self.wrench)

    def release(self) -> None:
        """Take the last wrench off the blade."""
        self._blade.apply(NO_WRENCH)


def _no_numbers(_: FrameData) -> tuple[float, ...]:
    return ()
