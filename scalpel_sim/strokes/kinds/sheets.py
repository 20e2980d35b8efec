"""Strokes along a sheet across the middle of the body, through it or into it."""

import math

from scalpel_sim.strokes.kind import (
    UNTIL_THROUGH,
    LyingBody,
    StrokeTable,
    check_positive,
    stroke_kind,
)
from scalpel_sim.strokes.planned_sheet import PlannedSheet
from scalpel_sim.strokes.planning import MiddleSection, passage_through
from scalpel_sim.strokes.stroke import Stroke

TILT = math.radians(25.0)
"""Angle by which the slanted sheet leans [rad], where the body is wide enough for it."""

RAKE = math.radians(15.0)
"""Angle by which the tip of the slanted blade trails its heel [rad]."""

SAGITTA = 0.11
"""Height of the curved sheet's bend, as a fraction of the section's length."""

PRESS_TOUGHNESS_SHARE = 0.5
"""A press goes as deep as half of what would cut: depth x Young's modulus is a force per length of
edge, of the size of the toughness where cutting begins."""

DEEPEST_PRESS = 0.1
"""Deepest press that is planned by itself, as a fraction of the section's length."""

PRESS_DWELL = 0.5
"""Time for which the blade rests at the end of a press [s]: the tissue comes to rest under it."""

STOP_SHARE, STOP_LATEST = 0.55, 0.9
"""Fraction of the section's length at which the stroke ends, and at which it ends at the latest
where the body is displaced first."""


@stroke_kind(
    "a plane across the middle of the body, clean through",
    possible=("speed", *UNTIL_THROUGH),
    is_planned=True,
)
def straight(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a plane across the middle of the body."""
    passage = passage_through(row, body)
    return passage.stroke(passage.beyond)


@stroke_kind(
    "a plane that leans by 25 degrees, with the blade raked by 15, clean through",
    possible=("speed", *UNTIL_THROUGH),
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


@stroke_kind(
    "a bent sheet across the middle of the body, clean through",
    possible=("speed", *UNTIL_THROUGH),
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


@stroke_kind(
    "the blade pushed against the body, not far enough to cut",
    possible=("speed", "depth"),
    is_planned=True,
    cuts=False,
)
def press(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke against the middle of the body, which ends before it cuts."""
    passage = passage_through(row, body)
    depth = row.depth
    if depth is None:
        harmless = PRESS_TOUGHNESS_SHARE * body.material.toughness / body.material.young_modulus
        depth = min(harmless, DEEPEST_PRESS * passage.length)
        check_positive("depth", depth, "m")
    return passage.stroke(passage.first + depth, asks=False, dwell=PRESS_DWELL)
