"""Commands of a page to the hand and to its run: small messages as JSON, checked at the border."""

import math
from typing import Annotated

import msgspec

LONGEST_MESSAGE = 1 << 13
"""Longest message [bytes]. A hand's have some 120, and lines that are drawn 30 for each point."""

MOST_LINES, MOST_POINTS = 8, 100
"""Lines that are cut in a run, and points of a line, at most."""

DEEPEST_LINE, FASTEST_LINE = 0.1, 0.2
"""Deepest cut along a line [m], and the fastest [m/s]: no hand cuts faster along a line."""

FARTHEST_MOVE = 0.1
"""Largest displacement of one message [m]: more than the width of a body is no hand's."""

FARTHEST_PLACE = 1e3
"""Largest distance of a place from the origin of the world [m]; the room of an instrument, to which
a place is clipped, is far smaller."""

FARTHEST_TURN = math.pi / 2.0
"""Largest turn of one message [rad]."""

SLOWEST = 0.01
"""Slowest motion that may be requested: simulated time over wall time."""

LATEST_STAMP = 1e12
"""Largest stamp [ms]: some thirty years."""

LONGEST_SILENCE = 2.0
"""Wall time without a message after which an engaged hand rests, until it hears one again [s]. The
page says ten times a second that it is there, but where drawing takes all of the machine, its
thread hangs for a second. Until then the blade goes no farther than was requested, and a page that
is closed releases at once."""

HIGHEST_TOUGHNESS, THICKEST_BLADE = 1e4, 2e-3
"""Highest fracture toughness [J/m2] and thickest blade [m] that a page may request: beyond those of
skin and of any scalpel."""

_Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_-]{0,64}$")]
_ThreeNumbers = Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
_Points = Annotated[list[_ThreeNumbers], msgspec.Meta(min_length=2, max_length=MOST_POINTS)]
_Stamp = Annotated[float, msgspec.Meta(ge=0.0, le=LATEST_STAMP)]


class _Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A message; `type` says which."""


class Engage(_Message, frozen=True, tag="engage"):
    """The hand takes hold: from now on moves and turns lead the chosen instrument."""


class Release(_Message, frozen=True, tag="release"):
    """The hand releases: the instrument stays where it is."""


class Move(_Message, frozen=True, tag="move"):
    """Move the chosen instrument."""

    by: _ThreeNumbers
    """Displacement [m], world frame."""
    stamp: _Stamp
    """Time of the input by the page's clock [ms], to measure how late the picture is."""


class Aim(_Message, frozen=True, tag="aim"):
    """Lead the chosen instrument to a place, and no farther."""

    to: _ThreeNumbers
    """Where what of it is led is to be [m], world frame."""
    stamp: _Stamp
    """See `Move`."""


class Turn(_Message, frozen=True, tag="turn"):
    """Turn it about the middle of its edge or of its pads."""

    by: _ThreeNumbers
    """Rotation vector [rad], world frame."""
    stamp: _Stamp
    """See `Move`."""


class StillThere(_Message, frozen=True, tag="still there"):
    """The page is still there, holds the instrument, and its hand has nothing new to say."""


class Lead(_Message, frozen=True, tag="lead"):
    """The page requests to be the one that leads."""


class Choose(_Message, frozen=True, tag="choose"):
    """Lead another instrument from now on; the hand releases the one before."""

    instrument: Annotated[int, msgspec.Meta(ge=0)]
    """Number of the instrument: 0 is the blade, the graspers follow in the order of the scene."""


class Jaws(_Message, frozen=True, tag="jaws"):
    """Close or open the jaws of the chosen instrument, if it has any."""

    closed: bool
    """Whether they are to close."""


class End(_Message, frozen=True, tag="end"):
    """The run is to end."""


class Pause(_Message, frozen=True, tag="pause"):
    """The hand releases, and time stands still."""


class Resume(_Message, frozen=True, tag="resume"):
    """Time continues."""


class Step(_Message, frozen=True, tag="step"):
    """Time continues for a moment, and stands still again."""


class SlowMotion(_Message, frozen=True, tag="slow motion"):
    """Time passes at another rate from now on."""

    rate: Annotated[float, msgspec.Meta(ge=SLOWEST, le=1.0)]
    """Simulated time over wall time, at most."""


class Undo(_Message, frozen=True, tag="undo"):
    """The run goes back to before the last stroke: to where the hand took hold for it."""


class Reset(_Message, frozen=True, tag="reset"):
    """The run goes back to its start."""


class DrawnLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A line on the skin along which the script is to cut: a stroke `traced`."""

    points: _Points
    """Places on the skin of the body at rest [m], tissue frame."""
    edge: _ThreeNumbers
    """Direction from tip to heel: against the depth."""
    depth: Annotated[float, msgspec.Meta(gt=0.0, le=DEEPEST_LINE)]
    """Depth of the cut [m]."""
    speed: Annotated[float, msgspec.Meta(gt=0.0, le=FASTEST_LINE)]
    """Speed of the blade [m/s]."""


_Lines = Annotated[list[DrawnLine], msgspec.Meta(max_length=MOST_LINES)]


class CutLines(_Message, frozen=True, tag="cut"):
    """The run is to end, and the same to begin again, in which the script cuts along lines."""

    lines: _Lines
    """The lines, in turn; none: the strokes of the scene."""


class Begin(_Message, frozen=True, tag="begin"):
    """The run is to end, and another to begin. What is None is as in the scene."""

    scene: _Name = ""
    """The scene; empty: that of the command line."""
    material: _Name | None = None
    """Material by name."""
    toughness: Annotated[float, msgspec.Meta(ge=0.0, le=HIGHEST_TOUGHNESS)] | None = None
    """Fracture toughness [J/m2]."""
    blade_thickness: Annotated[float, msgspec.Meta(ge=0.0, le=THICKEST_BLADE)] | None = None
    """Thickness of the blade [m]."""
    is_led: bool = False
    """Whether the page leads the blade in it."""
    lines: _Lines = []
    """Lines along which the script cuts, in place of the strokes of the scene."""


LeadingCommand = Engage | Release | Move | Aim | Turn | StillThere | Choose | Jaws | End
"""Commands that the hand obeys in its next frame."""

RunCommand = Pause | Resume | Step | SlowMotion | Undo | Reset
"""Commands that are done between two frames."""

Command = LeadingCommand | RunCommand | Begin | CutLines | Lead

_decoder: msgspec.json.Decoder[Command] = msgspec.json.Decoder(Command)


def command_of(message: str | bytes) -> Command | None:
    """Return the command of a message; None where it is none, or requests too much."""
    if len(message) > LONGEST_MESSAGE:
        return None
    try:
        command = _decoder.decode(message)
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        return None
    if isinstance(command, Move | Turn):
        most = FARTHEST_MOVE if isinstance(command, Move) else FARTHEST_TURN
        size = math.hypot(*command.by)
        return command if size <= most else None  # NaN is not
    if isinstance(command, Aim):
        return command if math.hypot(*command.to) <= FARTHEST_PLACE else None
    return command
