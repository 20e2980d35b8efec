"""Leads a hand along a stroke, by one call of a kernel in each frame."""

from typing import Protocol

import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.hand import HandCommand, lead_to
from scalpel_sim.quaternions import Vector
from scalpel_sim.strokes.path import pose_on_path
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray
from tissue.support import SameTypes, kernel

NO_SHIFT: Vector = (0.0, 0.0, 0.0)
"""The blade is led where the path has it."""


class Commanded(Protocol):
    """A hand, or what only shows where one is to be."""

    command: HandCommand


class StrokeFollower:
    """Does what `hand.follow(frame.segment_to_world(stroke.pose(t)))` does, or beside that pose.

    Args:
        hand: Holds a blade already, or shows where to lead one.
        stroke: The path of the blade, tissue frame.
        frame: Where the tissue lies in the world.
    """

    def __init__(self, hand: Commanded, stroke: Stroke, frame: TissueFrame) -> None:
        self._path = stroke.path
        self._placement = np.vstack((frame.rotation, frame.origin))
        self._command = hand.command
        self._lead = SameTypes(_lead)

    def lead(self, t: float, shift: Vector = NO_SHIFT) -> None:
        """Lead the blade to its pose at time `t` [s], a step after the last one.

        Args:
            t: The time.
            shift: Way from there on which it is led [m], tissue frame.
        """
        self._lead.call(t, shift, self._path, self._placement, *self._command)


@kernel
def _lead(
    t: float,
    shift: Vector,
    path: FloatArray,
    placement: FloatArray,
    position: FloatArray,
    quaternion: FloatArray,
    control: FloatArray,
    leads: FloatArray,
) -> None:
    """Lead a hand along a path.

    Args:
        t: Time [s].
        shift: Way beside the path [m], tissue frame.
        path: `Stroke.path`.
        placement: Axes of the tissue in the world as columns and, in a last row, its origin [m].
        position: See `HandCommand`, as the rest.
        quaternion: Rotation of the hand.
        control: Offsets of the actuators.
        leads: Their factors.
    """
    tip, heel, forward = pose_on_path(t, path)
    tip, heel = _moved(tip, shift), _moved(heel, shift)
    tip, heel = _turned(tip, placement), _turned(heel, placement)
    forward = _turned(forward, placement)
    origin = placement[3, 0], placement[3, 1], placement[3, 2]
    tip, heel = _moved(tip, origin), _moved(heel, origin)
    lead_to(tip, heel, forward, position, quaternion, control, leads)


@kernel
def _moved(point: Vector, way: Vector) -> Vector:
    """Return a point, moved by a way [m]."""
    return point[0] + way[0], point[1] + way[1], point[2] + way[2]


@kernel
def _turned(vector: Vector, axes: FloatArray) -> Vector:
    """Return the sum of three axes, which are columns, times the numbers of a vector."""
    x, y, z = vector
    return (
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z,
        axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z,
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z,
    )
