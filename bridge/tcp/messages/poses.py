"""Poses of frames and geoms in a request: 12 numbers for each, checked together."""

import numpy as np

from bridge.tcp.wire import MessageError
from tissue import LARGEST_COORDINATE, FloatArray, are_rotations

POSE_BYTES = 12 * 8
"""Length of a pose [byte]: its origin, and the rows of its rotation."""


def pack_poses(origins: FloatArray, rotations: FloatArray) -> bytes:
    """Return poses, one after the other.

    Args:
        origins: Their origins [m], shape (n, 3).
        rotations: Their axes as columns, shape (n, 3, 3).
    """
    rows = np.empty((len(origins), 12), "<f8")
    rows[:, :3], rows[:, 3:] = origins, rotations.reshape(-1, 9)
    return rows.tobytes()


def checked_poses(rows: FloatArray, n_frames: int) -> tuple[FloatArray, FloatArray]:
    """Return origins [m], shape (n, 3), and rotations, shape (n, 3, 3), of poses. Copies.

    Args:
        rows: The numbers of each, shape (n, 12).
        n_frames: How many of them, the first ones, are of frames; the others are of geoms.

    Raises:
        MessageError: an origin is out of range, or a rotation is none.
    """
    origins, rotations = rows[:, :3].copy(), rows[:, 3:].reshape(-1, 3, 3).copy()
    is_near = (np.abs(origins) <= LARGEST_COORDINATE).all(axis=1)  # false for NaN
    if not is_near.all():
        i = int(np.argmin(is_near))
        raise MessageError(
            f"{_owner(i, n_frames)} is not within {LARGEST_COORDINATE:g} m: {origins[i].tolist()}"
        )
    are_axes = are_rotations(rotations)
    if not are_axes.all():
        i = int(np.argmin(are_axes))
        raise MessageError(
            f"the axes of {_owner(i, n_frames)} are no rotation: {rotations[i].tolist()}"
        )
    return origins, rotations


def _owner(i: int, n_frames: int) -> str:
    """Return what the pose in row `i` is of."""
    return f"frame {i}" if i < n_frames else f"geom {i - n_frames}"
