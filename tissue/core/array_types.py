"""Types of arrays, by what they hold."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
SlotArray = npt.NDArray[np.int32]
"""Indices in 32 bits, which the inner loops read: half the bytes."""
BoolArray = npt.NDArray[np.bool_]
