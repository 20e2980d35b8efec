"""The request for a quantity at the vertices of the surface, and its reply."""

import struct
from typing import get_args

import numpy as np

from bridge.tcp.wire import MessageError
from tissue import FloatArray, SurfaceQuantity

_QUANTITIES: tuple[SurfaceQuantity, ...] = get_args(SurfaceQuantity)
_COUNT = struct.Struct("<q")


def values_bytes(n_nodes: int) -> int:
    """Return the largest length of a reply [byte]: every node is a vertex."""
    return _COUNT.size + 8 * n_nodes


def pack_quantity(quantity: SurfaceQuantity) -> bytes:
    """Return a request: the name of the quantity."""
    return quantity.encode("ascii")


def unpack_quantity(payload: bytes) -> SurfaceQuantity:
    """Return the quantity that a request asks for.

    Raises:
        MessageError: there is none of that name.
    """
    for quantity in _QUANTITIES:
        if payload == quantity.encode("ascii"):
            return quantity
    raise MessageError(f"there is no quantity {payload[:16]!r}; there are {', '.join(_QUANTITIES)}")


def pack_values(values: FloatArray) -> bytes:
    """Return a reply: the number of vertices, and the value at each."""
    return _COUNT.pack(len(values)) + np.ascontiguousarray(values, "<f8").tobytes()


def unpack_values(payload: bytes) -> FloatArray:
    """Return the values in a reply, shape (n_vertices,).

    Raises:
        MessageError: the length is wrong, or a value is not finite.
    """
    if len(payload) < _COUNT.size:
        raise MessageError(f"values of {len(payload)} bytes; wanted {_COUNT.size} at least")
    (n,) = _COUNT.unpack_from(payload)
    if n < 0 or len(payload) != _COUNT.size + 8 * n:
        raise MessageError(f"{n} values do not fit {len(payload)} bytes")
    values = np.frombuffer(payload, "<f8", offset=_COUNT.size).astype(np.float64)
    if not np.isfinite(values).all():
        raise MessageError("a value at a vertex is not finite")
    return values
