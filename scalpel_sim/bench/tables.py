"""Figures as a table for a person; every column says its unit."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from scalpel_sim.bench.results import Figure, Skipped

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def number(value: float) -> str:
    """Return three digits that count, without powers of ten where a person can do without."""
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def print_figures(
    title: str,
    figures: Sequence[Figure],
    skipped: Sequence[Skipped],
    console: "Console",
    *,
    about: str,
) -> None:
    """Print a row for each figure, why others are missing, and what it is all about."""
    table = compact(title)
    table.add_column("case")
    with_bodies = any(figure.tetrahedra is not None for figure in figures)
    for heading in ("tetrahedra",) * with_bodies + ("median", "p95", "p99", "n"):
        table.add_column(heading, justify="right")
    for heading in ("unit", "clock"):
        table.add_column(heading)
    for figure in figures:
        size = "" if figure.tetrahedra is None else f"{figure.tetrahedra:,}"
        table.add_row(
            figure.case,
            *(size,) * with_bodies,
            *map(number, (figure.median, figure.p95, figure.p99)),
            f"{figure.n:,}",
            figure.unit,
            figure.clock,
        )
    console.print(table)
    for of, note in dict.fromkeys((f.tetrahedra, f.note) for f in figures if f.note):
        console.print(note if of is None else f"{of:,} tetrahedra: {note}", style="dim")
    print_skipped(skipped, console)
    console.print(about, style="dim")


def compact(title: str) -> "Table":
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
    """Print what was not measured, and why: one line for each reason."""
    for reason in dict.fromkeys(each.reason for each in skipped):
        same = [each for each in skipped if each.reason == reason]
        cases = ", ".join(dict.fromkeys(each.case for each in same))
        sizes = dict.fromkeys(f"{e.tetrahedra:,}" for e in same if e.tetrahedra is not None)
        bodies = f" in {', '.join(sizes)} tetrahedra" if sizes else ""
        console.print(f"not measured: {cases}{bodies}: {reason}", style="dim")
