"""Boxes around the whole motion of a body in a step, so that a fast one cannot tunnel through.

The gap between two boxes is a lower bound on their distance, by their separating axes (Gottschalk
et al. 1996).
"""

import math
from typing import NamedTuple

import numpy as np

from tissue import BladeSegment, BladeShape, BladeSweep, FloatArray

TOUCHING_MARGIN = 1e-6
"""Length added to every side of a box [m]. Two boxes that only touch are apart for the collision
library, and a box without thickness has no inside. A micrometre is far above the rounding of
coordinates of a metre, and far below the size of a tetrahedron that is cut."""

_NOT_PARALLEL = 1e-6
"""Least sine of the angle of two edges whose common normal is an axis. Edges that are more nearly
parallel have no such axis beyond rounding, and the axes of the faces separate their boxes."""


class SweptBox(NamedTuple):
    """A box around a body during a whole step."""

    centre: FloatArray
    """Centre of the box [m], shape (3,)."""
    size: FloatArray
    """Lengths of the edges [m], shape (3,)."""
    axes: FloatArray
    """Axes of the box: unit vectors as columns, shape (3, 3)."""


def box_around(points: FloatArray, axes: FloatArray, margin: float = 0.0) -> SweptBox:
    """Return the box with given axes around points of shape (n, 3), larger by `margin` [m].

    A box is convex: it holds every point that moves between two of them on a straight line.
    """
    along = points @ axes
    low, high = along.min(axis=0), along.max(axis=0)
    return SweptBox(
        axes @ (0.5 * (low + high)), high - low + 2.0 * (margin + TOUCHING_MARGIN), axes
    )


def swept_blade(sweep: BladeSweep, shape: BladeShape | None = None) -> SweptBox:
    """Return the box, aligned with the edge at t1, that holds the blade during the whole step.

    The ends of the edge move on straight lines, as in the tissue. The blade behind the edge also
    rotates, which displaces a point by at most its distance from the edge times the change of the
    axes; its distance from the edge stays the same.

    Args:
        sweep: Motion of the edge.
        shape: Shape of the blade behind the edge; None for the edge alone.
    """
    axes = edge_axes(sweep.t1)
    ends = np.array((sweep.t0.tip, sweep.t0.heel, sweep.t1.tip, sweep.t1.heel))
    edge = box_around(ends, axes)
    if shape is None:
        return edge
    change = axes - edge_axes(sweep.t0)
    reach = math.hypot(shape.height, 0.5 * shape.thickness)
    margin = reach * min(math.sqrt(float(np.square(change).sum())), 1.0)
    return SweptBox(
        edge.centre - 0.5 * shape.height * axes[:, 0],
        edge.size + (np.array((shape.height, 0.0, shape.thickness)) + 2.0 * margin),
        axes,
    )


def edge_axes(segment: BladeSegment) -> FloatArray:
    """Return orthonormal axes as columns: forward, along the edge, across the blade."""
    return np.array(axes_across(segment)).reshape(3, 3)


def axes_across(segment: BladeSegment) -> tuple[float, ...]:
    """Return the nine numbers of `edge_axes`, row by row."""
    # Plain floats: a tenth of the time of np.cross on single vectors.
    ex, ey, ez = (segment.tip - segment.heel).tolist()
    length = math.hypot(ex, ey, ez)
    ex, ey, ez = ex / length, ey / length, ez / length
    fx, fy, fz = segment.forward.tolist()
    nx, ny, nz = fy * ez - fz * ey, fz * ex - fx * ez, fx * ey - fy * ex
    length = math.hypot(nx, ny, nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    fx, fy, fz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
    return (fx, ex, nx, fy, ey, ny, fz, ez, nz)


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
