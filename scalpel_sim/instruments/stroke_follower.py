"""Leads a hand along a stroke, by one call of a kernel in each frame."""

import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.hand import Hand, lead_to
from scalpel_sim.quaternions import Vector
from scalpel_sim.strokes.path import pose_on_path
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray
from tissue.support import SameTypes, kernel


class StrokeFollower:
    """Does what `hand.follow(frame.segment_to_world(stroke.pose(t)))` does.

    Args:
        hand: Holds a blade already.
        stroke: The path of the blade, tissue frame.
        frame: Where the tissue lies in the world.
    """

    def __init__(self, hand: Hand, stroke: Stroke, frame: TissueFrame) -> None:
        self._path = stroke.path
        self._placement = np.vstack((frame.rotation, frame.origin))
        self._is_turned = frame.is_rotated
        self._command = hand.command
        self._lead = SameTypes(_lead)

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one."""
        self._lead.call(t, self._path, self._placement, self._is_turned, *self._command)


@kernel
def _lead(
    t: float,
    path: FloatArray,
    placement: FloatArray,
    is_turned: bool,
    position: FloatArray,
    quaternion: FloatArray,
    control: FloatArray,
    leads: FloatArray,
) -> None:
    """Lead a hand along a path.

    Args:
        t: Time [s].
        path: `Stroke.path`.
        placement: Axes of the tissue in the world as columns and, in a last row, its origin [m].
        is_turned: Whether these axes are others than those of the world.
        position: See `HandCommand`, as the rest.
        quaternion: Rotation of the hand.
        control: Offsets of the actuators.
        leads: Their factors.
    """
    tip, heel, forward = pose_on_path(t, path)
    if is_turned:
        tip, heel = _turned(tip, placement), _turned(heel, placement)
        forward = _turned(forward, placement)
    x, y, z = placement[3, 0], placement[3, 1], placement[3, 2]
    tip = (tip[0] + x, tip[1] + y, tip[2] + z)
    heel = (heel[0] + x, heel[1] + y, heel[2] + z)
    lead_to(tip, heel, forward, position, quaternion, control, leads)


@kernel
def _turned(vector: Vector, axes: FloatArray) -> Vector:
    """Return the sum of three axes, which are columns, times the numbers of a vector."""
    x, y, z = vector
    return (
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z,
        axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z,
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z,
    )
