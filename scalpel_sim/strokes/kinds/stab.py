"""The stroke `stab`: the tip goes in along the edge, and out again."""

import numpy as np

from scalpel_sim.strokes.drawn import edge_direction, led_along
from scalpel_sim.strokes.kind import STROKES, LyingBody, StrokeKind
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable
from scalpel_sim.tables.values import Kind


def _plan(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke in along the edge at the point of its row, and out again."""
    assert row.points is not None and row.depth is not None
    point = np.array(row.points[0])
    inside = point - row.depth * edge_direction(row)
    return led_along(row, np.array([point, inside, point]), asks=False)


def _problem(row: StrokeTable) -> str | None:
    n_points = len(row.points or ())
    if n_points == 1:
        return None
    return f"has {n_points} points; it has one, where the tip goes in"


STROKES.update(
    stab=StrokeKind(
        Kind(
            "the tip goes in along the edge, and out again",
            ("points", "length", "depth", "forward"),
            ("edge", "speed"),
        ),
        _plan,
        problem=_problem,
    )
)
