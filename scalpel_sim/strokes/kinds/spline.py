"""The stroke `spline`: the tip goes along a smooth curve."""

from itertools import pairwise

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.drawn import KEYS_OF_PATH, SAME_POINT, led_along, missing_points
from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable
from tissue import FloatArray

_PER_LEG = 200
"""Points of a spline between two of those that it is given by."""


@stroke_kind(
    "the tip goes along a smooth curve through the points, without a stop",
    *KEYS_OF_PATH,
    problem=missing_points,
)
def spline(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a smooth curve through the points of its row, without a stop."""
    return led_along(row, _spline(np.array(row.points)), rests=False)


def _spline(points: FloatArray) -> FloatArray:
    """Return points close together on a cubic spline through some, by chord length [m]."""
    from scipy.interpolate import CubicSpline  # 0.2 s, and only here

    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if (chords <= SAME_POINT).any():
        raise StrokeError("two points of the spline in turn are the same; leave one out")
    at = np.append(0.0, np.cumsum(chords))
    fine = np.unique(np.concatenate([np.linspace(a, b, _PER_LEG + 1) for a, b in pairwise(at)]))
    return np.asarray(CubicSpline(at, points)(fine))
