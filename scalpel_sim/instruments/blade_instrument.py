"""The blade of an arm as an instrument: the bridge carries it to the tissue."""

import numpy as np

from bridge import TissueFrame, TissueLink
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.instruments.guarded_follower import (
    ENDED,
    LONGEST_WAY,
    GuardedFollower,
    Sensed,
    StrokeProgress,
)
from scalpel_sim.instruments.instrument import Controller
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.recording.columns import ColumnGroup, FrameData
from scalpel_sim.strokes.stroke import Stroke
from tissue import Wrench

BLADE = "scalpel"
"""Name of the instrument of the first arm."""

STROKE_TIME = "stroke_time"
"""Quantity of strokes with guards: their own clock [s]."""

NO_WRENCH = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))


class BladeInstrument:
    """The blade of an arm, which is led along a stroke. See `Instrument`.

    Args:
        arm: Holds the blade, at the start of the stroke.
        stroke: Path of the blade, tissue frame.
        frame: Where the tissue lies in the world.
        link: The tissue.
        bridge: Has its last result.
    """

    name = BLADE

    def __init__(
        self,
        arm: DrivenArm,
        stroke: Stroke,
        frame: TissueFrame,
        link: TissueLink,
        bridge: Sensed,
    ) -> None:
        self._blade, self._hand, self._frame = arm.blade, arm.hand, frame
        self._link, self._bridge = link, bridge
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
        self.progress = StrokeProgress(stroke) if stroke.guards else None
        """Progress of a stroke with guards; None of one that goes by the time alone."""
        self.controller: Controller = StrokeFollower(self._hand, stroke, self._frame)
        """Leads the blade in each frame."""
        if self.progress is not None:
            there = (self._link, self._bridge)
            self.controller = GuardedFollower(
                self._hand, stroke, self._frame, *there, self.progress
            )

    @property
    def duration(self) -> float:
        """Simulated time at which the stroke ends, at the latest [s]."""
        stroke, progress = self._stroke, self.progress
        if progress is None:
            return stroke.duration
        if progress.mode == ENDED:
            return progress.since
        ways = LONGEST_WAY * (len(stroke.guards) - 1)
        return stroke.duration + ways + sum(guard.longest_delay for guard in stroke.guards)

    @property
    def columns(self) -> ColumnGroup:
        """The clock of strokes with guards; else none: the first columns of a row are its own."""
        if self.progress is None:
            return ColumnGroup({}, _no_numbers)
        return ColumnGroup({STROKE_TIME: (f"{STROKE_TIME}_s",)}, self._clock)

    def _clock(self, frame: FrameData) -> tuple[float, ...]:
        return (frame.time if self.progress is None else self.progress.at,)

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        if self.progress is not None:
            self.progress.force = float(np.linalg.norm(self.wrench.force))
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
