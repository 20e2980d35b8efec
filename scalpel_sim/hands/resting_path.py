"""Leads a hand to one pose, which a person replaces."""

import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.hand import Hand
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.strokes.stroke import Stroke, poses_of_edges
from tissue import BladeSegment, FloatArray


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
