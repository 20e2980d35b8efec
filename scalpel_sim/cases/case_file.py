"""Reads a case from a TOML file, and checks what one table says about another."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from scalpel_sim.cases.tables import CaseContent, ExpectedTable, RecordTable
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.tables.body import KEYS_OF_SHAPE
from scalpel_sim.tables.kinds import check_keys
from scalpel_sim.tables.toml import as_tables, read_toml

HOW_TO_BEGIN = "docs/cases.md describes case files, and docs/examples has two to start from"

TIME = "time"
"""What a record may be compared against, besides another record."""

_OF_BLADE = ("blade_force", "blade_position", "cut_area")
"""Quantities that need a blade."""


class CaseFile(NamedTuple):
    """A case as its file describes it."""

    path: Path
    """The file."""
    content: CaseContent

    def file(self, name: str) -> Path:
        """Return the path of a file that the case names: relative to its own."""
        return self.path.parent / name


def read_case(path: Path) -> CaseFile:
    """Return the case in a file.

    Raises:
        UsageError: the file cannot be read, or a table, key or value is wrong.
    """
    content = read_toml(path, HOW_TO_BEGIN)
    try:
        case = CaseFile(path, as_tables(content, CaseContent))
        _check(case.content)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
    return case


def _check(content: CaseContent) -> None:
    """Check what one table says about another."""
    check_keys(content.body, "[body]", "shape", KEYS_OF_SHAPE)
    run = content.run
    if not run.dt <= run.record_every <= run.seconds:
        raise UsageError(
            f"[run] dt is {run.dt} s, record_every {run.record_every} s and seconds {run.seconds} "
            "s; they must not get smaller in this order"
        )
    for kind, names in (
        ("support", [each.name for each in content.support]),
        ("load", [each.name for each in content.load]),
        ("record", [TIME, *(each.name for each in content.record)]),
    ):
        _expect_different(kind, names)
    for support in content.support:
        if (support.times is None) != (support.displacement is None):
            raise UsageError(
                f"[[support]] {support.name} has {_has(support.times, 'times')} and "
                f"{_has(support.displacement, 'displacement')}; one that moves has both, one that "
                "is held has neither"
            )
        if support.displacement and any(support.displacement[0]):
            raise UsageError(
                f"[[support]] {support.name} starts at displacement "
                f"{list(support.displacement[0])}; the first row must be [0, 0, 0]"
            )
    for load in content.load:
        if (load.region is None) == (load.points is None):
            raise UsageError(
                f"[[load]] {load.name} has {_has(load.region, 'region')} and "
                f"{_has(load.points, 'points')}; give one of the two"
            )
    for record in content.record:
        _check_record(record, content)
    for expected in content.expected:
        _check_expected(expected, [TIME, *(each.name for each in content.record)])


def _check_record(record: RecordTable, content: CaseContent) -> None:
    """Check that a record says what it is a record of."""
    where = f"[[record]] {record.name}"
    needs = {"reaction": "support", "displacement": "point"}.get(record.quantity)
    for key in ("support", "point"):
        is_given = getattr(record, key) is not None
        if is_given != (key == needs):
            problem = "has the key" if is_given else "has no"
            raise UsageError(f"{where} of quantity {record.quantity} {problem} {key}")
    if record.support is not None:
        names = [each.name for each in content.support]
        if record.support not in names:
            raise UsageError(f"{where}: {unknown('support', record.support, names)}")
    if record.quantity in _OF_BLADE and content.blade is None:
        raise UsageError(f"{where} of quantity {record.quantity} needs a [blade]")


def _check_expected(expected: ExpectedTable, names: Sequence[str]) -> None:
    """Check that what is expected is of a record, and is a curve or a value."""
    where = f"[[expected]] of {expected.record}"
    for name in (expected.record, expected.against):
        if name not in names:
            raise UsageError(f"{where}: {unknown('record', name, names)}")
    if (expected.file is None) == (expected.value is None):
        raise UsageError(
            f"{where} has {_has(expected.file, 'file')} and {_has(expected.value, 'value')}; give "
            "a file with a curve, or a value"
        )
    if expected.value == 0.0:
        raise UsageError(
            f"{where}: the value is 0, and the tolerance is a share of it; compare another record"
        )
    if expected.value is not None and expected.against != TIME:
        raise UsageError(f"{where}: against belongs to a curve (file); a value has from_time")


def _expect_different(kind: str, names: Iterable[str]) -> None:
    """Refuse a name that two tables of a kind have."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise UsageError(f"two of [[{kind}]] are called {name}; choose another name for one")
        seen.add(name)


def _has(value: object, key: str) -> str:
    """Say whether a key is given."""
    return f"no {key}" if value is None else key
