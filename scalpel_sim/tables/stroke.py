"""The table `[[stroke]]`: how the blade is led."""

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.tables.kinds import KeysOfKind, check_keys
from scalpel_sim.tables.values import (
    Finite,
    NotNegative,
    Positive,
    RowsOfThree,
    Text,
    ThreeNumbers,
    TomlTable,
    TwoShares,
)

PLANNED_STROKES = {
    "straight": "a plane across the middle of the body, clean through",
    "slanted": "a plane that leans by 25 degrees, with the blade raked by 15, clean through",
    "curved": "a bent sheet across the middle of the body, clean through",
    "stop": "the straight stroke, ended inside the body: a slit",
    "incision": "the tip goes in from above, is drawn along the body, and is lifted out",
    "press": "the blade pushed against the body, not far enough to cut",
}
"""The strokes that are planned for a body, and what each does."""

DRAWN_STROKES = {
    "points": "the tip goes along straight lines from point to point",
    "spline": "the tip goes along a smooth curve through points",
    "stab": "the tip goes in along the edge, and out again",
    "recorded": "poses over time, from a CSV file",
}
"""The strokes that a scene gives point by point, and what each does."""

_OF_PATH = KeysOfKind(
    ("points", "length"),
    ("edge", "forward", "slicing_ratio", "saw_amplitude", "saw_frequency", "speed"),
)

KEYS_OF_STROKE = {
    **dict.fromkeys(PLANNED_STROKES, KeysOfKind((), ("speed",))),
    "incision": KeysOfKind((), ("speed", "depth", "along")),
    "press": KeysOfKind((), ("speed", "depth")),
    "points": _OF_PATH,
    "spline": _OF_PATH,
    "stab": KeysOfKind(("points", "length", "depth", "forward"), ("edge", "speed")),
    "recorded": KeysOfKind(("file",)),
}
"""Keys of `[[stroke]]` that each kind has."""

DEFAULT_SPEED = 0.06
"""Speed of an unhurried incision [m/s]."""

FASTEST_STROKE = 1.0
"""Highest speed of a stroke [m/s]: no surgeon cuts as fast."""


class StrokeTable(TomlTable, kw_only=True, frozen=True):
    """`[[stroke]]`: one of the strokes, which are done in turn. Its keys depend on its kind."""

    kind: Text = "straight"
    speed: Positive | None = None
    """Speed of the tip between its ramps [m/s]; None: `DEFAULT_SPEED`."""
    depth: Positive | None = None
    """How deep a press, an incision or a stab goes [m]."""
    along: TwoShares | None = None
    """Where an incision goes in and out, as shares of the body's length."""
    points: RowsOfThree | None = None
    """Where the tip goes [m]."""
    length: Positive | None = None
    """Length of the blade [m]."""
    edge: ThreeNumbers | None = None
    """Direction from tip to heel; None: up."""
    forward: ThreeNumbers | None = None
    """Direction in which the edge cuts; None: that of the motion."""
    slicing_ratio: Finite | None = None
    """Speed along the edge, towards the heel, over that across it."""
    saw_amplitude: Positive | None = None
    """How far the blade is moved along the edge, back and forth [m]."""
    saw_frequency: Positive | None = None
    """How often it is [1/s]."""
    file: Text | None = None
    """CSV file of poses."""
    wait: NotNegative = 0.0
    """How long the blade rests before it begins [s]."""
    pause: NotNegative = 0.0
    """How long the blade rests afterwards [s]."""


def check_kind(stroke: StrokeTable) -> None:
    """Check that there is a stroke of that kind.

    Raises:
        UsageError: there is none; the message names the nearest.
    """
    if stroke.kind not in KEYS_OF_STROKE:
        raise unknown("stroke", stroke.kind, KEYS_OF_STROKE)


def check_stroke(stroke: StrokeTable, where: str) -> None:
    """Check that a stroke exists, and has what its kind needs.

    Args:
        stroke: Its table.
        where: Its name as a file writes it.

    Raises:
        UsageError: there is no such kind, a key belongs to another, or numbers make no sense.
    """
    check_kind(stroke)
    check_keys(stroke, where, "kind", KEYS_OF_STROKE)
    if stroke.speed is not None and stroke.speed > FASTEST_STROKE:
        raise UsageError(
            f"{where} speed is {stroke.speed} m/s; it must be above 0 and at most "
            f"{FASTEST_STROKE:g}"
        )
    if (stroke.saw_amplitude is None) != (stroke.saw_frequency is None):
        raise UsageError(f"{where} has one of saw_amplitude and saw_frequency; give both or none")
    n_points = len(stroke.points or ())
    if stroke.kind in ("points", "spline") and n_points < 2:
        raise UsageError(f'{where} of kind "{stroke.kind}" has one point; it needs two or more')
    if stroke.kind == "stab" and n_points != 1:
        raise UsageError(
            f'{where} of kind "stab" has {n_points} points; it has one, where the tip goes in'
        )


def stroke_called(name: str) -> StrokeTable:
    """Return the stroke of that kind, or the one that a CSV file has recorded."""
    if name.lower().endswith(".csv"):
        return StrokeTable(kind="recorded", file=name)
    return StrokeTable(kind=name)
