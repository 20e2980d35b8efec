"""Checks of arrays that a user gives; each error names the array."""

import numpy as np

from tissue import FloatArray, checked_rotation

FRAME_TOLERANCE = 1e-9
"""Largest difference between R^T R and the identity for a frame that stays. MuJoCo's matrices are
accurate to 1e-15, and a quaternion typed with ten digits to 1e-10; at 1e-6 the length of the blade
would differ between the frames by more than an anchor moves in a step."""


def finite(value: FloatArray, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Return a copy of `value` as float64.

    Raises:
        ValueError: its shape differs (None: any length), or a number is not finite.
    """
    array = np.array(value, np.float64)
    fits = len(array.shape) == len(shape) and all(
        wanted in (None, found) for wanted, found in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted_shape = tuple("n" if wanted is None else wanted for wanted in shape)
        raise ValueError(f"{what} has shape {array.shape}; wanted {wanted_shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{what} is not finite")
    return array


def rotation(value: FloatArray, what: str) -> FloatArray:
    """Return a copy of a rotation matrix as float64.

    Raises:
        ValueError: it is not finite, not orthonormal, or a reflection.
    """
    return checked_rotation(value, what, FRAME_TOLERANCE)
