"""The stroke `curved`: a bent sheet across the middle of the body."""

from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.planned_sheet import PlannedSheet
from scalpel_sim.strokes.planning import MiddleSection, passage_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable

SAGITTA = 0.11
"""Height of the curved sheet's bend, as a fraction of the section's length."""


@stroke_kind(
    "a bent sheet across the middle of the body, clean through",
    possible=("speed",),
    is_planned=True,
)
def curved(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a bent sheet across the middle of the body."""
    passage = passage_through(row, body, _bent)
    return passage.stroke(passage.beyond)


def _bent(middle: MiddleSection, strength: float) -> PlannedSheet:
    """Return the sheet through a section, with a fraction of the full bend."""
    sagitta = min(strength * SAGITTA * middle.length, middle.room(strength))
    return middle.sheet._replace(sagitta=sagitta, chord=middle.length)
