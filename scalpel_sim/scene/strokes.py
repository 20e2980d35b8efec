"""The table `[[stroke]]`: how the blade is led, and the kinds of strokes that there are."""

from scalpel_sim.scene.values import (
    FileName,
    Finite,
    Kind,
    NotNegative,
    Positive,
    RowsOfThree,
    Text,
    ThreeNumbers,
    TomlTable,
    TwoShares,
)

DEFAULT_SPEED = 0.06
"""Speed of an unhurried incision [m/s]."""


_OF_PATH = (
    ("points", "length"),
    ("edge", "forward", "slicing_ratio", "saw_amplitude", "saw_frequency", "speed"),
)

PLANNED_STROKES = {
    "straight": Kind("a plane across the middle of the body, clean through", possible=("speed",)),
    "slanted": Kind(
        "a plane that leans by 25 degrees, with the blade raked by 15, clean through",
        possible=("speed",),
    ),
    "curved": Kind(
        "a bent sheet across the middle of the body, clean through", possible=("speed",)
    ),
    "stop": Kind("the straight stroke, ended inside the body: a slit", possible=("speed",)),
    "incision": Kind(
        "the tip goes in from above, is drawn along the body, and is lifted out",
        possible=("speed", "depth", "along"),
    ),
    "press": Kind(
        "the blade pushed against the body, not far enough to cut", possible=("speed", "depth")
    ),
}
"""The strokes that are planned for a body."""

DRAWN_STROKES = {
    "points": Kind(
        "the tip goes along straight lines from point to point, and rests at each corner while the "
        "blade turns",
        *_OF_PATH,
    ),
    "spline": Kind(
        "the tip goes along a smooth curve through the points, without a stop", *_OF_PATH
    ),
    "stab": Kind(
        "the tip goes in along the edge, and out again",
        ("points", "length", "depth", "forward"),
        ("edge", "speed"),
    ),
    "recorded": Kind(
        "poses over time, from a CSV file ([command line](command_line.md))", ("file",)
    ),
}
"""The strokes that a scene gives point by point."""

STROKES = PLANNED_STROKES | DRAWN_STROKES


class StrokeTable(TomlTable, kw_only=True, frozen=True):
    """`[[stroke]]`: one of the strokes, which are done in turn. Its keys depend on its kind."""

    kind: Text = "straight"
    """Kind of the stroke."""
    speed: Positive | None = None
    """Speed of the tip between its ramps [m/s]; 0.06 without."""
    depth: Positive | None = None
    """How deep it goes [m]; without, an incision goes 0.008 deep, and a press half as deep as would
    cut."""
    along: TwoShares | None = None
    """Where an incision goes in and out, as shares of the body's length; [0.2, 0.73] without. In
    the other order it is drawn backwards."""
    points: RowsOfThree | None = None
    """Where the tip goes [m]: two points or more, and one of a stab."""
    length: Positive | None = None
    """Length of the blade [m]."""
    edge: ThreeNumbers | None = None
    """Direction from tip to heel; [0, 0, 1] without: the tip is down."""
    forward: ThreeNumbers | None = None
    """Direction in which the edge cuts; that of the motion without."""
    slicing_ratio: Finite | None = None
    """Speed along the edge, towards the heel, over that across it."""
    saw_amplitude: Positive | None = None
    """How far the blade is moved along the edge, back and forth [m]."""
    saw_frequency: Positive | None = None
    """How often the blade is moved back and forth [1/s]."""
    file: FileName | None = None
    """CSV file of poses."""
    wait: NotNegative = 0.0
    """How long the blade rests before it begins [s]."""
    pause: NotNegative = 0.0
    """How long the blade rests afterwards [s]."""


def stroke_called(name: str) -> StrokeTable:
    """Return the stroke of that kind, or the one that a CSV file has recorded."""
    if name.lower().endswith(".csv"):
        return StrokeTable(kind="recorded", file=name)
    return StrokeTable(kind=name)
