"""The tables of a case file, and what each key may hold. SI units, tissue frame."""

from typing import Annotated, Literal

from msgspec import Meta, field

from scalpel_sim.tables.body import BodyTable
from scalpel_sim.tables.material import BladeTable, PresetMaterialTable
from scalpel_sim.tables.values import (
    Finite,
    Name,
    NotNegative,
    Positive,
    Region,
    RowsOfThree,
    Text,
    ThreeNumbers,
    Times,
    TomlTable,
    TrueOrFalse,
    one_of,
)

_Relaxation = Annotated[Literal["global", "verlet"], one_of("global", "verlet")]
_Component = Annotated[Literal["x", "y", "z", "magnitude"], one_of("x", "y", "z", "magnitude")]
RecordedQuantity = Literal["reaction", "displacement", "blade_force", "blade_position", "cut_area"]
_Quantity = Annotated[
    RecordedQuantity,
    one_of("reaction", "displacement", "blade_force", "blade_position", "cut_area"),
]


class RunTable(TomlTable, kw_only=True, frozen=True):
    """`[run]`: how long, and with which method."""

    seconds: Positive
    dt: Positive = 1e-3
    record_every: Positive = 1e-2
    gravity: ThreeNumbers = (0.0, 0.0, 0.0)
    settle: TrueOrFalse = False
    relaxation: _Relaxation = "global"


class SupportTable(TomlTable, kw_only=True, frozen=True):
    """`[[support]]`: a region that is held, or moved over time."""

    name: Name
    region: Region
    times: Times | None = None
    displacement: RowsOfThree | None = None


class LoadTable(TomlTable, kw_only=True, frozen=True):
    """`[[load]]`: a force over time on a region or on points of the body at rest."""

    name: Name
    region: Region | None = None
    points: RowsOfThree | None = None
    times: Times | None = None
    force: RowsOfThree


class CaseBladeTable(BladeTable, kw_only=True, frozen=True):
    """`[blade]`: the path of a cutting edge, and its shape; without a thickness it is a line."""

    times: Times
    tip: RowsOfThree
    heel: RowsOfThree
    forward: ThreeNumbers


class RecordTable(TomlTable, kw_only=True, frozen=True):
    """`[[record]]`: a quantity that becomes a column of the table."""

    name: Name
    quantity: _Quantity
    component: _Component = "magnitude"
    support: Name | None = None
    point: ThreeNumbers | None = None


class ExpectedTable(TomlTable, kw_only=True, frozen=True):
    """`[[expected]]`: a curve or a value that a record should have."""

    record: Name
    tolerance: Positive
    source: Text
    file: Text | None = None
    against: Name = "time"
    value: Finite | None = None
    from_time: NotNegative = 0.0
    to_time: NotNegative | None = None


class CaseContent(TomlTable, kw_only=True, frozen=True):
    """The whole file."""

    title: Text
    body: BodyTable
    material: PresetMaterialTable
    run: RunTable
    support: list[SupportTable] = field(default_factory=list)
    load: list[LoadTable] = field(default_factory=list)
    blade: CaseBladeTable | None = None
    record: Annotated[list[RecordTable], Meta(min_length=1)]
    expected: list[ExpectedTable] = field(default_factory=list)
