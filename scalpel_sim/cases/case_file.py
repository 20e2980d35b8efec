"""Reads a case from a TOML file, and checks what one table says about another."""

import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from scalpel_sim.cases.tables import BodyTable, CaseContent, ExpectedTable, RecordTable
from scalpel_sim.cases.toml_errors import problem_of
from scalpel_sim.errors import UsageError, unknown

HOW_TO_BEGIN = "docs/cases.md describes case files, and docs/examples has two to start from"

TIME = "time"
"""What a record may be compared against, besides another record."""

_KEYS_OF_SHAPE = {
    "block": (("size", "cells"), ()),
    "lattice": (("size", "cells"), ()),
    "cylinder": (("radius", "height"), ("rings", "layers")),
    "mesh": (("file",), ("scale",)),
}
"""Keys of `[body]` that each shape needs, and those that it may have besides."""

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
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UsageError(
            f"{path} cannot be read: {error.strerror or error}; {HOW_TO_BEGIN}"
        ) from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path} is not a text file; {HOW_TO_BEGIN}") from error
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{path} is not valid TOML: {error}") from error
    try:
        case = CaseFile(path, msgspec.convert(content, CaseContent))
    except msgspec.ValidationError as error:
        raise UsageError(f"{path}: {problem_of(content, CaseContent) or error}") from error
    try:
        _check(case.content)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
    return case


def _check(content: CaseContent) -> None:
    """Check what one table says about another."""
    _check_body(content.body)
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


def _check_body(body: BodyTable) -> None:
    """Check that the keys of the body are those of its shape."""
    needed, possible = _KEYS_OF_SHAPE[body.shape]
    for key in body.__struct_fields__:
        is_given = getattr(body, key) is not None
        if key in needed and not is_given:
            raise UsageError(f'[body] of shape "{body.shape}" has no {key}')
        if key != "shape" and key not in (*needed, *possible) and is_given:
            owner = next(s for s, keys in _KEYS_OF_SHAPE.items() if key in (*keys[0], *keys[1]))
            raise UsageError(
                f'[body] of shape "{body.shape}" has the key {key}, which belongs to shape '
                f'"{owner}"; it has {", ".join((*needed, *possible))}'
            )


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
