"""The request of a step: its length, the motion of the blade, and where frames are led."""

import math
import struct
from collections.abc import Sequence

import numpy as np

from bridge.led_frames import FramePose
from bridge.tcp.wire import MessageError
from tissue import BladeSegment, BladeSweep

LARGEST_COORDINATE = 1e3
"""Largest coordinate [m]. No body is larger; a blade farther away means an invalid message."""
_LONGEST_STEP = 1.0
"""Longest step [s]. A frame is a millisecond; a step of hours would take days to compute."""
_UNIT_TOLERANCE = 1e-6
"""Largest difference of the length of `forward` from 1: the accuracy of single precision."""

_LARGEST_SKEW = 1e-6
"""Largest difference of R^T R from the identity for a rotation R: the same accuracy."""

_TIME = struct.Struct("<d")
_BLADE = struct.Struct("<18d")
_POSE = struct.Struct("<12d")


def pack_step(sweep: BladeSweep | None, dt: float, poses: Sequence[FramePose] = ()) -> bytes:
    """Return a request: `dt`; with a blade near, its pose at t0 and at t1; the poses of frames.

    A pose of the blade is tip, heel, forward; that of a frame its origin, and the rows of its
    rotation.
    """
    parts = [_TIME.pack(dt)]
    if sweep is not None:
        parts.append(_BLADE.pack(*np.concatenate((*sweep.t0, *sweep.t1)).tolist()))
    parts += [_POSE.pack(*pose.origin, *np.ravel(pose.rotation)) for pose in poses]
    return b"".join(parts)


def unpack_step(
    payload: bytes, n_led: int = 0
) -> tuple[BladeSweep | None, float, Sequence[FramePose]]:
    """Return the sweep, `dt` and the poses of `n_led` frames in a request.

    Raises:
        MessageError: a number is missing, not finite, or out of range.
    """
    has_blade = len(payload) == _TIME.size + _BLADE.size + n_led * _POSE.size
    if not has_blade and len(payload) != _TIME.size + n_led * _POSE.size:
        raise MessageError(
            f"a step request of {len(payload)} bytes; wanted {_TIME.size}, or with a blade "
            f"{_TIME.size + _BLADE.size}, and {_POSE.size} for each of {n_led} frames that are led"
        )
    (dt,), at = _TIME.unpack_from(payload), _TIME.size
    sweep = None
    if has_blade:
        numbers = _BLADE.unpack_from(payload, at)
        at += _BLADE.size
        _check_segment(numbers[:9])
        _check_segment(numbers[9:])
        rows = np.array(numbers).reshape(6, 3)
        sweep = BladeSweep(BladeSegment(*rows[:3]), BladeSegment(*rows[3:]))
    poses = [_pose(_POSE.unpack_from(payload, at + i * _POSE.size)) for i in range(n_led)]
    return sweep, _checked_step(dt), poses


def _pose(numbers: tuple[float, ...]) -> FramePose:
    """Return the pose of a frame."""
    for x in numbers[:3]:  # the comparisons are false for NaN
        if not -LARGEST_COORDINATE <= x <= LARGEST_COORDINATE:
            raise MessageError(f"a frame is not within {LARGEST_COORDINATE:g} m: {numbers[:3]}")
    rotation = np.array(numbers[3:]).reshape(3, 3)
    # Entries first: the squares of large ones are not finite.
    is_small = np.abs(rotation).max() <= 1.0 + _LARGEST_SKEW
    if not (is_small and np.abs(rotation.T @ rotation - np.eye(3)).max() <= _LARGEST_SKEW):
        raise MessageError(f"the axes of a frame are no rotation: {numbers[3:]}")
    return FramePose(np.array(numbers[:3]), rotation)


def _check_segment(numbers: tuple[float, ...]) -> None:
    # The comparisons are false for NaN. Plain floats take a tenth of the time of array calls.
    for x in numbers[:6]:
        if not -LARGEST_COORDINATE <= x <= LARGEST_COORDINATE:
            raise MessageError(f"the blade is not within {LARGEST_COORDINATE:g} m: {numbers[:6]}")
    if not abs(math.hypot(*numbers[6:]) - 1.0) <= _UNIT_TOLERANCE:
        raise MessageError(f"forward is not a unit vector: {numbers[6:]}")


def _checked_step(dt: float) -> float:
    if not 0.0 < dt <= _LONGEST_STEP:
        raise MessageError(f"a step of {dt} s; wanted more than 0 and at most {_LONGEST_STEP:g}")
    return dt
