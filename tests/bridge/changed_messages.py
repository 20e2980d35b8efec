"""Messages with one part replaced, whose bytes are still MessagePack."""

from typing import Any

import msgspec
import numpy as np


def raw(*numbers: float, dtype: str = "<f8") -> bytes:
    """Return numbers as an array travels."""
    return np.array(numbers, dtype).tobytes()


def changed(payload: bytes, **parts: Any) -> bytes:
    """Return a message in which parts are replaced: `a__b=value` replaces the field b of a.

    A number in place of a name is the place in a list.
    """
    content = msgspec.msgpack.decode(payload)
    for path, value in parts.items():
        *outer, last = path.split("__")
        part = content
        for name in outer:
            part = part[int(name) if name.isdigit() else name]
        part[last] = value
    return msgspec.msgpack.encode(content)


def with_number(payload: bytes, path: str, at: int, value: float) -> bytes:
    """Return a message in which one number of an array is replaced."""
    part: Any = msgspec.msgpack.decode(payload)
    for name in path.split("__"):
        part = part[name]
    numbers = np.frombuffer(part, "<f8").copy()
    numbers[at] = value
    return changed(payload, **{path: numbers.tobytes()})
