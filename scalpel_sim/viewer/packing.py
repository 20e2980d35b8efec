"""Values with arrays in them, as MessagePack: what a process writes, and another one reads."""

from typing import Any, TypeVar

import msgspec
import numpy as np

_Value = TypeVar("_Value")


def pack(value: Any) -> bytes:
    """Return a value as bytes: numbers, texts, named tuples of such, and arrays."""
    return _encoder.encode(value)


def unpack(content: bytes, kind: type[_Value]) -> _Value:
    """Return the value that was packed.

    Args:
        content: What `pack` returned.
        kind: Its type.

    Raises:
        msgspec.ValidationError: it was another value.
    """
    return msgspec.msgpack.decode(content, type=kind, dec_hook=array_of)


def _plain(value: Any) -> Any:
    """Return an array in a form that can be written: type, shape, and numbers."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, np.ascontiguousarray(value).data
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"what is packed holds a {type(value).__name__}")


def array_of(kind: type, plain: Any) -> np.ndarray:
    """Return the array that was written; a hook of msgspec."""
    dtype, shape, numbers = plain
    return np.frombuffer(numbers, dtype).reshape(shape)


_encoder = msgspec.msgpack.Encoder(enc_hook=_plain)
