"""Values as bits, for comparisons that must be exact."""

import struct
from typing import Any

import numpy as np


def bits(value: Any) -> Any:
    """Return the bits of a value, with the sign of a zero and the payload of a NaN."""
    if isinstance(value, tuple):
        return tuple(bits(part) for part in value)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    return struct.pack("<d", value) if isinstance(value, float) else value
