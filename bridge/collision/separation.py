"""A lower bound on the distance of two boxes, by their separating axes (Gottschalk et al. 1996)."""

import numpy as np

from bridge.collision.swept_box import SweptBox
from tissue import FloatArray

_NOT_PARALLEL = 1e-6
"""Least sine of the angle of two edges whose common normal is an axis. Edges that are more nearly
parallel have no such axis beyond rounding, and the axes of the faces separate their boxes."""


def gap_between(one: SweptBox, other: SweptBox) -> float:
    """Return the largest gap between two boxes along one of fifteen axes [m]; 0 without any.

    Boxes are at least as far apart as their projections onto a line. Zero means that they overlap.
    """
    return max(largest_gap(one, other)[0], 0.0)


def largest_gap(one: SweptBox, other: SweptBox) -> tuple[float, FloatArray]:
    """Return the largest gap, negative where two boxes overlap, and its axis from `one` to `other`.

    The axis is a unit vector, shape (3,).
    """
    edges = np.cross(one.axes.T[:, None], other.axes.T[None, :]).reshape(9, 3)
    lengths = np.sqrt(np.square(edges).sum(axis=1))
    has_axis = lengths > _NOT_PARALLEL
    axes = np.concatenate((one.axes.T, other.axes.T, edges[has_axis] / lengths[has_axis, None]))
    extents = np.abs(axes @ one.axes) @ one.size + np.abs(axes @ other.axes) @ other.size
    offsets = axes @ (other.centre - one.centre)
    gaps = np.abs(offsets) - 0.5 * extents
    i = int(np.argmax(gaps))
    return float(gaps[i]), axes[i] if offsets[i] >= 0.0 else -axes[i]
