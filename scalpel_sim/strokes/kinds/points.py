"""The stroke `points`: the tip goes along straight lines."""

import numpy as np

from scalpel_sim.strokes.drawn import KEYS_OF_PATH, led_along, missing_points
from scalpel_sim.strokes.kind import STROKES, LyingBody, StrokeKind
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable
from scalpel_sim.tables.values import Kind


def _plan(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along straight lines through the points of its row."""
    return led_along(row, np.array(row.points))


STROKES.update(
    points=StrokeKind(
        Kind(
            "the tip goes along straight lines from point to point, and rests at each corner while "
            "the blade turns",
            *KEYS_OF_PATH,
        ),
        _plan,
        problem=missing_points,
    )
)
