"""The stroke `points`: the tip goes along straight lines."""

import numpy as np

from scalpel_sim.strokes.drawn import KEYS_OF_PATH, led_along, missing_points
from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable


@stroke_kind(
    "the tip goes along straight lines from point to point, and rests at each corner while "
    "the blade turns",
    *KEYS_OF_PATH,
    problem=missing_points,
)
def points(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along straight lines through the points of its row."""
    return led_along(row, np.array(row.points))
