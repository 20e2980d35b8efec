"""What a key of a TOML file may hold. SI units, tissue frame.

The description of each is what an error says the value must be.
"""

import sys
from collections.abc import Sequence
from typing import Annotated, get_args

import msgspec
from msgspec import Meta

from scalpel_sim.errors import UsageError
from tissue import Law

_LARGEST = sys.float_info.max  # refuses infinity


def one_of(*names: str) -> Meta:
    """Return the description of a choice."""
    return Meta(description=" or ".join(f'"{name}"' for name in names))


class TomlTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """Base of the tables: an unknown key is an error."""


Name = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$",
        description="a name: letters, digits and underscores, a letter first, 40 at most",
    ),
]
Text = Annotated[str, Meta(min_length=1, description="text")]
TrueOrFalse = Annotated[bool, Meta(description="true or false")]
Finite = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST, description="a number")]
Positive = Annotated[float, Meta(gt=0.0, le=_LARGEST, description="a number above 0")]
NotNegative = Annotated[float, Meta(ge=0.0, le=_LARGEST, description="a number, 0 or more")]
Ratio = Annotated[float, Meta(ge=0.0, lt=0.5, description="a number from 0 to below 0.5")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="a number from 0 to 1")]
TwoShares = Annotated[
    tuple[Share, Share], Meta(description="two numbers from 0 to 1: [begin, end]")
]
Whole = Annotated[int, Meta(ge=1, le=10_000, description="a whole number from 1 to 10000")]
_Three = tuple[Finite, Finite, Finite]
ThreeNumbers = Annotated[_Three, Meta(description="three numbers: [x, y, z]")]
RowsOfThree = Annotated[
    list[_Three], Meta(min_length=1, description="rows of three numbers: [[x, y, z], ...]")
]
Size = Annotated[tuple[Positive, Positive, Positive], Meta(description="three numbers above 0 [m]")]
CellCounts = Annotated[
    tuple[Whole, Whole, Whole], Meta(description="three whole numbers of at least 1")
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
        'or a sphere ("sphere:0.01,0.02,0.03,0.005")',
    ),
]
LawName = Annotated[Law, one_of(*get_args(Law))]


def check_own_name(name: str, taken: Sequence[str], where: str) -> None:
    """Check that no other row has this name.

    Args:
        name: Its name.
        taken: Names of the rows before it.
        where: Which row it is, for the message.

    Raises:
        UsageError: another has it.
    """
    if name in taken:
        raise UsageError(f"{where} has the name '{name}' of another; give each its own")
