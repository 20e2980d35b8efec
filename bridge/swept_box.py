"""Boxes that hold something during a whole step, so that nothing fast slips through between two."""

import math
from typing import NamedTuple

import numpy as np

from tissue.blade_shape import BladeShape
from tissue.types import BladeSegment, BladeSweep, FloatArray

TOUCHING_MARGIN = 1e-6
"""[m], added to every side of a box. Two boxes that only touch are apart for the collision library,
and a box without thickness has no inside. A micrometre is a million times the rounding of
coordinates of a metre, and a thousandth of the smallest tetrahedron that anyone cuts."""


class SweptBox(NamedTuple):
    """A box around something at the start and at the end of a step, and all between."""

    centre: FloatArray
    """[m], shape (3,)."""
    size: FloatArray
    """Whole lengths of its edges [m], shape (3,)."""
    axes: FloatArray
    """Unit vectors as columns, shape (3, 3)."""


def box_around(points: FloatArray, axes: FloatArray, margin: float = 0.0) -> SweptBox:
    """Return the box with these axes around points of shape (n, 3), larger by `margin` [m].

    A box is convex: it holds every point that moves from one of them to another on a straight line.
    """
    along = points @ axes
    low, high = along.min(axis=0), along.max(axis=0)
    return SweptBox(
        axes @ (0.5 * (low + high)), high - low + 2.0 * (margin + TOUCHING_MARGIN), axes
    )


def swept_blade(sweep: BladeSweep, shape: BladeShape | None = None) -> SweptBox:
    """Return the box aligned with the edge at t1 that holds the blade during the whole step.

    The ends of the edge move on straight lines, as in the tissue. The body behind the edge turns
    with it: its corners leave the chords of their arcs by less than their distance from the edge
    times the square of the angle, and none is ever farther than that distance from the edge.

    Args:
        sweep: Motion of the edge.
        shape: The body behind it; None for the edge alone.
    """
    axes = edge_axes(sweep.t1)
    ends = np.array((sweep.t0.tip, sweep.t0.heel, sweep.t1.tip, sweep.t1.heel))
    if shape is None:
        return box_around(ends, axes)
    axes_t0 = edge_axes(sweep.t0)
    half = 0.5 * shape.thickness
    section = np.array(((0.0, half), (0.0, -half), (-shape.height, half), (-shape.height, -half)))
    corners = np.concatenate(
        (
            (ends[:2, None] + section @ axes_t0[:, ::2].T).reshape(-1, 3),
            (ends[2:, None] + section @ axes[:, ::2].T).reshape(-1, 3),
        )
    )
    radius = math.hypot(shape.height, half)
    turn_squared = 0.5 * float(np.square(axes - axes_t0).sum())
    return box_around(corners, axes, radius * min(turn_squared, 1.0))


def edge_axes(segment: BladeSegment) -> FloatArray:
    """Return orthonormal axes as columns: forward, along the edge, across the blade."""
    # Plain floats: a tenth of the time of np.cross on single vectors.
    ex, ey, ez = (segment.tip - segment.heel).tolist()
    length = math.hypot(ex, ey, ez)
    ex, ey, ez = ex / length, ey / length, ez / length
    fx, fy, fz = segment.forward.tolist()
    nx, ny, nz = fy * ez - fz * ey, fz * ex - fx * ez, fx * ey - fy * ex
    length = math.hypot(nx, ny, nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    fx, fy, fz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
    return np.array(((fx, ex, nx), (fy, ey, ny), (fz, ez, nz)))
