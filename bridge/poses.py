"""Poses of a blade: their check, the motion between two of them, and a pose moved by a motion.

With them the checks of other arrays that a user gives; each error names the array.
"""

import math
from typing import NamedTuple

import numpy as np

from bridge.arithmetic import (
    LARGEST_COSINE,
    SHORTEST_EDGE,
    UNIT_TOLERANCE,
    Axes,
    SegmentNumbers,
    Six,
    Three,
    arrival,
)
from tissue import BladeSegment, FloatArray, checked_rotation

FRAME_TOLERANCE = 1e-9
"""Largest difference between R^T R and the identity for a frame that stays. MuJoCo's matrices are
accurate to 1e-15, and a quaternion typed with ten digits to 1e-10; at 1e-6 the length of the blade
would differ between the frames by more than an anchor moves in a step."""

_ORIGIN: Three = (0.0, 0.0, 0.0)
_AXES: Axes = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def six(array: FloatArray) -> Six:
    """Return the numbers of an array of shape (6,)."""
    a, b, c, d, e, f = array.tolist()
    return a, b, c, d, e, f


class Pose(NamedTuple):
    """The pose of a blade, and what the bridge needs of it, found once."""

    segment: BladeSegment
    """The pose as arrays."""
    tip: Three
    """The tip [m]."""
    heel: Three
    """The heel [m]."""
    axes: Axes
    """Axes of the blade."""

    @property
    def length(self) -> float:
        """Length of the edge [m]."""
        return math.dist(self.tip, self.heel)


def pose_of_numbers(numbers: SegmentNumbers, axes: Axes) -> Pose:
    """Return the pose of a blade with these axes."""
    return Pose(BladeSegment.of_numbers(numbers), numbers[:3], numbers[3:6], axes)


def pose_of(segment: BladeSegment) -> Pose:
    """Return the pose of a segment that is known to have a plane."""
    _, numbers, axes, _ = arrival(segment.numbers, _ORIGIN, _ORIGIN, _AXES, 0.0)
    return Pose(segment, numbers[:3], numbers[3:6], axes)


def expect_plane(segment: BladeSegment, given: BladeSegment) -> None:
    """Refuse a pose that is not finite, or has no plane.

    Args:
        segment: The pose.
        given: The pose as the user of the bridge gave it, for the message.

    Raises:
        ValueError: the pose is not finite, or its edge and `forward` span no plane.
    """
    tx, ty, tz, hx, hy, hz, fx, fy, fz = segment.numbers
    length, forward_length = math.dist((tx, ty, tz), (hx, hy, hz)), math.hypot(fx, fy, fz)
    if not math.isfinite(length + forward_length):
        raise ValueError(f"the blade's pose is not finite: {given}")
    if length < SHORTEST_EDGE:
        raise ValueError(f"the cutting edge is {length} m long; at least {SHORTEST_EDGE} m")
    if abs(forward_length - 1.0) > UNIT_TOLERANCE:
        raise ValueError(f"forward must be a unit vector; its length is {forward_length}")
    cosine = abs((tx - hx) * fx + (ty - hy) * fy + (tz - hz) * fz) / length
    if cosine > LARGEST_COSINE:
        raise ValueError(
            f"forward must be across the edge; they are {math.degrees(math.acos(cosine)):.2g} "
            "degrees apart"
        )


def motion(before: BladeSegment, after: BladeSegment) -> FloatArray:
    """Return the translation of the tip [m] and the rotation vector [rad] of a blade, shape (6,).

    The rotation carries edge and flat of the first pose to those of the second, by less than half
    a turn.
    """
    one = pose_of(before)
    return np.array(arrival(after.numbers, _ORIGIN, one.tip, one.axes, 0.0)[3])


def moved(segment: BladeSegment, by: FloatArray) -> BladeSegment:
    """Return a pose moved `by` a translation of the tip [m] and a rotation about it [rad]."""
    tip = segment.tip + by[:3]
    angle = math.hypot(*by[3:].tolist())
    if angle == 0.0:
        return BladeSegment(tip, segment.heel + by[:3], segment.forward)
    rotation = _rotation(by[3:], angle)
    forward = rotation @ segment.forward
    return BladeSegment(
        tip,
        tip + rotation @ (segment.heel - segment.tip),
        forward / math.hypot(*forward.tolist()),
    )


def half_length(segment: BladeSegment) -> float:
    """Return half the length of the edge [m]."""
    return 0.5 * math.dist(segment.tip.tolist(), segment.heel.tolist())


def _rotation(vector: FloatArray, angle: float) -> FloatArray:
    """Return the matrix of a rotation vector with this angle [rad] (Rodrigues), shape (3, 3)."""
    x, y, z = (vector / angle).tolist()
    s, c = math.sin(angle), math.cos(angle)
    d = 1.0 - c
    return np.array(
        (
            (c + d * x * x, d * x * y - s * z, d * x * z + s * y),
            (d * x * y + s * z, c + d * y * y, d * y * z - s * x),
            (d * x * z - s * y, d * y * z + s * x, c + d * z * z),
        )
    )


def finite(value: FloatArray, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Return a copy of `value` as float64.

    Raises:
        ValueError: its shape differs (None: any length), or a number is not finite.
    """
    array = np.array(value, np.float64)
    fits = len(array.shape) == len(shape) and all(
        wanted in (None, found) for wanted, found in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted_shape = tuple("n" if wanted is None else wanted for wanted in shape)
        raise ValueError(f"{what} has shape {array.shape}; wanted {wanted_shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{what} is not finite")
    return array


def rotation(value: FloatArray, what: str) -> FloatArray:
    """Return a copy of a rotation matrix as float64.

    Raises:
        ValueError: it is not finite, not orthonormal, or a reflection.
    """
    return checked_rotation(value, what, FRAME_TOLERANCE)
