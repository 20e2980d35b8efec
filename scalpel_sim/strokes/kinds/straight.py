"""The stroke `straight`: a plane across the middle of the body."""

from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.planning import passage_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable


@stroke_kind(
    "a plane across the middle of the body, clean through", possible=("speed",), is_planned=True
)
def straight(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a plane across the middle of the body."""
    passage = passage_through(row, body)
    return passage.stroke(passage.beyond)
