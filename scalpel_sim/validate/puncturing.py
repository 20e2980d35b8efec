"""The strokes of a puncture: a level edge enters the block from above, and is withdrawn."""

import numpy as np

from scalpel_sim.validate.block import CUT_X, DT, LENGTH, THICKNESS, edge_at
from tissue import BladeSegment, FloatArray

_ABOVE = 0.5e-3
"""Height of the edge above the block at the start [m]."""


def insertion(
    length: float,
    depth: float,
    speed: float,
    *,
    middle: tuple[float, float] = (CUT_X, 0.5 * LENGTH),
    top: float = THICKNESS,
) -> list[BladeSegment]:
    """Return the poses of an edge that goes down.

    Args:
        length: Length of the edge, along y [m].
        depth: How far below the top it goes [m].
        speed: Speed of the edge [m/s].
        middle: Coordinates of the middle of the edge, across and along the block [m].
        top: Height of the top of the body [m].
    """
    n = round((depth + _ABOVE) / speed / DT)
    heights: FloatArray = top + _ABOVE - np.linspace(0.0, depth + _ABOVE, n + 1)
    x, y = middle[0], middle[1] - 0.5 * length
    return [
        edge_at((x, y, z), along=(0.0, 1.0, 0.0), forward=(0.0, 0.0, -1.0), length=length)
        for z in heights
    ]


def insertion_and_withdrawal(length: float, depth: float, speed: float) -> list[BladeSegment]:
    """Return the poses of an edge that goes down, and back up on the same path."""
    down = insertion(length, depth, speed)
    return down + down[-2::-1]
