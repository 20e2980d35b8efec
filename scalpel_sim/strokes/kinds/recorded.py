"""The stroke `recorded`: poses over time, from a file."""

from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.stroke import Stroke, from_csv
from scalpel_sim.strokes.table import StrokeTable


@stroke_kind("poses over time, from a CSV file ([command line](command_line.md))", ("file",))
def recorded(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return the stroke in the file of its row."""
    assert row.file is not None
    return from_csv(row.file)
