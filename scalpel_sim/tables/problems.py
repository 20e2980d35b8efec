"""Says what is wrong with the content of a TOML file, and where."""

import types
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from scalpel_sim.errors import UsageError, unknown

Made = TypeVar("Made")
"""What `naming_table` returns."""


def problem_of(content: Mapping[str, Any], table: type[msgspec.Struct]) -> str:
    """Return what is wrong with the content of a file, for people; empty if nothing is.

    Args:
        content: What the file has.
        table: What it should be.
    """
    return _problem(content, table, "", table)


def _problem(
    content: Mapping[str, Any], table: type[msgspec.Struct], where: str, whole: type[msgspec.Struct]
) -> str:
    """Return what is wrong with the content of a table.

    Args:
        content: What the file has.
        table: What it should be.
        where: Name of the table, as a file writes it: "[body]"; empty for the whole file.
        whole: What the whole file should be.
    """
    kinds = get_type_hints(table, include_extras=True)
    for key, value in content.items():
        if key not in kinds:
            return _unknown_key(key, value, kinds, where, whole)
    for field in msgspec.structs.fields(table):
        if field.required and field.name not in content:
            return f"{where or 'the file'} has no {_as_header(field.name, kinds[field.name])}"
    for key, value in content.items():
        problem = _problem_of_value(key, value, kinds[key], where, whole)
        if problem:
            return problem
    return ""


def _unknown_key(
    key: str, value: object, kinds: Mapping[str, Any], where: str, whole: type[msgspec.Struct]
) -> str:
    """Return what is wrong with a key that a table does not have."""
    tables = {
        name: inner
        for name, kind in get_type_hints(whole, include_extras=True).items()
        if (inner := _table_of(kind)) is not None
    }
    owner = next((name for name, table in tables.items() if key in table.__struct_fields__), None)
    if owner is not None and not isinstance(value, Mapping):
        if not where:
            return f"{key} stands in no table; write [{owner}] on a line above it"
        return f"{where} has the key {key}, which belongs to [{owner}]"
    if where:
        return str(unknown(f"key of {where}", key, kinds))
    return str(unknown("table" if isinstance(value, Mapping) else "key", key, kinds))


def naming_table(where: str, make: Callable[[], Made]) -> Made:
    """Return what a function makes; an error of its input says where in the file that stands.

    Args:
        where: Name of a table, as a file writes it.
        make: The function.

    Raises:
        UsageError: the input is wrong.
    """
    try:
        return make()
    except ValueError as error:
        raise UsageError(f"{where}: {error}") from error


def as_toml(value: object) -> str:
    """Return a value as it stands in the file, cut short if it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = f'"{value}"' if isinstance(value, str) else str(value)
    except (ValueError, RecursionError):  # thousands of digits, or of tables in each other
        return "too long to be shown"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _problem_of_value(
    key: str, value: object, kind: Any, where: str, whole: type[msgspec.Struct]
) -> str:
    """Return what is wrong with a value of that type."""
    row = _row_of(kind)
    if row is not None:
        if not isinstance(value, list) or not all(isinstance(each, Mapping) for each in value):
            return f"{key} is {as_toml(value)}; it must be tables: [[{key}]], then a key a line"
        if not value:
            return f"the file has no [[{key}]]"
        problems = (
            _problem(each, row, f"{where} [[{key}]] number {i + 1}".strip(), whole)
            for i, each in enumerate(value)
        )
        return next((problem for problem in problems if problem), "")
    inner = _table_of(kind)
    if inner is not None:
        if not isinstance(value, Mapping):
            return f"{key} is {as_toml(value)}; it must be a table: [{key}], then a key a line"
        return _problem(value, inner, f"[{key}]", whole)
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return f"{where} {key} is {as_toml(value)}; it must be {_allowed(kind)}".strip()
    return ""


def _alternatives(kind: Any) -> Sequence[Any]:
    """Return the types that a value may have, without None."""
    if get_origin(kind) in (typing.Union, types.UnionType):
        return [each for each in get_args(kind) if each is not type(None)]
    return [kind]


def _table_of(kind: Any) -> type[msgspec.Struct] | None:
    """Return the table that a value must be; None where it is none."""
    only = _alternatives(kind)[0]
    return only if isinstance(only, type) and issubclass(only, msgspec.Struct) else None


def _row_of(kind: Any) -> type[msgspec.Struct] | None:
    """Return the table that each row of a value must be; None where it is no array of tables."""
    only = _alternatives(kind)[0]
    if get_origin(only) is typing.Annotated:
        only = get_args(only)[0]
    return _table_of(get_args(only)[0]) if get_origin(only) is list else None


def _as_header(name: str, kind: Any) -> str:
    """Return how a file writes what is missing."""
    if _row_of(kind) is not None:
        return f"[[{name}]]"
    return f"[{name}]" if _table_of(kind) is not None else f"{name}: {_allowed(kind)}"


def _allowed(kind: Any) -> str:
    """Return the description of a type."""
    for each in _alternatives(kind):
        for meta in getattr(each, "__metadata__", ()):
            if meta.description:
                return str(meta.description)
    return "another value"
