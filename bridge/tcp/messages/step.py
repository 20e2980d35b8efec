"""The request of a step: its length, the motion of the blade, where frames and geoms are led."""

import math
import struct
from collections.abc import Sequence

import numpy as np

from bridge.driven import NO_GEOMS, FramePose, GeomPoses
from bridge.tcp.messages.poses import POSE_BYTES, checked_poses, pack_poses
from bridge.tcp.wire import MessageError
from tissue import LARGEST_COORDINATE, BladeSegment, BladeSweep

_SHORTEST_STEP, _LONGEST_STEP = 1e-9, 1.0
"""Shortest and longest step [s]. A frame is a millisecond. A step of hours would take days, and in
one of 1e-310 s speeds are infinite."""
_UNIT_TOLERANCE = 1e-6
"""Largest difference of the length of `forward` from 1: the accuracy of single precision."""

_TIME = struct.Struct("<d")
_BLADE = struct.Struct("<18d")


def pack_step(
    sweep: BladeSweep | None,
    dt: float,
    poses: Sequence[FramePose] = (),
    geoms: GeomPoses = NO_GEOMS,
) -> bytes:
    """Return a request: `dt`; with a blade near, its pose at t0 and at t1; the poses of frames.

    Behind them come those of geoms. A pose of the blade is tip, heel, forward; that of a frame or
    a geom its origin, and the rows of its rotation.
    """
    parts = [_TIME.pack(dt)]
    if sweep is not None:
        parts.append(_BLADE.pack(*np.concatenate((*sweep.t0, *sweep.t1)).tolist()))
    if poses:
        origins, rotations = zip(*poses, strict=True)
        parts.append(pack_poses(np.array(origins), np.array(rotations)))
    if len(geoms.origins):
        parts.append(pack_poses(*geoms))
    return b"".join(parts)


def unpack_step(
    payload: bytes, n_driven: int = 0, n_geoms: int = 0
) -> tuple[BladeSweep | None, float, Sequence[FramePose], GeomPoses]:
    """Return the sweep, `dt`, and the poses of `n_driven` frames and `n_geoms` geoms in a request.

    Raises:
        MessageError: a number is missing, not finite, or out of range.
    """
    of_poses = (n_driven + n_geoms) * POSE_BYTES
    has_blade = len(payload) == _TIME.size + _BLADE.size + of_poses
    if not has_blade and len(payload) != _TIME.size + of_poses:
        raise MessageError(
            f"a step request of {len(payload)} bytes; wanted {_TIME.size}, or with a blade "
            f"{_TIME.size + _BLADE.size}, and {POSE_BYTES} for each of {n_driven} frames and "
            f"{n_geoms} geoms that are led"
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
    frames: list[FramePose] = []
    geoms = NO_GEOMS
    if of_poses:
        rows = np.frombuffer(payload, "<f8", offset=at).astype(np.float64).reshape(-1, 12)
        origins, rotations = checked_poses(rows, n_driven)
        of_frames = zip(origins[:n_driven], rotations[:n_driven], strict=True)
        frames = [FramePose(*pose) for pose in of_frames]
        geoms = GeomPoses(origins[n_driven:], rotations[n_driven:])
    return sweep, _checked_step(dt), frames, geoms


def _check_segment(numbers: tuple[float, ...]) -> None:
    # The comparisons are false for NaN. Plain floats take a tenth of the time of array calls.
    for x in numbers[:6]:
        if not -LARGEST_COORDINATE <= x <= LARGEST_COORDINATE:
            raise MessageError(f"the blade is not within {LARGEST_COORDINATE:g} m: {numbers[:6]}")
    if not abs(math.hypot(*numbers[6:]) - 1.0) <= _UNIT_TOLERANCE:
        raise MessageError(f"forward is not a unit vector: {numbers[6:]}")


def _checked_step(dt: float) -> float:
    if not _SHORTEST_STEP <= dt <= _LONGEST_STEP:
        raise MessageError(f"a step of {dt} s; wanted {_SHORTEST_STEP:g} to {_LONGEST_STEP:g}")
    return dt
