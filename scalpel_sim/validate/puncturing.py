"""The strokes of a puncture: a level edge that goes into the block from above, and out again."""

import numpy as np

from scalpel_sim.validate.block import DT, LENGTH, MIDDLE, THICKNESS, edge
from tissue import BladeSegment, FloatArray

_ABOVE = 0.5e-3
"""How far above the block the edge begins [m]."""


def into(
    length: float,
    deep: float,
    speed: float,
    *,
    middle: tuple[float, float] = (MIDDLE, 0.5 * LENGTH),
    top: float = THICKNESS,
) -> list[BladeSegment]:
    """Return the places of an edge that goes down.

    Args:
        length: Of the edge, along y [m].
        deep: How far below the top it goes [m].
        speed: [m/s].
        middle: Where the middle of the edge is, across and along [m].
        top: Of the body [m].
    """
    n = round((deep + _ABOVE) / speed / DT)
    heights: FloatArray = top + _ABOVE - np.linspace(0.0, deep + _ABOVE, n + 1)
    x, y = middle[0], middle[1] - 0.5 * length
    return [
        edge((x, y, z), along=(0.0, 1.0, 0.0), forward=(0.0, 0.0, -1.0), length=length)
        for z in heights
    ]


def in_and_out(length: float, deep: float, speed: float) -> list[BladeSegment]:
    """Return the places of an edge that goes down, and back up the same way."""
    down = into(length, deep, speed)
    return down + down[-2::-1]
