"""Finds what is wrong with the content of a TOML file, and where."""

import re
import typing
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, get_args, get_origin

import msgspec

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.tables.values import Kind

REPLACED: dict[tuple[str, ...], str] = {
    ("solver", "contact"): "contact is always by forces since version 0.2, and there is none with "
    "relaxation hierarchical; omit it",
}
"""Keys of earlier versions, and what stands in their place."""

_Table = type[msgspec.Struct]

_STEP = re.compile(r"\.(\w+)|\[(\d+)\]")
"""A part of the path of an error: a key, or the number of a row."""


class Problem(NamedTuple):
    """A key or a value that is wrong."""

    text: str
    """Fault, its place, and what may stand there."""
    key: tuple[str, ...]
    """Parts of the key; rows are counted from 0."""


def problem_of(content: Mapping[str, Any], table: _Table) -> Problem | None:
    """Return the first problem of the content of a file, for people; None if there is none.

    Args:
        content: Content of the file.
        table: Its schema.
    """
    try:
        msgspec.convert(content, table)
    except msgspec.ValidationError as error:
        what, _, path = str(error).partition(" - at `$")
        return _problem_at(_STEP.findall(path), what, content, table)
    return None


def _problem_at(
    steps: Sequence[tuple[str, str]], what: str, content: Mapping[str, Any], whole: _Table
) -> Problem:
    """Return the problem of a file for people.

    Args:
        steps: Path to the problem: keys, and numbers of rows from 0 on.
        what: Problem as `msgspec` names it.
        content: Content of the file.
        whole: Its schema.
    """
    table, where, value, at = whole, "", content, tuple[str, ...]()
    rest = list(steps)
    while rest:
        key, _ = rest.pop(0)
        kind, value, at = kinds_of(table)[key], value[key], (*at, key)
        row, inner = row_table_of(kind), table_of(kind)
        if row is not None and (inner is None or isinstance(value, list)):
            i = int(rest.pop(0)[1]) if rest else 0
            if not isinstance(value, list) or not all(isinstance(each, Mapping) for each in value):
                what = f"tables: [[{key}]], then a key a line"
                return Problem(f"{key} is {as_toml(value)}; it must be {what}", at)
            if not value:
                return Problem(f"the file has no [[{key}]]", at)
            table, where, at = row, f"{where} [[{key}]] number {i + 1}".strip(), (*at, str(i))
            value = value[i]
        elif inner is not None:
            if not isinstance(value, Mapping):
                what = f"a table: [{key}], then a key a line"
                return Problem(f"{key} is {as_toml(value)}; it must be {what}", at)
            table, where = inner, f"[{key}]"
        else:
            text = f"{where} {key} is {as_toml(value)}; it must be {_allowed(kind)}"
            return Problem(text.strip(), at)
    kinds = kinds_of(table)
    name = "".join(re.findall("^Object .*`(.*)`$", what))
    if not name:
        return Problem(f"{where}: {what}", at)
    if name in kinds:
        return Problem(f"{where or 'the file'} has no {_as_header(name, kinds[name])}", at)
    return Problem(_unknown_key(name, value[name], kinds, where, at, whole), (*at, name))


def check_keys(table: msgspec.Struct, where: str, kind_key: str, kinds: Mapping[str, Kind]) -> None:
    """Check that the keys of a table are those of its kind. Keys of no kind belong to all.

    Args:
        table: The table; a key that is not given is None.
        where: Its name as a file writes it.
        kind_key: The key that says of which kind it is.
        kinds: The keys of each kind.

    Raises:
        UsageError: one is missing, or belongs to another kind.
    """
    kind = getattr(table, kind_key)
    own = kinds[kind]
    for key in own.needed:
        if getattr(table, key) is None:
            raise UsageError(f'{where} of {kind_key} "{kind}" has no {key}')
    for owner, keys in kinds.items():
        for key in (*keys.needed, *keys.possible):
            if key not in (*own.needed, *own.possible) and getattr(table, key) is not None:
                keys_of_own = ", ".join((*own.needed, *own.possible)) or f"none besides {kind_key}"
                raise UsageError(
                    f'{where} of {kind_key} "{kind}" has the key {key}, which belongs to '
                    f'{kind_key} "{owner}"; it has {keys_of_own}'
                )


def kinds_of(table: _Table) -> dict[str, Any]:
    """Return the type of each key of a table."""
    return {field.encode_name: field.type for field in msgspec.structs.fields(table)}


def alternatives(kind: Any) -> Sequence[Any]:
    """Return the types that a value may have, without None."""
    if get_origin(kind) in (typing.Union, typing.get_origin(int | None)):
        return [each for each in get_args(kind) if each is not type(None)]
    return [kind]


def table_of(kind: Any) -> _Table | None:
    """Return the table that a value may be; None where it is none."""
    for each in alternatives(kind):
        if isinstance(each, type) and issubclass(each, msgspec.Struct):
            return each
    return None


def row_table_of(kind: Any) -> _Table | None:
    """Return the table that each row of a value may be; None where it is no array of tables."""
    for each in alternatives(kind):
        only = get_args(each)[0] if get_origin(each) is typing.Annotated else each
        if get_origin(only) in (list, tuple) and (row := table_of(get_args(only)[0])) is not None:
            return row
    return None


def metas_of(kind: Any) -> list[msgspec.Meta]:
    """Return the descriptions of a type."""
    return [meta for each in alternatives(kind) for meta in getattr(each, "__metadata__", ())]


def as_toml(value: object) -> str:
    """Return a value as it stands in the file, cut short if it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = f'"{value}"' if isinstance(value, str) else str(value)
    except (ValueError, RecursionError):  # thousands of digits, or of tables in each other
        return "too long to be shown"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _unknown_key(
    key: str,
    value: object,
    kinds: Mapping[str, Any],
    where: str,
    at: tuple[str, ...],
    whole: _Table,
) -> str:
    """Return what is wrong with a key that a table does not have."""
    if (*at, key) in REPLACED:
        return f"{where} {key}: {REPLACED[(*at, key)]}"
    tables = {name: table_of(kind) for name, kind in kinds_of(whole).items()}
    owners = [name for name, table in tables.items() if table and key in kinds_of(table)]
    if owners and not isinstance(value, Mapping):
        if not where:
            return f"{key} stands in no table; write [{owners[0]}] on a line above it"
        return f"{where} has the key {key}, which belongs to [{owners[0]}]"
    if where:
        return str(unknown(f"key of {where}", key, kinds))
    return str(unknown("table" if isinstance(value, Mapping) else "key", key, kinds))


def _as_header(name: str, kind: Any) -> str:
    """Return how a file writes what is missing."""
    if table_of(kind) is not None:
        return f"[{name}]"
    return f"[[{name}]]" if row_table_of(kind) is not None else f"{name}: {_allowed(kind)}"


def _allowed(kind: Any) -> str:
    """Return the description of a type."""
    return next((meta.description for meta in metas_of(kind) if meta.description), "another value")
