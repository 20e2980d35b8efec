"""The messages about frames: how one holds tissue, and what the tissue does to them."""

import math
import struct
from collections.abc import Sequence
from typing import Annotated

import msgspec

from bridge.led_frames import FrameHold, FrameLoad
from bridge.tcp.wire import LARGEST_REPLY, MessageError
from tissue import Wrench

MAX_FRAMES = 1 << 12
"""Largest number of frames: a thousand times that of two hands and what holds an organ."""

_LOAD = struct.Struct("<q9d")
LOAD_BYTES = _LOAD.size
"""Length of the load on one frame [byte]."""

_NUMBER = struct.Struct("<q")

_Node = Annotated[int, msgspec.Meta(ge=0, le=LARGEST_REPLY)]
_Place = tuple[float, float, float]


class _FrameHold(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """A request to attach a frame; one of region, nodes and points says what it holds."""

    stiffness: float
    damping: float = 0.0
    breaks_at: float | None = None
    origin: _Place | None = None
    region: str | None = None
    nodes: Annotated[list[_Node], msgspec.Meta(min_length=1)] | None = None
    points: Annotated[list[_Place], msgspec.Meta(min_length=1)] | None = None


_decoder = msgspec.json.Decoder(_FrameHold)


def pack_hold(hold: FrameHold) -> bytes:
    """Return the request to attach a frame, JSON."""
    found: dict[str, object] = {
        "stiffness": hold.stiffness,
        "damping": hold.damping,
        "breaks_at": hold.breaks_at if math.isfinite(hold.breaks_at) else None,
        "origin": hold.origin,
    }
    where = hold.where
    if isinstance(where, str):
        kind = "region"
    else:
        kind = "points" if where and isinstance(where[0], list) else "nodes"
    return msgspec.json.encode(found | {kind: where})


def unpack_hold(payload: bytes) -> FrameHold:
    """Return what a request to attach a frame asks for.

    Raises:
        MessageError: it cannot be read, or says in no way or several what is held.
    """
    try:
        found = _decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(f"the request to attach a frame cannot be read: {error}") from error
    given = [each for each in (found.region, found.nodes, found.points) if each is not None]
    if len(given) != 1:
        raise MessageError("a frame holds either a region, or nodes, or points; give one of them")
    points = [list(point) for point in found.points or ()]
    where = found.region or found.nodes or points
    breaks_at = math.inf if found.breaks_at is None else found.breaks_at
    return FrameHold(where, found.stiffness, found.damping, breaks_at, found.origin)


def pack_loads(loads: Sequence[FrameLoad]) -> bytes:
    """Return the loads on frames: of each its number of points, force, torque and origin."""
    return b"".join(_LOAD.pack(load.n_points, *load.wrench.numbers) for load in loads)


def unpack_loads(payload: bytes | memoryview, n: int) -> list[FrameLoad]:
    """Return the loads on `n` frames.

    Physical quantities are passed on unchanged, NaN included.

    Raises:
        MessageError: the length is wrong, or a number of points is negative.
    """
    if len(payload) != n * _LOAD.size:
        raise MessageError(f"loads of {len(payload)} bytes on {n} frames of {_LOAD.size} each")
    loads = []
    for n_points, a, b, c, d, e, f, g, h, i in _LOAD.iter_unpack(payload):
        if n_points < 0:
            raise MessageError(f"a frame holds {n_points} points; wanted 0 or more")
        loads.append(FrameLoad(Wrench.of_numbers((a, b, c, d, e, f, g, h, i)), n_points))
    return loads


def unpack_all_loads(payload: bytes) -> list[FrameLoad]:
    """Return the loads on as many frames as there are in a reply.

    Raises:
        MessageError: see `unpack_loads`.
    """
    return unpack_loads(payload, len(payload) // LOAD_BYTES)


def pack_number(number: int) -> bytes:
    """Return the number of a frame."""
    return _NUMBER.pack(number)


def unpack_number(payload: bytes, n: int) -> int:
    """Return the number of one of `n` frames.

    Raises:
        MessageError: the length is wrong, or there is no such frame.
    """
    if len(payload) != _NUMBER.size:
        raise MessageError(f"the number of a frame in {len(payload)} bytes; wanted {_NUMBER.size}")
    number: int = _NUMBER.unpack(payload)[0]
    if not 0 <= number < n:
        raise MessageError(f"there is no frame {number}; there are {n}, counted from 0")
    return number
