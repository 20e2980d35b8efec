"""Reads a TOML file, and checks it against its tables."""

import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.problems import problem_of

SUFFIX = ".toml"
"""What the names of such files end in."""

Content = TypeVar("Content", bound=msgspec.Struct)


def is_toml_file(name: str) -> bool:
    """Whether what was given in place of a name is the name of such a file."""
    return name.lower().endswith(SUFFIX)


def read_toml(path: Path, how_to_begin: str) -> dict[str, Any]:
    """Return what is in a TOML file.

    Args:
        path: The file.
        how_to_begin: Where one to start from comes from, for messages.

    Raises:
        UsageError: the file cannot be read, or is no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UsageError(
            f"{path} cannot be read: {error.strerror or error}; {how_to_begin}"
        ) from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path} is not a text file; {how_to_begin}") from error
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{path} is not valid TOML: {error}; {how_to_begin}") from error


def as_tables(content: dict[str, Any], table: type[Content]) -> Content:
    """Return the content of a file as its tables.

    Raises:
        UsageError: a table, key or value is wrong; the message says where, and what may stand
            there.
    """
    try:
        return msgspec.convert(content, table)
    except msgspec.ValidationError as error:
        raise UsageError(problem_of(content, table) or str(error)) from error
