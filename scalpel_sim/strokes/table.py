"""The table `[[stroke]]`: how the blade is led."""

from scalpel_sim.tables.values import (
    FileName,
    Finite,
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

    @property
    def tip_speed(self) -> float:
        """Speed of the tip between its ramps [m/s], the usual one where none is given."""
        return DEFAULT_SPEED if self.speed is None else self.speed


def stroke_called(name: str) -> StrokeTable:
    """Return the stroke of that kind, or the one that a CSV file has recorded."""
    if name.lower().endswith(".csv"):
        return StrokeTable(kind="recorded", file=name)
    return StrokeTable(kind=name)
