"""The table `[[grasper]]`: an arm that holds a grasper, and what that does."""

from collections.abc import Sequence
from typing import Annotated, Literal

from msgspec import Meta, field

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.values import (
    Finite,
    Name,
    NotNegative,
    Positive,
    Text,
    ThreeNumbers,
    TomlTable,
    check_own_name,
    one_of,
)

DEFAULT_APPROACH, DEFAULT_ACROSS = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
"""How a grasper is turned at first where a motion does not say: its shaft points down."""

WIDEST_OPENING = 0.02
"""Largest distance between the pads [m]."""

_Opening = Annotated[
    float, Meta(ge=0.0, le=WIDEST_OPENING, description=f"a distance from 0 to {WIDEST_OPENING} m")
]
_Quaternion = Annotated[
    tuple[Finite, Finite, Finite, Finite], Meta(description="four numbers: [w, x, y, z]")
]


class WaypointTable(TomlTable, kw_only=True, frozen=True):
    """A row of `motion`: where a grasper rests at an instant; what is left out is as before."""

    time: NotNegative
    """When it is there [s]."""
    at: ThreeNumbers | None = None
    """Where the middle between the pads is [m]."""
    approach: ThreeNumbers | None = None
    """Direction in which shaft and pads point."""
    across: ThreeNumbers | None = None
    """Direction in which the jaws open."""
    opening: _Opening | None = None
    """Distance between the pads [m]."""


class GrasperTable(TomlTable, kw_only=True, frozen=True):
    """`[[grasper]]`: an arm that holds a grasper, led along a motion, or as a hand has led it."""

    name: Name = "left"
    preset: Text | None = None
    """Its arm; None: `auto`, or the model."""
    model: Text | None = None
    """MJCF file of an arm of the user's own."""
    at: Text | None = None
    """Site or body of that which holds the grasper, along its +z."""
    pos: ThreeNumbers | None = None
    """Where the origin of that model is [m]."""
    quat: _Quaternion | None = None
    """How it is turned there: w, x, y, z."""
    holds: Annotated[Literal["attachment", "friction"], one_of("attachment", "friction")] = (
        "attachment"
    )
    """Whether what the jaws close on is tied to them, or they touch it and friction holds it."""
    stiffness: Positive | None = None
    """Of that hold [N/m]."""
    damping: NotNegative | None = None
    """Of it [N s/m]."""
    breaks_at: Positive | None = None
    """Force at which what is held slips out [N]."""
    closed: Positive | None = None
    """Distance between the pads below which they hold [m]."""
    force: Positive | None = None
    """Largest force of the jaws [N]."""
    motion: Annotated[list[WaypointTable], Meta(min_length=1)] = field(default_factory=list)
    recorded: Text | None = None
    """CSV file of what a hand did with it, in place of a motion."""


_OF_MODEL = ("at", "pos", "quat")
_OF_HOLD = ("stiffness", "damping", "breaks_at", "closed")


def check_graspers(graspers: Sequence[GrasperTable]) -> None:
    """Check that the keys of each grasper belong together, and that names differ.

    Raises:
        UsageError: they do not; the message says which.
    """
    for i, grasper in enumerate(graspers):
        where = f"[[grasper]] number {i + 1}"
        _check(grasper, where)
        check_own_name(grasper.name, [other.name for other in graspers[:i]], where)


def _check_motion(motion: Sequence[WaypointTable], where: str) -> None:
    if not motion:
        raise UsageError(f"{where} has no motion: rows such as {{time = 0.0, at = [0, 0, 0.1]}}")
    for key in ("at", "opening"):
        if getattr(motion[0], key) is None:
            raise UsageError(f"the first row of motion of {where} has no {key}")


def _check(grasper: GrasperTable, where: str) -> None:
    if grasper.recorded is not None and grasper.motion:
        raise UsageError(f"{where} has a motion and a recorded one; choose one")
    if grasper.recorded is None:
        _check_motion(grasper.motion, where)
    if grasper.model is not None:
        if grasper.preset is not None:
            raise UsageError(f"{where} has a preset and a model; choose one")
        if grasper.at is None:
            raise UsageError(f"{where} has a model and no at: the site or body that holds it")
    for key in _OF_MODEL:
        if grasper.model is None and getattr(grasper, key) is not None:
            raise UsageError(f"{where} {key} is for an arm of your own; add a model, or omit it")
    for key in _OF_HOLD:
        if grasper.holds == "friction" and getattr(grasper, key) is not None:
            raise UsageError(f'{where} {key} is for holds = "attachment"; friction has none')
    if grasper.quat is not None and not any(grasper.quat):
        raise UsageError(f"{where} quat is [0, 0, 0, 0]; it is a rotation: w, x, y, z")
