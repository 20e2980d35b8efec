"""Lines on the skin of a body: straight between their points, seen along a direction."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.drawn import SAME_POINT
from scalpel_sim.strokes.skin import BodySkin
from tissue import FloatArray

LINE_SPACING = 2.5e-4
"""Longest distance between two places of the line that are looked up on the skin [m]: over 0.25 mm
a skin that bends with a radius of 10 mm leaves a chord by 1 um."""

STEEPEST_SKIN = math.radians(75.0)
"""Largest angle between the skin and the plane across the depth [rad]: a steeper skin falls off
beside the line, or the line goes from one fold to another."""

SHARPEST_BEND = math.radians(20.0)
"""Turn of the line at a point from which the blade rests there and turns [rad]; else it passes."""


class SkinLine(NamedTuple):
    """Places on the skin."""

    at_rest: FloatArray
    """Where they are in the body at rest [m], shape (n, 3)."""
    lying: FloatArray
    """Where they are in the body as it lies [m], shape (n, 3)."""

    def joined_to(self, other: "SkinLine") -> "SkinLine":
        """Return the line that goes on with another, which begins at its end."""
        return SkinLine(
            *(np.vstack([mine, its[1:]]) for mine, its in zip(self, other, strict=True))
        )


def lines_on_skin(points: FloatArray, skin: BodySkin, edge: FloatArray) -> list[SkinLine]:
    """Return the line on the skin, parted at its corners.

    Args:
        points: Points near the skin, at rest [m], shape (n_points, 3).
        skin: The skin.
        edge: Unit vector against the depth, shape (3,).
    """
    lines: list[SkinLine] = []
    before: FloatArray | None = None
    for i, (start, end) in enumerate(pairwise(points)):
        way = end - start - float((end - start) @ edge) * edge
        length = float(np.linalg.norm(way))
        if length <= SAME_POINT:
            raise StrokeError(
                f"points {i + 1} and {i + 2} of the traced stroke are one place, seen along the "
                "edge; leave one out"
            )
        line = _straight_line(np.stack([start, end]), skin, edge, i + 1, length)
        if before is not None and float(before @ way) >= math.cos(SHARPEST_BEND) * length:
            lines[-1] = lines[-1].joined_to(line)
        else:
            lines.append(line)
        before = way / length
    return lines


def _straight_line(
    ends: FloatArray, skin: BodySkin, edge: FloatArray, number: int, length: float
) -> SkinLine:
    """Return the line between two points on the skin.

    Args:
        ends: The points, at rest [m], shape (2, 3).
        skin: The skin.
        edge: Unit vector against the depth.
        number: Number of the first of them, from 1.
        length: Their distance, seen along the edge [m].
    """
    n = math.ceil(length / LINE_SPACING)
    at_rest, lying = np.empty((n + 1, 3)), np.empty((n + 1, 3))
    for k, share in enumerate(np.linspace(0.0, 1.0, n + 1)):
        near = ends[0] + share * (ends[1] - ends[0])
        place = skin.entered_at(near, -edge)
        if place is None:
            what = f"point {number + (k == n)}"
            if 0 < k < n:
                what = f"the line from point {number} to point {number + 1}"
            raise StrokeError(
                f"{what} of the traced stroke misses the body at {_millimetres(near)} mm: along "
                f"the edge, {_direction(edge)}, no skin is over or under it. {_box_of(skin)}; move "
                "the point, or give another edge"
            )
        at_rest[k], lying[k] = skin.rest_place(place), skin.lying_place(place)
    steps = np.abs(np.diff(at_rest @ edge))
    if (steps > math.tan(STEEPEST_SKIN) * length / n).any():
        at = at_rest[int(np.argmax(steps))]
        raise StrokeError(
            f"between points {number} and {number + 1} of the traced stroke, at "
            f"{_millimetres(at)} mm, the skin is steeper than "
            f"{math.degrees(STEEPEST_SKIN):.0f} degrees to the edge, {_direction(edge)}: the depth "
            "there means nothing. Give an edge that stands on the skin, or keep the line away from "
            "the rim"
        )
    return SkinLine(at_rest, lying)


def _millimetres(point: FloatArray) -> str:
    """Return a point in millimetres, for a message."""
    return "(" + ", ".join(f"{1e3 * value:.1f}" for value in point) + ")"


def _direction(vector: FloatArray) -> str:
    """Return a direction as a row of a scene has it."""
    return "[" + ", ".join(f"{value:.3g}" for value in vector) + "]"


def _box_of(skin: BodySkin) -> str:
    """Return where the body is, for a message."""
    corners = skin.at_rest.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return f"The body at rest fills {_millimetres(low)} to {_millimetres(high)} mm (x, y, z)"
