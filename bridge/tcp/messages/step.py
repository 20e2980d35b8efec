"""The request of a frame: the motion of the blade, and the time to advance the tissue by."""

import math
import struct

import numpy as np

from bridge.tcp.wire import MessageError
from tissue import BladeSegment, BladeSweep

LARGEST_COORDINATE = 1e3
"""Largest coordinate [m]. No body is larger; a blade farther away means an invalid message."""
_LONGEST_STEP = 1.0
"""Longest step [s]. A frame is a millisecond; a step of hours would take days to compute."""
_UNIT_TOLERANCE = 1e-6
"""Largest difference of the length of `forward` from 1: the accuracy of single precision."""

_NO_BLADE = struct.Struct("<d")
_BLADE = struct.Struct("<19d")


def pack_step(sweep: BladeSweep | None, dt: float) -> bytes:
    """Return a request: `dt`, and with a blade near: tip, heel, forward at t0 and at t1."""
    if sweep is None:
        return _NO_BLADE.pack(dt)
    return _BLADE.pack(dt, *np.concatenate((*sweep.t0, *sweep.t1)).tolist())


def unpack_step(payload: bytes) -> tuple[BladeSweep | None, float]:
    """Return the sweep and `dt` of a request.

    Raises:
        MessageError: a number is missing, not finite, or out of range.
    """
    if len(payload) == _NO_BLADE.size:
        return None, _checked_step(_NO_BLADE.unpack(payload)[0])
    if len(payload) != _BLADE.size:
        raise MessageError(
            f"a step request of {len(payload)} bytes; wanted {_NO_BLADE.size} or {_BLADE.size}"
        )
    dt, *numbers = _BLADE.unpack(payload)
    _check_segment(numbers[:9])
    _check_segment(numbers[9:])
    rows = np.array(numbers).reshape(6, 3)
    return BladeSweep(BladeSegment(*rows[:3]), BladeSegment(*rows[3:])), _checked_step(dt)


def _check_segment(numbers: list[float]) -> None:
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
