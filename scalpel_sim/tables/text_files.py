"""Reads text files and TOML files whose name may come from somebody else's file."""

import re
import stat
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.problems import problem_of

SUFFIX = ".toml"
"""End of the names of such files."""

LARGEST_FILE = 1 << 22
"""Largest file [byte]: those that people write have some thousand."""

MOST_PARTS = 20
"""Parts of a key at most. Those of our files have one to three; Python's parser takes memory by the
square of their number, 250 MB for 8,000."""

_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w.-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")

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
        UsageError: the file cannot be read, has more than `LARGEST_FILE` or a key of more than
            `MOST_PARTS`, or is no TOML.
    """
    try:
        text = read_text_file(path, LARGEST_FILE)
    except UsageError as error:
        raise UsageError(f"{path} cannot be read: {error}; {how_to_begin}") from error
    if _LONG_KEY.search(text):
        raise UsageError(
            f"{path} cannot be read: a key in it has more than {MOST_PARTS} parts; {how_to_begin}"
        )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{path} is not valid TOML: {error}; {how_to_begin}") from error
    except ValueError as error:
        raise UsageError(
            f"{path} cannot be read: an integer in it has thousands of digits; {how_to_begin}"
        ) from error
    except RecursionError as error:
        raise UsageError(
            f"{path} cannot be read: its brackets are nested too deep; {how_to_begin}"
        ) from error


def as_tables(content: dict[str, Any], table: type[Content]) -> Content:
    """Return the content of a file as its tables.

    Raises:
        UsageError: a table, key or value is wrong; the message says where, and what may stand
            there.
    """
    try:
        return msgspec.convert(content, table)
    except msgspec.ValidationError as error:
        problem = problem_of(content, table)
        raise UsageError(str(error) if problem is None else problem.text) from error


def read_text_file(path: Path, most_bytes: int) -> str:
    """Return the text of a regular file, without a byte order mark.

    Args:
        path: The file.
        most_bytes: Size of the largest that is read [byte].

    Raises:
        UsageError: it cannot be read, or is too large; the message has the reason alone.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise UsageError("it is a folder, a device or a pipe; give a file")
        if status.st_size > most_bytes:
            raise UsageError(f"it has {status.st_size} bytes; give one of at most {most_bytes}")
        with path.open(encoding="utf-8-sig") as file:
            return file.read(status.st_size)  # a file of /proc may never end
    except OSError as error:
        raise UsageError(error.strerror or str(error)) from error
    except UnicodeDecodeError as error:
        raise UsageError("it is not a text file") from error
