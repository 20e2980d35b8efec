"""The stroke `stop`: the straight stroke, ended inside the body."""

from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.planning import passage_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable

STOP_SHARE, STOP_LATEST = 0.55, 0.9
"""Fraction of the section's length at which the stroke ends, and at which it ends at the latest
where the body is displaced first."""


@stroke_kind(
    "the straight stroke, ended inside the body: a slit",
    possible=("speed",),
    is_planned=True,
    ends_inside=True,
)
def stop(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a plane across the body, which ends inside."""
    passage = passage_through(row, body)
    length = passage.length
    end = passage.first + min(STOP_SHARE * length + passage.displacement, STOP_LATEST * length)
    return passage.stroke(end, asks=False)
