"""The request of every frame: where the blade went, and for how long the tissue shall live."""

import math
import struct

import numpy as np

from bridge.tcp.wire import MessageError
from tissue import BladeSegment, BladeSweep

LARGEST_COORDINATE = 1e3
"""[m]. No body is larger; a blade farther away is a broken message."""
_LONGEST_STEP = 1.0
"""[s]. A frame is a millisecond; a step of hours would keep the tissue busy for days."""
_UNIT_TOLERANCE = 1e-6
"""How far the length of `forward` may be from 1: what single precision leaves."""

_NO_BLADE = struct.Struct("<d")
_BLADE = struct.Struct("<19d")


def pack_step(sweep: BladeSweep | None, dt: float) -> bytes:
    """Return a request: `dt`, and unless no blade is near: tip, heel, forward at t0 and at t1."""
    if sweep is None:
        return _NO_BLADE.pack(dt)
    return _BLADE.pack(dt, *np.concatenate((*sweep.t0, *sweep.t1)).tolist())


def unpack_step(payload: bytes) -> tuple[BladeSweep | None, float]:
    """Return the sweep and `dt` of a request.

    Raises:
        MessageError: a number is missing, not finite, or nothing that a blade can do.
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
    # NaN is neither within limits nor near 1. Plain floats: a tenth of the time of array calls.
    for x in numbers[:6]:
        if not -LARGEST_COORDINATE <= x <= LARGEST_COORDINATE:
            raise MessageError(f"the blade is not within {LARGEST_COORDINATE:g} m: {numbers[:6]}")
    if not abs(math.hypot(*numbers[6:]) - 1.0) <= _UNIT_TOLERANCE:
        raise MessageError(f"forward is not a unit vector: {numbers[6:]}")


def _checked_step(dt: float) -> float:
    if not 0.0 < dt <= _LONGEST_STEP:
        raise MessageError(f"a step of {dt} s; wanted more than 0 and at most {_LONGEST_STEP:g}")
    return dt
