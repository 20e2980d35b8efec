"""A case: a scene whose supports, loads and blade follow tables of time, with expectations."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, field

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.body import KEYS_OF_SHAPE, BodyTable
from scalpel_sim.scene.checks import check_different
from scalpel_sim.scene.read import read_scene_file, with_files
from scalpel_sim.scene.schema import BladeTable, PresetMaterialTable
from scalpel_sim.tables.problems import check_keys
from scalpel_sim.tables.text_files import as_tables, read_toml
from scalpel_sim.tables.values import (
    FileName,
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

TIME = "time"
"""References of a record, besides another record."""

_HOW_TO_BEGIN = "docs/scenes.md#cases describes case files, and docs/examples has two to start from"

_OF_BLADE = ("blade_force", "blade_position", "cut_area")
"""Quantities that need a blade."""

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
    """Time to simulate [s]."""
    dt: Positive = 1e-3
    """Time step [s]."""
    record_every: Positive = 1e-2
    """Time between two rows of the table [s]."""
    gravity: ThreeNumbers = (0.0, 0.0, 0.0)
    """Gravity [m/s2]."""
    settle: TrueOrFalse = False
    """Whether the body first comes to rest under gravity and the loads of time 0."""
    relaxation: _Relaxation = "global"
    """Method that advances the motion: global or verlet."""


class SupportTable(TomlTable, kw_only=True, frozen=True):
    """`[[support]]`: a region that is held, or moved over time."""

    name: Name
    """Name of the support."""
    region: Region
    """Region whose nodes are held in all directions, as glue would; regions may not overlap."""
    times: Times | None = None
    """Times of the rows of `displacement` [s]."""
    displacement: RowsOfThree | None = None
    """Displacement, a row for each time [m]."""


class LoadTable(TomlTable, kw_only=True, frozen=True):
    """`[[load]]`: a force over time on a region or on points of the body at rest."""

    name: Name
    """Name of the load."""
    region: Region | None = None
    """Region on which it is a traction, the same on each area of its skin at rest."""
    points: RowsOfThree | None = None
    """Points of the body at rest that share it evenly, in place of a region [m]."""
    times: Times | None = None
    """Times of the rows of `force` [s]."""
    force: RowsOfThree
    """Force, a row for each time [N]; its direction does not turn with the body."""


class CaseBladeTable(BladeTable, kw_only=True, frozen=True):
    """`[blade]` of a case: the path of an edge, and its shape; without a thickness it is a line."""

    times: Times
    """Times of the rows of `tip` and `heel` [s]."""
    tip: RowsOfThree
    """Where the tip is, a row for each time [m]."""
    heel: RowsOfThree
    """Where the heel is, a row for each time [m]."""
    forward: ThreeNumbers
    """Direction in which it cuts."""


class RecordTable(TomlTable, kw_only=True, frozen=True):
    """`[[record]]`: a quantity that becomes a column of the table."""

    name: Name
    """Name of the column."""
    quantity: _Quantity
    """`"reaction"`, the force of a support on the tissue [N]; `"displacement"` of a point [m];
    `"blade_force"` on the blade, averaged over the interval [N]; `"blade_position"` of the tip [m];
    or `"cut_area"` [m2]. All but the force on the blade are those of the instant."""
    component: _Component = "magnitude"
    """Component of the vector: `"x"`, `"y"`, `"z"` or `"magnitude"`."""
    support: Name | None = None
    """Support of a reaction."""
    point: ThreeNumbers | None = None
    """Point of the body at rest whose displacement it is [m]."""


class ExpectedTable(TomlTable, kw_only=True, frozen=True):
    """`[[expected]]`: a curve or a value that a record should have."""

    record: Name
    """Record that is compared."""
    tolerance: Positive
    """Largest deviation, as a share of the value or of the largest magnitude of the curve."""
    source: Text
    """Where the figures come from."""
    file: FileName | None = None
    """CSV file of a curve: a line of names and two columns, the first ascending."""
    against: Name = TIME
    """Abscissa of a curve: time, or another record."""
    value: Finite | None = None
    """Value of the mean of the record from `from_time` to `to_time`, in place of a curve."""
    from_time: NotNegative = 0.0
    """When the comparison begins [s]."""
    to_time: NotNegative | None = None
    """When it ends [s]; at the end of the run without."""


class CaseContent(TomlTable, kw_only=True, frozen=True):
    """The whole file of a case."""

    title: Text
    """Title of its plots."""
    body: BodyTable
    """The geometry."""
    material: PresetMaterialTable
    """The material."""
    run: RunTable
    """Duration, and method."""
    support: list[SupportTable] = field(default_factory=list)
    """Supports of the body."""
    load: list[LoadTable] = field(default_factory=list)
    """Loads on it."""
    blade: CaseBladeTable | None = None
    """Cuts through it."""
    record: Annotated[list[RecordTable], Meta(min_length=1)]
    """Records of it."""
    expected: list[ExpectedTable] = field(default_factory=list)
    """Values that the records should have."""


def is_case(path: Path) -> bool:
    """Return whether a TOML file is that of a case, which records, and not of a scene.

    Raises:
        UsageError: the file cannot be read.
    """
    return "record" in read_scene_file(path).content


def read_case(path: Path) -> CaseContent:
    """Return the case in a file.

    Raises:
        UsageError: the file cannot be read, or a table, key or value is wrong.
    """
    content = with_files(
        read_toml(path, _HOW_TO_BEGIN), lambda name: str(path.parent / name), CaseContent
    )
    try:
        case = as_tables(content, CaseContent)
        _check(case)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
    return case


def _check(case: CaseContent) -> None:
    """Check what one table says about another."""
    check_keys(case.body, "[body]", "shape", KEYS_OF_SHAPE)
    run = case.run
    if not run.dt <= run.record_every <= run.seconds:
        raise UsageError(
            f"[run] dt is {run.dt} s, record_every {run.record_every} s and seconds {run.seconds} "
            "s; they must not get smaller in this order"
        )
    records = [TIME, *(each.name for each in case.record)]
    check_different("support", (each.name for each in case.support))
    check_different("load", (each.name for each in case.load))
    check_different("record", records)
    for support in case.support:
        _check_support(support)
    for load in case.load:
        if (load.region is None) == (load.points is None):
            raise UsageError(
                f"[[load]] {load.name} has {_has(load, 'region', 'points')}; give one of the two"
            )
    for record in case.record:
        _check_record(record, case)
    for expected in case.expected:
        _check_expected(expected, records)


def _check_support(support: SupportTable) -> None:
    """Check that a support that moves has times and rows, and begins where it is."""
    where = f"[[support]] {support.name}"
    if (support.times is None) != (support.displacement is None):
        raise UsageError(
            f"{where} has {_has(support, 'times', 'displacement')}; one that moves has both, one "
            "that is held has neither"
        )
    if support.displacement and any(support.displacement[0]):
        raise UsageError(
            f"{where} starts at displacement {list(support.displacement[0])}; the first row must "
            "be [0, 0, 0]"
        )


def _check_record(record: RecordTable, case: CaseContent) -> None:
    """Check that a record says what it is a record of."""
    where = f"[[record]] {record.name}"
    needs = {"reaction": "support", "displacement": "point"}.get(record.quantity)
    for key in ("support", "point"):
        is_given = getattr(record, key) is not None
        if is_given != (key == needs):
            problem = "has the key" if is_given else "has no"
            raise UsageError(f"{where} of quantity {record.quantity} {problem} {key}")
    if record.support is not None:
        names = [each.name for each in case.support]
        if record.support not in names:
            raise UsageError(f"{where}: {unknown('support', record.support, names)}")
    if record.quantity in _OF_BLADE and case.blade is None:
        raise UsageError(f"{where} of quantity {record.quantity} needs a [blade]")


def _check_expected(expected: ExpectedTable, names: Sequence[str]) -> None:
    """Check that what is expected is of a record, and is a curve or a value."""
    where = f"[[expected]] of {expected.record}"
    for name in (expected.record, expected.against):
        if name not in names:
            raise UsageError(f"{where}: {unknown('record', name, names)}")
    if (expected.file is None) == (expected.value is None):
        raise UsageError(
            f"{where} has {_has(expected, 'file', 'value')}; give a file with a curve, or a value"
        )
    if expected.value == 0.0:
        raise UsageError(
            f"{where}: the value is 0, and the tolerance is a share of it; compare another record"
        )
    if expected.value is not None and expected.against != TIME:
        raise UsageError(f"{where}: against belongs to a curve (file); a value has from_time")


def _has(table: msgspec.Struct, *keys: str) -> str:
    """Return which of some keys are given."""
    return " and ".join(f"no {key}" if getattr(table, key) is None else key for key in keys)
