"""The stroke `straight`: a plane across the middle of the body."""

from scalpel_sim.strokes.kind import STROKES, LyingBody, StrokeKind
from scalpel_sim.strokes.planning import passage_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable
from scalpel_sim.tables.values import Kind


def _plan(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a plane across the middle of the body."""
    passage = passage_through(row, body)
    return passage.stroke(passage.beyond)


STROKES.update(
    straight=StrokeKind(
        Kind("a plane across the middle of the body, clean through", possible=("speed",)),
        _plan,
        is_planned=True,
    )
)
