"""Checks of arrays that a user gives; each error names the array."""

import numpy as np

from tissue import BoolArray, FloatArray

ROTATION_TOLERANCE = 1e-9
"""Largest difference between R^T R and the identity. MuJoCo's matrices are accurate to 1e-15, and a
quaternion typed with ten digits to 1e-10; at 1e-6 the length of the blade would differ between the
frames by more than an anchor moves in a step."""


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
    matrix = finite(value, (3, 3), what)
    error = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    if error > ROTATION_TOLERANCE:
        raise ValueError(
            f"{what} is not orthonormal: R^T R is {error:.1e} away from the identity "
            f"(at most {ROTATION_TOLERANCE:.0e}). Give it with more digits, or normalise it"
        )
    if np.linalg.det(matrix) < 0.0:
        raise ValueError(f"{what} is a reflection: its determinant is -1; wanted +1")
    return matrix


def are_rotations(axes: FloatArray, tolerance: float) -> BoolArray:
    """Return which of many matrices are rotations, shape (n,).

    Args:
        axes: The matrices, shape (n, 3, 3).
        tolerance: Largest difference between R^T R and the identity.
    """
    # Entries first: the squares of large ones are not finite.
    is_small = np.abs(axes).max(axis=(1, 2), initial=0.0) <= 1.0 + tolerance
    small = np.where(is_small[:, None, None], axes, 0.0)
    error = np.abs(small.transpose(0, 2, 1) @ small - np.eye(3)).max(axis=(1, 2), initial=0.0)
    found: BoolArray = is_small & (error <= tolerance) & (np.linalg.det(small) > 0.0)
    return found
