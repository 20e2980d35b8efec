"""Rotations: whether a matrix is one."""

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import BoolArray, FloatArray

ROTATION_TOLERANCE = 1e-6
"""Largest difference between R^T R and the identity for a rotation R: the accuracy of single
precision. Larger: bodies that are not rigid are taken for rigid; smaller: poses in single precision
are refused."""


def are_rotations(axes: FloatArray, tolerance: float = ROTATION_TOLERANCE) -> BoolArray:
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


def checked_rotation(
    value: npt.ArrayLike, what: str, tolerance: float = ROTATION_TOLERANCE
) -> FloatArray:
    """Return a copy of a rotation matrix as float64, shape (3, 3).

    Args:
        value: Its axes as columns.
        what: What it is, as the subject of an error.
        tolerance: Largest difference between R^T R and the identity.

    Raises:
        ValueError: it has another shape, is not finite, not orthonormal, or a reflection.
    """
    matrix = np.array(value, dtype=np.float64)
    if matrix.shape != (3, 3):
        raise ValueError(f"{what} has shape {matrix.shape}; it is three axes as columns, (3, 3)")
    if are_rotations(matrix[None], tolerance)[0]:
        return matrix
    if not np.isfinite(matrix).all():
        raise ValueError(f"{what} is not finite: {matrix.tolist()}")
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    if not error <= tolerance:
        raise ValueError(
            f"{what} is not orthonormal: R^T R is {error:.1e} away from the identity (at most "
            f"{tolerance:.0e}). Give its columns unit length and right angles, with all digits"
        )
    raise ValueError(
        f"{what} is a reflection: its determinant is -1. Turn one of its axes round, or take the "
        "axes in right-handed order"
    )
