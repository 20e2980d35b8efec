"""Rasterisation of triangles and line segments with a z-buffer."""

import math
from typing import NamedTuple

import numpy as np

from tissue import FloatArray, IntArray
from tissue.support import kernel

_FLAT = 1e-12
"""Twice the area [pixels squared] up to which a triangle is not drawn: it is seen edge-on."""


class Raster(NamedTuple):
    """The triangle that is visible at each pixel."""

    triangle: IntArray
    """Index of the nearest triangle at each pixel, or -1; shape (height, width)."""
    weights: FloatArray
    """Barycentric coordinates in the projected triangle (not in space), (height, width, 3)."""
    nearness: FloatArray
    """Nearness as of `View.project`, -inf where there is no triangle; shape (height, width)."""


def rasterise(corners: FloatArray, width: int, height: int) -> Raster:
    """Return the nearest triangle at the centre of each pixel; of equally near ones the first.

    Args:
        corners: Projected corners of triangles in front of the eye: x, y and nearness; shape
            (n_triangles, 3, 3).
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
    """
    raster = Raster(
        np.full((height, width), -1, dtype=np.int64),
        np.zeros((height, width, 3)),
        np.full((height, width), -np.inf),
    )
    _rasterise(np.ascontiguousarray(corners), *raster)
    return raster


@kernel
def _rasterise(
    corners: FloatArray, triangle: IntArray, weights: FloatArray, nearness: FloatArray
) -> None:
    height, width = triangle.shape
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
        bx, by, bz = corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2]
        cx, cy, cz = corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2]
        twice_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if not abs(twice_area) > _FLAT:
            continue
        x_low = max(0, math.ceil(min(ax, min(bx, cx)) - 0.5))
        x_high = min(width - 1, math.floor(max(ax, max(bx, cx)) - 0.5))
        y_low = max(0, math.ceil(min(ay, min(by, cy)) - 0.5))
        y_high = min(height - 1, math.floor(max(ay, max(by, cy)) - 0.5))
        for row in range(y_low, y_high + 1):
            y = row + 0.5
            for column in range(x_low, x_high + 1):
                x = column + 0.5
                wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / twice_area
                wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / twice_area
                wc = 1.0 - wa - wb
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                near = wa * az + wb * bz + wc * cz
                if near > nearness[row, column]:
                    nearness[row, column] = near
                    triangle[row, column] = t
                    weights[row, column, 0] = wa
                    weights[row, column, 1] = wb
                    weights[row, column, 2] = wc


@kernel
def draw_segments(
    ends: FloatArray,
    nearness: FloatArray,
    thickness: float,
    slack: float,
    visible: FloatArray,
    hidden: FloatArray,
) -> None:
    """Mark the pixels of line segments as visible or as hidden by a surface.

    Args:
        ends: Projected ends of the segments: x, y and nearness; shape (n, 2, 3).
        nearness: Nearness of the surfaces, shape (height, width).
        thickness: Thickness of the lines [pixels].
        slack: How much nearer a surface must be to hide a line, as a fraction: lines lie on it.
        visible: Set to 1 at visible pixels of a segment, shape (height, width).
        hidden: Set to 1 at hidden pixels of a segment, shape (height, width).
    """
    height, width = nearness.shape
    half = 0.5 * thickness
    for i in range(len(ends)):
        ax, ay, az = ends[i, 0, 0], ends[i, 0, 1], ends[i, 0, 2]
        dx, dy, dz = ends[i, 1, 0] - ax, ends[i, 1, 1] - ay, ends[i, 1, 2] - az
        squared = max(dx * dx + dy * dy, _FLAT)
        x_low = max(0, math.ceil(min(ax, ax + dx) - half - 0.5))
        x_high = min(width - 1, math.floor(max(ax, ax + dx) + half - 0.5))
        y_low = max(0, math.ceil(min(ay, ay + dy) - half - 0.5))
        y_high = min(height - 1, math.floor(max(ay, ay + dy) + half - 0.5))
        for row in range(y_low, y_high + 1):
            y = row + 0.5 - ay
            for column in range(x_low, x_high + 1):
                x = column + 0.5 - ax
                along = min(1.0, max(0.0, (x * dx + y * dy) / squared))
                off_x, off_y = x - along * dx, y - along * dy
                if off_x * off_x + off_y * off_y > half * half:
                    continue
                if az + along * dz >= nearness[row, column] * (1.0 - slack):
                    visible[row, column] = 1.0
                else:
                    hidden[row, column] = 1.0
