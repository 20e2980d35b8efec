"""The tables of a case file, and what each key may hold. SI units, tissue frame."""

import sys
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scalpel_sim.cli.material_file import BladeTable, MaterialTable

_LARGEST = sys.float_info.max  # refuses infinity

# The description of each is what an error says the value must be.
_Name = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$",
        description="a name: letters, digits and underscores, a letter first, 40 at most",
    ),
]
_Text = Annotated[str, Meta(min_length=1, description="text")]
_Finite = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST)]
_Positive = Annotated[float, Meta(gt=0.0, le=_LARGEST, description="a number above 0")]
_NotNegative = Annotated[float, Meta(ge=0.0, le=_LARGEST, description="a number, 0 or more")]
_Whole = Annotated[int, Meta(ge=1, le=10_000, description="a whole number from 1 to 10000")]
_Triple = tuple[_Finite, _Finite, _Finite]
_Vector = Annotated[_Triple, Meta(description="three numbers: [x, y, z]")]
_Vectors = Annotated[
    list[_Triple], Meta(min_length=1, description="rows of three numbers: [[x, y, z], ...]")
]
_Size = Annotated[
    tuple[_Positive, _Positive, _Positive], Meta(description="three numbers above 0 [m]")
]
_Cells = Annotated[
    tuple[_Whole, _Whole, _Whole], Meta(description="three whole numbers of at least 1")
]
_Times = Annotated[
    list[_NotNegative], Meta(min_length=1, description="times in s, 0 or more: [0.0, 1.0]")
]
_Region = Annotated[
    str,
    Meta(
        min_length=1,
        description='a region: sides ("left,right"; "underside") or a box ("0,0,0:0.01,0.02,0.03")',
    ),
]


def _one_of(*names: str) -> Meta:
    """Return the description of a choice."""
    return Meta(description=" or ".join(f'"{name}"' for name in names))


_Shape = Annotated[
    Literal["block", "lattice", "cylinder", "mesh"], _one_of("block", "lattice", "cylinder", "mesh")
]
_Relaxation = Annotated[Literal["global", "verlet"], _one_of("global", "verlet")]
_Component = Annotated[Literal["x", "y", "z", "magnitude"], _one_of("x", "y", "z", "magnitude")]
RecordedQuantity = Literal["reaction", "displacement", "blade_force", "blade_position", "cut_area"]
_Quantity = Annotated[
    RecordedQuantity,
    _one_of("reaction", "displacement", "blade_force", "blade_position", "cut_area"),
]
_Flag = Annotated[bool, Meta(description="true or false")]


class CaseTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """Base of the tables of a case: an unknown key is an error."""


class BodyTable(CaseTable, kw_only=True):
    """`[body]`: the geometry. Which keys there are depends on the shape."""

    shape: _Shape
    size: _Size | None = None
    cells: _Cells | None = None
    radius: _Positive | None = None
    height: _Positive | None = None
    rings: _Whole | None = None
    layers: _Whole | None = None
    file: _Text | None = None
    scale: _Positive | None = None


class CaseMaterialTable(MaterialTable, kw_only=True):
    """`[material]`: a preset and single figures that replace its own, or figures alone."""

    preset: _Text | None = None


class RunTable(CaseTable, kw_only=True):
    """`[run]`: how long, and with which method."""

    seconds: _Positive
    dt: _Positive = 1e-3
    record_every: _Positive = 1e-2
    gravity: _Vector = (0.0, 0.0, 0.0)
    settle: _Flag = False
    relaxation: _Relaxation = "global"


class SupportTable(CaseTable, kw_only=True):
    """`[[support]]`: a region that is held, or moved over time."""

    name: _Name
    region: _Region
    times: _Times | None = None
    displacement: _Vectors | None = None


class LoadTable(CaseTable, kw_only=True):
    """`[[load]]`: a force over time on a region or on points of the body at rest."""

    name: _Name
    region: _Region | None = None
    points: _Vectors | None = None
    times: _Times | None = None
    force: _Vectors


class CaseBladeTable(BladeTable, kw_only=True):
    """`[blade]`: the path of a cutting edge, and its shape; without a thickness it is a line."""

    times: _Times
    tip: _Vectors
    heel: _Vectors
    forward: _Vector


class RecordTable(CaseTable, kw_only=True):
    """`[[record]]`: a quantity that becomes a column of the table."""

    name: _Name
    quantity: _Quantity
    component: _Component = "magnitude"
    support: _Name | None = None
    point: _Vector | None = None


class ExpectedTable(CaseTable, kw_only=True):
    """`[[expected]]`: a curve or a value that a record should have."""

    record: _Name
    tolerance: _Positive
    source: _Text
    file: _Text | None = None
    against: _Name = "time"
    value: _Finite | None = None
    from_time: _NotNegative = 0.0
    to_time: _NotNegative | None = None


class CaseContent(CaseTable, kw_only=True):
    """The whole file."""

    title: _Text
    body: BodyTable
    material: CaseMaterialTable
    run: RunTable
    support: list[SupportTable] = []
    load: list[LoadTable] = []
    blade: CaseBladeTable | None = None
    record: Annotated[list[RecordTable], Meta(min_length=1)]
    expected: list[ExpectedTable] = []
