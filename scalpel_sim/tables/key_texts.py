"""The meaning of each key: the text below it in the schema, and its usual value."""

import ast
import inspect
import textwrap
from functools import cache
from typing import Any

import msgspec


@cache
def texts_of(table: type[msgspec.Struct]) -> dict[str, str]:
    """Return the text below each key of a table, in one line, those of its bases first."""
    found: dict[str, str] = {}
    for each in reversed(table.__mro__):
        if each is not msgspec.Struct and issubclass(each, msgspec.Struct):
            found |= _texts_in(each)
    return found


def _texts_in(table: type) -> dict[str, str]:
    """Return the texts in the body of one class."""
    (made,) = ast.parse(textwrap.dedent(inspect.getsource(table))).body
    assert isinstance(made, ast.ClassDef)
    found = {}
    for key, text in zip(made.body, made.body[1:], strict=False):
        if (
            isinstance(key, ast.AnnAssign)
            and isinstance(key.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
        ):
            found[key.target.id] = " ".join(str(text.value.value).split())
    return found


def has_usual(field: msgspec.structs.FieldInfo) -> bool:
    """Return whether a key has a usual value that a text can show."""
    return field.default not in (msgspec.NODEFAULT, None, (), "")


def usual_text(value: Any) -> str:
    """Return a usual value as a text shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return f"[{', '.join(f'{each:g}' for each in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def with_note(text: str, note: str) -> str:
    """Return a text with a note in brackets at the end of its first sentence, with its unit."""
    first, stop, rest = text.partition(". ")
    first = first.rstrip(".")
    first = f"{first[:-1]}; {note}]" if first.endswith("]") else f"{first} [{note}]"
    return f"{first}{stop}{rest}" if stop else f"{first}."
