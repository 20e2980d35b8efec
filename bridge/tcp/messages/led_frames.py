"""The messages about frames: how one holds tissue, and what the tissue does to them."""

import math
import struct
from collections.abc import Sequence
from typing import Annotated, TypeVar

import msgspec

from bridge.driven import FrameAttachment, FrameLoad, FrameTie
from bridge.tcp.wire import LARGEST_REPLY, MessageError
from tissue import LARGEST_COORDINATE, LARGEST_STRENGTH, Wrench

MAX_FRAMES = 1 << 12
"""Largest number of frames: a thousand times that of two hands and what holds an organ."""

_LOAD = struct.Struct("<q9d")
LOAD_BYTES = _LOAD.size
"""Length of the load on one frame [byte]."""

_NUMBER = struct.Struct("<q")

_Request = TypeVar("_Request")

_Where = str | list[int] | list[list[float]]
_Node = Annotated[int, msgspec.Meta(ge=0, le=LARGEST_REPLY)]
_Coordinate = Annotated[float, msgspec.Meta(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE)]
_Place = tuple[_Coordinate, _Coordinate, _Coordinate]
_Strength = Annotated[float, msgspec.Meta(ge=-LARGEST_STRENGTH, le=LARGEST_STRENGTH)]
_Places = Annotated[list[_Place], msgspec.Meta(min_length=1)]


class _Held(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """What a frame holds; one of region, nodes and points says it."""

    stiffness: _Strength
    damping: _Strength = 0.0
    breaks_at: float | None = None
    region: Annotated[str, msgspec.Meta(min_length=1)] | None = None
    nodes: Annotated[list[_Node], msgspec.Meta(min_length=1)] | None = None
    points: _Places | None = None

    @property
    def where(self) -> _Where:
        """Return what `FrameAttachment.where` takes.

        Raises:
            MessageError: none of them says it, or several.
        """
        given = [each for each in (self.region, self.nodes, self.points) if each is not None]
        if len(given) != 1:
            raise MessageError(
                "a frame holds either a region, or nodes, or points; give one of them"
            )
        return self.region or self.nodes or [list(point) for point in self.points or ()]

    @property
    def limit(self) -> float:
        """The force at which it lets go [N]."""
        return math.inf if self.breaks_at is None else self.breaks_at


class _FrameHold(_Held, forbid_unknown_fields=True, kw_only=True):
    """A request to attach a frame."""

    origin: _Place | None = None


class _FrameTie(_Held, forbid_unknown_fields=True, kw_only=True):
    """A request to tie a frame by strands."""

    to: _Places
    area: _Coordinate
    toughness: _Strength
    rest_length: _Coordinate | None = None


_hold_decoder = msgspec.json.Decoder(_FrameHold)
_tie_decoder = msgspec.json.Decoder(_FrameTie)


def pack_attachment(hold: FrameAttachment) -> bytes:
    """Return the request to attach a frame, JSON."""
    return _packed(hold.where, hold.breaks_at, hold)


def unpack_attachment(payload: bytes) -> FrameAttachment:
    """Return what a request to attach a frame asks for.

    Raises:
        MessageError: it cannot be read, or says in no way or several what is held.
    """
    found = _decoded(_hold_decoder, payload, "attach")
    return FrameAttachment(found.where, found.stiffness, found.damping, found.limit, found.origin)


def pack_tie(tie: FrameTie) -> bytes:
    """Return the request to tie a frame by strands, JSON."""
    return _packed(tie.where, tie.breaks_at, tie)


def unpack_tie(payload: bytes) -> FrameTie:
    """Return what a request to tie a frame asks for.

    Raises:
        MessageError: see `unpack_attachment`.
    """
    found = _decoded(_tie_decoder, payload, "tie")
    return FrameTie(
        found.where,
        [list(place) for place in found.to],
        found.stiffness,
        found.area,
        found.toughness,
        found.damping,
        found.rest_length,
        found.limit,
    )


def _packed(where: _Where, breaks_at: float, asked: FrameAttachment | FrameTie) -> bytes:
    """Return a request, with what is held under the name of its kind."""
    found: dict[str, object] = asked._asdict()
    del found["where"]
    found["breaks_at"] = breaks_at if math.isfinite(breaks_at) else None
    if isinstance(where, str):
        kind = "region"
    else:
        kind = "points" if where and isinstance(where[0], list) else "nodes"
    return msgspec.json.encode(found | {kind: where})


def _decoded(decoder: msgspec.json.Decoder[_Request], payload: bytes, what: str) -> _Request:
    """Return a request.

    Raises:
        MessageError: it cannot be read.
    """
    try:
        return decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(f"the request to {what} a frame cannot be read: {error}") from error


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
