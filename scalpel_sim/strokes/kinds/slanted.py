"""The stroke `slanted`: a plane that leans, with a raked blade."""

import math

from scalpel_sim.strokes.kind import LyingBody, stroke_kind
from scalpel_sim.strokes.planned_sheet import PlannedSheet
from scalpel_sim.strokes.planning import MiddleSection, passage_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable

TILT = math.radians(25.0)
"""Angle by which the slanted sheet leans [rad], where the body is wide enough for it."""

RAKE = math.radians(15.0)
"""Angle by which the tip of the slanted blade trails its heel [rad]."""


@stroke_kind(
    "a plane that leans by 25 degrees, with the blade raked by 15, clean through",
    possible=("speed",),
    is_planned=True,
)
def slanted(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a plane that leans, across the middle of the body."""
    passage = passage_through(row, body, _leaning)
    return passage.stroke(passage.beyond)


def _leaning(middle: MiddleSection, strength: float) -> PlannedSheet:
    """Return the plane through a section, with a fraction of the full tilt and rake."""
    sheet = middle.sheet
    down, across = sheet.down, sheet.normal
    tilt = min(strength * TILT, math.atan2(middle.room(strength), 0.5 * middle.thickness))
    return sheet._replace(
        down=math.cos(tilt) * down + math.sin(tilt) * across,
        normal=math.cos(tilt) * across - math.sin(tilt) * down,
        rake=strength * RAKE,
    )
