"""Lines of a CSV file: the motion of an instrument, or a curve."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.text_files import read_text_file

LARGEST_MOTION = 1 << 29
"""Largest file of a motion [byte]: about an hour of a hand with a row each millisecond."""


class StrokeError(UsageError):
    """A path that no blade can follow, or that does not lead through the body."""


def numbered_lines(path: Path, what: str, columns: Sequence[str]) -> list[tuple[int, list[str]]]:
    """Return the number and the cells of each line; the first names the columns.

    Empty lines, and lines that start with #, are left out.

    Args:
        path: The file.
        what: What it holds, for messages.
        columns: Columns that it must have, for messages.

    Raises:
        StrokeError: no such file, no text, more than `LARGEST_MOTION`, nothing in it, or a line
            that is no CSV.
    """
    try:
        lines = read_text_file(path, LARGEST_MOTION).splitlines()
    except UsageError as error:
        raise StrokeError(f"cannot read the {what} {path}: {error}") from error
    numbered = [
        (number, _cells(path, number, line))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise StrokeError(f"{path} is empty; its first line is {','.join(columns)}")
    return numbered


def _cells(path: Path, number: int, line: str) -> list[str]:
    """Return the cells of a line."""
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise StrokeError(f"{path}, line {number}: it cannot be read as CSV: {error}") from error


def numbers_of(path: Path, number: int, cells: list[str], columns: list[int]) -> list[float]:
    """Return the numbers of one line, in the order of the columns.

    Args:
        path: The file, for messages.
        number: Number of the line.
        cells: Its cells.
        columns: Which of them are wanted: all, in some order.

    Raises:
        StrokeError: another number of cells, or one that is no finite number.
    """
    if len(cells) != len(columns):
        raise StrokeError(f"{path}, line {number}: {len(cells)} values, wanted {len(columns)}")
    values = []
    for column in columns:
        try:
            value = float(cells[column])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise StrokeError(f"{path}, line {number}: '{cells[column]}' is not a finite number")
        values.append(value)
    return values
