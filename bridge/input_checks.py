"""Arrays that a user gives: refused by name, before anything is built on them."""

import numpy as np

from tissue import FloatArray

ROTATION_TOLERANCE = 1e-9
"""How far R^T R may be from the identity. MuJoCo's matrices are good to 1e-15, and a quaternion
typed with ten digits to 1e-10; at 1e-6 the blade would be longer in one frame than in the other
by more than an anchor moves in a step."""


def finite(value: FloatArray, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Return a copy of `value` as float64.

    Raises:
        ValueError: its shape is another (None: any length), or a number is not finite.
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
        ValueError: it is not finite, not orthonormal, or it mirrors.
    """
    matrix = finite(value, (3, 3), what)
    error = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    if error > ROTATION_TOLERANCE:
        raise ValueError(
            f"{what} is not orthonormal: R^T R is {error:.1e} away from the identity "
            f"({ROTATION_TOLERANCE:.0e} is allowed). Give it with more digits, or normalise it"
        )
    if np.linalg.det(matrix) < 0.0:
        raise ValueError(f"{what} mirrors: its determinant is -1; wanted +1")
    return matrix
