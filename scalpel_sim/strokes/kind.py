"""The table of a stroke, and what a kind of stroke is: its keys, and the path made from them."""

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.tables.values import (
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
    one_of,
)
from tissue import FloatArray, Material, TetrahedralMesh

DEFAULT_SPEED = 0.06
"""Speed of an unhurried incision [m/s]."""


DEFAULT_AT_MOST = 0.03
"""Distance beyond what was planned of a stroke that is to part the body [m]."""

DEFAULT_PATIENCE = 2.0
"""Time for which a stroke waits at its limit of force [s]: most tissue that relaxes has done so."""

UNTIL_THROUGH = ("until", "at_most")
"""Keys of strokes that can part a body."""

AtLimit = Annotated[Literal["stop", "wait", "draw back"], one_of("stop", "wait", "draw back")]
Until = Annotated[Literal["through"], one_of("through")]


class StrokeTable(TomlTable, kw_only=True, frozen=True):
    """`[[stroke]]`: one of the strokes, which are done in turn. Its keys depend on its kind."""

    kind: Text = "straight"
    """Kind of the stroke."""
    speed: Positive | None = None
    """Speed of the tip between its ramps [m/s]; 0.06 without."""
    depth: Positive | None = None
    """Depth to which it goes [m]; without, an incision or a traced stroke goes 0.008 deep, and a
    press half as deep as would cut."""
    along: TwoShares | None = None
    """Where an incision goes in and out, as shares of the body's length; [0.2, 0.73] without. In
    the other order it is drawn backwards."""
    points: RowsOfThree | None = None
    """Where the tip goes [m]: two points or more, and one of a stab or a rest. Of a traced stroke,
    near the skin of the body at rest: the tip goes beneath them."""
    length: Positive | None = None
    """Length of the blade [m]; of a traced stroke three depths without, and 0.01 above the skin."""
    edge: ThreeNumbers | None = None
    """Direction from tip to heel; [0, 0, 1] without: the tip is down."""
    forward: ThreeNumbers | None = None
    """Direction in which the edge cuts; that of the motion without."""
    slicing_ratio: Finite | None = None
    """Speed along the edge, towards the heel, over that across it."""
    saw_amplitude: Positive | None = None
    """Distance by which the blade is moved along the edge, back and forth [m]."""
    saw_frequency: Positive | None = None
    """Frequency at which the blade is moved back and forth [1/s]."""
    file: FileName | None = None
    """CSV file of poses."""
    wait: NotNegative = 0.0
    """Time for which the blade rests before it begins [s]."""
    pause: NotNegative = 0.0
    """Time for which the blade rests afterwards [s]."""
    force_limit: Positive | None = None
    """Force on the blade that it does not go on against [N]; any without."""
    at_limit: AtLimit | None = None
    """Action at that limit: stop, with all that was to come; wait: from 80 % of the limit on it
    goes slower, and stands while the force is above it; or draw back the way it came, and go to the
    next stroke. stop without."""
    patience: Positive | None = None
    """Time that it may lose by waiting before it stops [s]; 2 without."""
    until: Until | None = None
    """through: it ends when the body is parted, before or after where it was to end."""
    at_most: Positive | None = None
    """Distance beyond what was planned that it then goes at most [m]; 0.03 without."""

    @property
    def farther(self) -> float:
        """Distance beyond what was planned that it may go [m]."""
        if self.until is None:
            return 0.0
        return DEFAULT_AT_MOST if self.at_most is None else self.at_most

    @property
    def tip_speed(self) -> float:
        """Speed of the tip between its ramps [m/s], the usual one where none is given."""
        return DEFAULT_SPEED if self.speed is None else self.speed


def stroke_called(name: str) -> StrokeTable:
    """Return the stroke of that kind, or the one that a CSV file has recorded."""
    if name.lower().endswith(".csv"):
        return StrokeTable(kind="recorded", file=name)
    return StrokeTable(kind=name)


class LyingBody(NamedTuple):
    """A body as it lies before a stroke."""

    mesh: TetrahedralMesh
    """Its mesh, tissue frame [m]."""
    material: Material = Material()
    """Material of the body: how far a blade displaces it, and how deep a press may go."""
    lowest: float = -math.inf
    """Height below which no planned stroke leads the edge [m]: the upper side of a table or a floor
    that stops it. An incision does not come near it."""
    rest: FloatArray | None = None
    """Positions of its nodes at rest [m], shape (n_nodes, 3); None: it lies at rest."""


def no_problem(row: StrokeTable) -> None:
    """Find nothing wrong: the keys of the row are all that counts."""


StrokePlan = Callable[[StrokeTable, LyingBody], Stroke]
"""Returns the path of the blade from a row, whose keys are checked, and the body. It raises
`StrokeError` where no blade can follow it, or the body has no section where it is planned."""


class StrokeKind(NamedTuple):
    """A kind of stroke."""

    keys: Kind
    """The keys that a row `[[stroke]]` of this kind needs and may have, and what it does."""
    plan: StrokePlan
    """Returns the path of the blade."""
    is_planned: bool = False
    """Whether the program places the stroke in the body; else the row says where it is [m]."""
    cuts: bool = True
    """Whether the stroke is to cut; a press is not."""
    meets: bool = True
    """Whether the blade is to touch the body: one that stays away is refused."""
    ends_inside: bool = False
    """Whether a stroke that cuts ends inside the body, so that its area is not known before."""
    problem: Callable[[StrokeTable], str | None] = no_problem
    """Returns what is wrong with a row besides its keys, as "has one point; it needs two"; None
    where nothing is."""


STROKES: dict[str, StrokeKind] = {}
"""The kinds of strokes by name: those of `strokes/kinds`, and what a program adds."""


def stroke_kind(
    about: str, needed: tuple[str, ...] = (), possible: tuple[str, ...] = (), **settings: Any
) -> Callable[[StrokePlan], StrokePlan]:
    """Return a decorator that adds a function to `STROKES`, as the plan of the kind of its name.

    Args:
        about: What the stroke does.
        needed: Keys that a row must have.
        possible: Keys that a row may have besides.
        settings: Other fields of `StrokeKind`.
    """

    def added(plan: StrokePlan) -> StrokePlan:
        STROKES[plan.__name__] = StrokeKind(Kind(about, needed, possible), plan, **settings)
        return plan

    return added


def check_positive(what: str, value: float | None, unit: str) -> None:
    """Refuse a speed or a depth that is given and not positive.

    Raises:
        StrokeError: it is not.
    """
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise StrokeError(f"the {what} of the stroke is {value} {unit}; it must be positive")
