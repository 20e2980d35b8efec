"""The stroke `stab`: the tip goes in along the edge, and out again."""

import numpy as np

from scalpel_sim.strokes.drawn import edge_direction, led_along
from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable


def _problem(row: StrokeTable) -> str | None:
    n_points = len(row.points or ())
    if n_points == 1:
        return None
    return f"has {n_points} points; it has one, where the tip goes in"


@stroke_kind(
    "the tip goes in along the edge, and out again",
    ("points", "length", "depth", "forward"),
    ("edge", "speed"),
    problem=_problem,
)
def stab(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke in along the edge at the point of its row, and out again."""
    assert row.points is not None and row.depth is not None
    point = np.array(row.points[0])
    inside = point - row.depth * edge_direction(row)
    return led_along(row, np.array([point, inside, point]), asks=False)
