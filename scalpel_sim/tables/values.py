"""Values that a key of a TOML file may hold. SI units, tissue frame.

The description of each is what an error says the value must be.
"""

import sys
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

from bridge import MAX_FRAMES_PER_ANSWER
from tissue import LAWS

WIDEST_OPENING = 0.02
"""Largest distance between the pads of a grasper [m]."""

_LARGEST = sys.float_info.max  # refuses infinity


def one_of(*names: str) -> Meta:
    """Return the description of a choice."""
    return Meta(description=" or ".join(f'"{name}"' for name in names))


class TomlTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """Base of the tables: an unknown key is an error."""


class Kind(NamedTuple):
    """A kind of a table, and its keys. Keys of no kind belong to all."""

    about: str = ""
    """Nature or effect of it."""
    needed: tuple[str, ...] = ()
    """Keys that it must have."""
    possible: tuple[str, ...] = ()
    """Keys that it may have besides."""


Name = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$",
        description="a name: letters, digits and underscores, a letter first, 40 at most",
    ),
]
NameOfScene = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$",
        description="a name: letters, digits, dots, dashes and underscores, 64 at most",
    ),
]
Label = Annotated[
    str,
    Meta(
        pattern=r"^[^\s\x00-\x1f\x7f]([^\x00-\x1f\x7f]{0,38}[^\s\x00-\x1f\x7f])?\Z",
        description="a name of one line, of 1 to 40 characters",
    ),
]
HexColour = Annotated[
    str, Meta(pattern=r"^#[0-9A-Fa-f]{6}\Z", description='a colour, "#rrggbb", as "#b3202a"')
]
Text = Annotated[str, Meta(min_length=1, description="text")]
FileName = Annotated[str, Meta(min_length=1, description="text", extra={"is_file": True})]
TrueOrFalse = Annotated[bool, Meta(description="true or false")]
Finite = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST, description="a number")]
Positive = Annotated[float, Meta(gt=0.0, le=_LARGEST, description="a number above 0")]
NotNegative = Annotated[float, Meta(ge=0.0, le=_LARGEST, description="a number, 0 or more")]
Ratio = Annotated[float, Meta(ge=0.0, lt=0.5, description="a number from 0 to below 0.5")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="a number from 0 to 1")]
Angle = Annotated[
    float, Meta(gt=0.0, lt=180.0, description="an angle above 0 and below 180 degrees")
]
Opening = Annotated[
    float, Meta(ge=0.0, le=WIDEST_OPENING, description=f"a distance from 0 to {WIDEST_OPENING} m")
]
TwoShares = Annotated[
    tuple[Share, Share], Meta(description="two numbers from 0 to 1: [begin, end]")
]
Whole = Annotated[int, Meta(ge=1, le=10_000, description="a whole number from 1 to 10000")]
TwoLabels = Annotated[tuple[Label, Label], Meta(description='two names: ["fat", "skin"]')]
LabelNumber = Annotated[int, Meta(ge=0, le=2**31 - 1, description="a whole number of at least 0")]
Every = Annotated[
    int,
    Meta(
        ge=1,
        le=MAX_FRAMES_PER_ANSWER,
        description=f"a whole number from 1 to {MAX_FRAMES_PER_ANSWER}",
    ),
]
_Three = tuple[Finite, Finite, Finite]
ThreeNumbers = Annotated[_Three, Meta(description="three numbers: [x, y, z]")]
FourNumbers = Annotated[
    tuple[Finite, Finite, Finite, Finite], Meta(description="four numbers: [w, x, y, z]")
]
# msgspec 0.23 mixes up the bounds of a number with the length of a tuple of three beside it.
_OfThree = Annotated[tuple[Finite, ...], Meta(min_length=3, max_length=3)]
Gravity = Annotated[
    Annotated[float, Meta(ge=0.0, le=_LARGEST)] | _OfThree,
    Meta(description="a number, 0 or more, or a vector of three: [x, y, z]"),
]
RowsOfThree = Annotated[
    list[_Three], Meta(min_length=1, description="rows of three numbers: [[x, y, z], ...]")
]
Size = Annotated[tuple[Positive, Positive, Positive], Meta(description="three numbers above 0 [m]")]
CellCounts = Annotated[
    tuple[Whole, Whole, Whole], Meta(description="three whole numbers of at least 1")
]
CellSizes = Annotated[
    list[Positive], Meta(min_length=1, max_length=1000, description="sizes of cells in m, above 0")
]
Times = Annotated[
    list[NotNegative], Meta(min_length=1, description="times in s, 0 or more: [0.0, 1.0]")
]
Series = Annotated[
    list[tuple[float, float]], Meta(description="a list of pairs of numbers, [[g, tau], ...]")
]
Region = Annotated[
    str,
    Meta(
        min_length=1,
        description='a region: sides ("left,right"; "underside"), a box ("0,0,0:0.01,0.02,0.03") '
        'or a sphere ("sphere:0.01,0.02,0.03,0.005"), or a label ("label:bone")',
    ),
]
if TYPE_CHECKING:
    _LawName = str
else:  # the laws that there are when the schema is made
    _LawName = Literal[tuple(LAWS)]
LawName = Annotated[_LawName, one_of(*LAWS)]
