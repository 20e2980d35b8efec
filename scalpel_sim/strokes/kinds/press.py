"""The stroke `press`: the blade pushed against the body, not far enough to cut."""

from scalpel_sim.strokes.kind import LyingBody, check_positive, stroke_kind
from scalpel_sim.strokes.planning import passage_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.table import StrokeTable

PRESS_TOUGHNESS_SHARE = 0.5
"""A press goes as deep as half of what would cut: depth x Young's modulus is a force per length of
edge, of the size of the toughness where cutting begins."""

DEEPEST_PRESS = 0.1
"""Deepest press that is planned by itself, as a fraction of the section's length."""

PRESS_DWELL = 0.5
"""Time for which the blade rests at the end of a press [s]: the tissue comes to rest under it."""


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
