"""The messages about rigid geoms: which of them tissue touches, and what it does to them."""

import math
from collections.abc import Sequence
from typing import Annotated

import msgspec
import numpy as np

from bridge.driven import NO_GEOM_LOADS, GeomLoads, GeomPoses
from bridge.tcp.messages.poses import checked_poses
from bridge.tcp.wire import MessageError
from tissue import LARGEST_COORDINATE, FloatArray, Geom

MAX_GEOMS = 1 << 12
"""Largest number of geoms: a hundred times that of two arms."""

GEOM_LOAD_BYTES = 6 * 8
"""Length of the load on one geom [byte]."""

_VERTEX_BYTES = 3 * 8
_LONGEST_NAME = 200
"""Longest name of a geom [characters]: it is for reports and errors."""

_Size = Annotated[float, msgspec.Meta(gt=0.0, le=LARGEST_COORDINATE)]


class _Geom(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """A geom. The vertices of a mesh are raw little-endian float64, in base64."""

    name: Annotated[str, msgspec.Meta(max_length=_LONGEST_NAME)]
    shape: str
    size: tuple[_Size, ...] = ()
    friction: float = 0.0
    vertices: bytes | None = None
    origin: tuple[float, float, float]
    rotation: Annotated[list[float], msgspec.Meta(min_length=9, max_length=9)]


class _Geoms(msgspec.Struct, forbid_unknown_fields=True):
    """A request to let tissue touch geoms."""

    geoms: Annotated[list[_Geom], msgspec.Meta(max_length=MAX_GEOMS)]


_decoder = msgspec.json.Decoder(_Geoms)


def pack_geoms(geoms: Sequence[Geom], poses: GeomPoses) -> bytes:
    """Return the request to let tissue touch geoms, JSON."""
    rows = [
        _Geom(
            name=geom.name,
            shape=geom.shape,
            size=tuple(map(float, geom.size)),
            friction=float(geom.friction),
            vertices=None if geom.vertices is None else _packed(geom.vertices),
            origin=tuple(origin),
            rotation=rotation,
        )
        for geom, origin, rotation in zip(
            geoms, poses.origins.tolist(), poses.rotations.reshape(-1, 9).tolist(), strict=True
        )
    ]
    return msgspec.json.encode(_Geoms(rows))


def unpack_geoms(payload: bytes) -> tuple[list[Geom], GeomPoses]:
    """Return the geoms in a request, and where they are.

    Whether a shape has such sizes, and the tissue room for it, the tissue says.

    Raises:
        MessageError: it cannot be read, a number is not finite or out of range, or a rotation is
            none.
    """
    try:
        found = _decoder.decode(payload).geoms
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(f"the request to touch geoms cannot be read: {error}") from error
    rows = np.array([[*geom.origin, *geom.rotation] for geom in found]).reshape(-1, 12)
    return [_geom(geom) for geom in found], GeomPoses(*checked_poses(rows, 0))


def pack_geom_loads(loads: GeomLoads) -> bytes:
    """Return the loads on geoms: of each its force and its torque."""
    rows = np.empty((len(loads.forces), 6), "<f8")
    rows[:, :3], rows[:, 3:] = loads
    return rows.tobytes()


def unpack_geom_loads(payload: bytes, at: int, n: int) -> GeomLoads:
    """Return the loads on `n` geoms, which begin at byte `at`.

    Physical quantities are passed on unchanged, NaN included.
    """
    if n == 0:
        return NO_GEOM_LOADS
    rows = np.frombuffer(payload, "<f8", 6 * n, at).astype(np.float64).reshape(n, 6)
    return GeomLoads(rows[:, :3].copy(), rows[:, 3:].copy())


def _geom(found: _Geom) -> Geom:
    """Return a geom.

    Raises:
        MessageError: a number of it is not finite, or out of range.
    """
    what = f"the geom {found.name!r}"
    if not found.name.isprintable():
        raise MessageError(f"{what} has a control character in its name")
    if not math.isfinite(found.friction):
        raise MessageError(f"{what} has a friction of {found.friction}; it must be finite")
    vertices = None if found.vertices is None else _unpacked(found.vertices, what)
    return Geom(found.name, found.shape, found.size, found.friction, vertices)


def _packed(vertices: FloatArray) -> bytes:
    return np.ascontiguousarray(vertices, "<f8").tobytes()


def _unpacked(raw: bytes, what: str) -> FloatArray:
    """Return vertices [m], shape (n, 3)."""
    if len(raw) % _VERTEX_BYTES:
        raise MessageError(
            f"{what} has vertices in {len(raw)} bytes; wanted {_VERTEX_BYTES} for each"
        )
    vertices = np.frombuffer(raw, "<f8").astype(np.float64).reshape(-1, 3)
    if not (np.abs(vertices) <= LARGEST_COORDINATE).all():  # false for NaN
        raise MessageError(f"{what} has a vertex that is not within {LARGEST_COORDINATE:g} m")
    return vertices
