"""Types of arrays, by what they hold."""

from typing import Any, get_args

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
SlotArray = npt.NDArray[np.int32]
"""Indices in 32 bits, which the inner loops read: half the bytes."""
BoolArray = npt.NDArray[np.bool_]


def dtype_of(array_type: Any) -> Any:
    """Return the type of the elements of a type of arrays, such as np.float64 of `FloatArray`.

    From NumPy 2.5 on the type is an alias, whose argument is that of the elements; before, an
    `ndarray` of a shape and a `dtype`, which has it.
    """
    last = get_args(array_type)[-1]
    return get_args(last)[0] if get_args(last) else last
