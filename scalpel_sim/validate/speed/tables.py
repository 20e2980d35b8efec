"""Measurements as a table; every row says its unit."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from scalpel_sim.validate.speed.measurements import Measurement, Skipped

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def three_digits(value: float) -> str:
    """Return a number with three significant digits, written out where it is large."""
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def print_measurements(
    title: str,
    measurements: Sequence[Measurement],
    skipped: Sequence[Skipped],
    console: "Console",
    *,
    about: str,
) -> None:
    """Print a row for each measurement, why others are missing, and an explanation.

    Args:
        title: Title of the table.
        measurements: The rows.
        skipped: What was not measured.
        console: Where to print.
        about: Explanation below the table.
    """
    table = compact_table(title)
    table.add_column("case")
    with_bodies = any(each.tetrahedra is not None for each in measurements)
    for heading in ("tetrahedra",) * with_bodies + ("median", "p95", "p99", "n"):
        table.add_column(heading, justify="right")
    for heading in ("unit", "clock"):
        table.add_column(heading)
    for each in measurements:
        size = "" if each.tetrahedra is None else f"{each.tetrahedra:,}"
        table.add_row(
            each.case,
            *(size,) * with_bodies,
            *map(three_digits, (each.median, each.p95, each.p99)),
            f"{each.n:,}",
            each.unit,
            each.clock,
        )
    console.print(table)
    for size_of_note, note in dict.fromkeys((m.tetrahedra, m.note) for m in measurements if m.note):
        text = note if size_of_note is None else f"{size_of_note:,} tetrahedra: {note}"
        console.print(text, style="dim")
    print_skipped(skipped, console)
    console.print(about, style="dim")


def compact_table(title: str) -> "Table":
    """Return an empty table that fits a narrow terminal."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    return Table(
        title=title,
        title_justify="left",
        box=SIMPLE_HEAD,
        collapse_padding=True,
        pad_edge=False,
    )


def print_skipped(skipped: Sequence[Skipped], console: "Console") -> None:
    """Print what was not measured, one line for each reason."""
    for reason in dict.fromkeys(each.reason for each in skipped):
        same = [each for each in skipped if each.reason == reason]
        cases = ", ".join(dict.fromkeys(each.case for each in same))
        sizes = dict.fromkeys(f"{e.tetrahedra:,}" for e in same if e.tetrahedra is not None)
        bodies = f" in {', '.join(sizes)} tetrahedra" if sizes else ""
        console.print(f"not measured: {cases}{bodies}: {reason}", style="dim")
