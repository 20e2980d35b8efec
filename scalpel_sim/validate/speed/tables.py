"""Tables of measurements, and the comparison of two runs, with verdicts where they are sure."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from scalpel_sim.validate.speed.measurements import (
    COUNTED,
    HIGHER,
    NEITHER,
    WALL,
    BenchmarkResult,
    Clock,
    Measurement,
    Quantity,
    SavedResults,
    Skipped,
    summarise_times,
    summarise_values,
)
from tissue import FloatArray

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

FEWEST_ROUNDS = 4
"""With fewer rounds on either side there is no verdict. By chance the medians of four and four
rounds do not overlap in 2 of 70 comparisons, those of three and three rounds in 1 of 10."""

DRIFT = 0.1
"""Smaller relative changes get no verdict. Two runs of the same program on a shared machine
differed by up to this much although the rounds within each run agreed far better: a neighbour may
occupy caches and memory for a whole run."""

TIME_UNITS = {"ms": 1e3, "µs": 1e6, "ns": 1e9}
"""Units of times, in a second."""

BUSY = 0.5
"""Mean number of running programs above which the machine counts as shared."""

FASTER, SLOWER, SAME = "faster", "slower", "same"
TOO_FEW = "too few rounds"
NOT_COMPARED = "not compared"
"""Verdict on a quantity of which neither higher nor lower values are better."""


class Comparison(NamedTuple):
    """One quantity, measured before and now."""

    before: Measurement
    now: Measurement
    ratio: float
    """Factor by which it is better now: above 1 is faster."""
    verdict: str


def three_digits(value: float) -> str:
    """Return a number with three significant digits, written out where it is large."""
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


class Rows:
    """The measurements of a benchmark, which are printed as a row each.

    Args:
        benchmark: Name of the benchmark.
        clock: Clock of its times.
    """

    def __init__(self, benchmark: str, clock: Clock = WALL) -> None:
        self.benchmark = benchmark
        self._clock = clock
        self.measured: list[Measurement] = []
        self.skipped: list[Skipped] = []

    def times(
        self,
        case: str,
        size: int | None,
        rounds: Sequence[FloatArray],
        unit: str = "ms",
        *,
        per: float = 1.0,
        quantity: str = "time",
        note: str = "",
    ) -> None:
        """Add a time.

        Args:
            case: What was timed.
            size: Size of the body [tetrahedra].
            rounds: Samples [s], an array for each round.
            unit: A unit of `TIME_UNITS`, or one of them per something.
            per: Number of these things.
            quantity: Name of the time.
            note: What to know before comparing it with another.
        """
        factor = TIME_UNITS[unit.partition("/")[0]] / per
        what = Quantity(self.benchmark, case, size, quantity, unit, self._clock.name, note=note)
        self.measured.append(summarise_times(what, rounds, lambda s: factor * s))

    def values(
        self,
        case: str,
        size: int | None,
        values: Sequence[float],
        unit: str,
        *,
        quantity: str | None = None,
        better: str = NEITHER,
        clock: str = COUNTED,
    ) -> None:
        """Add a quantity with one value for each round.

        Args:
            case: What was measured.
            size: Size of the body [tetrahedra].
            values: The values.
            unit: Their unit.
            quantity: Name of the quantity; the case by default.
            better: Which values are better.
            clock: Name of the clock that the values depend on.
        """
        what = Quantity(self.benchmark, case, size, quantity or case, unit, clock, better)
        self.measured.append(summarise_values(what, values))

    def skip(self, case: str, size: int | None, reason: str) -> None:
        """Note that something was not measured, and why."""
        self.skipped.append(Skipped(self.benchmark, case, size, reason))

    def table(self, title: str, about: str) -> BenchmarkResult:
        """Return the result, with a title of its table and an explanation below."""
        return BenchmarkResult(
            self.measured, self.skipped, partial(self._print, title=title, about=about)
        )

    def _print(self, console: "Console", title: str, about: str) -> None:
        """Print a row for each measurement."""
        with_bodies = any(each.tetrahedra is not None for each in self.measured)
        right = ("tetrahedra",) * with_bodies + ("median", "p95", "p99", "n")
        table = compact_table(title, ("case",), right, ("unit", "clock"))
        for each in self.measured:
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
        noted = [(each.tetrahedra, each.note) for each in self.measured if each.note]
        for of_body, note in dict.fromkeys(noted):
            text = note if of_body is None else f"{of_body:,} tetrahedra: {note}"
            console.print(text, style="dim")
        print_notes(about, self.skipped, console)


def compact_table(
    title: str, left: Sequence[str], right: Sequence[str], last: Sequence[str] = ()
) -> "Table":
    """Return a table without rows that fits a narrow terminal.

    Args:
        title: Title of the table.
        left: Headings of the first columns, of texts.
        right: Headings of the columns of numbers.
        last: Headings of the last columns, of texts.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=title,
        title_justify="left",
        box=SIMPLE_HEAD,
        collapse_padding=True,
        pad_edge=False,
    )
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    for heading in last:
        table.add_column(heading)
    return table


def print_notes(about: str, skipped: Sequence[Skipped], console: "Console") -> None:
    """Print what was not measured, one line for each reason, and an explanation of the table."""
    for reason in dict.fromkeys(each.reason for each in skipped):
        same = [each for each in skipped if each.reason == reason]
        cases = ", ".join(dict.fromkeys(each.case for each in same))
        sizes = dict.fromkeys(f"{e.tetrahedra:,}" for e in same if e.tetrahedra is not None)
        bodies = f" in {', '.join(sizes)} tetrahedra" if sizes else ""
        console.print(f"not measured: {cases}{bodies}: {reason}", style="dim")
    console.print(about, style="dim")


def compare_measurements(
    before: Sequence[Measurement], now: Sequence[Measurement]
) -> list[Comparison]:
    """Return a comparison for each quantity that was measured both times."""
    known = {_key(each): each for each in before}
    return [_compare(known[_key(each)], each) for each in now if _key(each) in known]


def print_comparison(before: SavedResults, now: SavedResults, console: "Console") -> None:
    """Print every quantity that can be compared, and what differs between the two runs."""
    table = compact_table(
        "compared", ("case",), ("tetrahedra", "before", "now", "unit", "ratio"), ("verdict",)
    )
    for each in compare_measurements(before.measurements, now.measurements):
        measured = each.now
        if measured.better == NEITHER:
            continue
        table.add_row(
            f"{measured.benchmark}, {measured.case}",
            "" if measured.tetrahedra is None else f"{measured.tetrahedra:,}",
            f"{each.before.median:.4g}",
            f"{measured.median:.4g}",
            measured.unit,
            f"{each.ratio:.2f}",
            each.verdict,
        )
    console.print(table)
    for line in (*_changed_circumstances(before, now), *_without_partner(before, now)):
        console.print(line, style="dim")
    console.print(
        "Ratio: above 1 is faster now. A verdict needs medians of the rounds that do not "
        f"overlap, {FEWEST_ROUNDS} rounds on either side, and a change of more than "
        f"{DRIFT:.0%}, as two runs of one program on a shared machine differ. Wall times include "
        "other work on the machine.",
        style="dim",
    )


def is_busy(results: SavedResults) -> bool:
    """Return whether other programs ran on the machine when the benchmark began."""
    return results.load > BUSY


def _key(measurement: Measurement) -> tuple[object, ...]:
    """Return what two measurements of the same quantity have in common."""
    return (
        measurement.benchmark,
        measurement.case,
        measurement.tetrahedra,
        measurement.quantity,
        measurement.unit,
    )


def _compare(before: Measurement, now: Measurement) -> Comparison:
    if now.better == NEITHER:
        return Comparison(before, now, 1.0, NOT_COMPARED)
    ratio = now.median / before.median if now.better == HIGHER else before.median / now.median
    if min(before.rounds, now.rounds) < FEWEST_ROUNDS:
        return Comparison(before, now, ratio, TOO_FEW)
    is_apart = now.lowest > before.highest or now.highest < before.lowest
    if not is_apart or 1.0 / (1.0 + DRIFT) <= ratio <= 1.0 + DRIFT:
        return Comparison(before, now, ratio, SAME)
    return Comparison(before, now, ratio, FASTER if ratio > 1.0 else SLOWER)


def _changed_circumstances(before: SavedResults, now: SavedResults) -> list[str]:
    """Return a sentence for each circumstance that differs."""
    lines = [
        f"The machine was busy {when}: load {results.load:.1f} at the start."
        for when, results in (("before", before), ("now", now))
        if is_busy(results)
    ]
    for title, old, new in (
        ("The machine differs", before.machine, now.machine),
        ("Versions differ", dict(before.versions), dict(now.versions)),
    ):
        changed = [
            f"{name} was {old.get(name)}, is {value}"
            for name, value in new.items()
            if not _is_same(old.get(name), value)
        ]
        if changed:
            lines.append(f"{title}: {'; '.join(changed)}.")
    return lines


def _is_same(before: object, now: object) -> bool:
    """Return whether a fact is the same; a measured clock varies by as much as other figures."""
    if isinstance(before, float) and isinstance(now, float):
        return abs(now - before) <= DRIFT * before
    return before == now


def _without_partner(before: SavedResults, now: SavedResults) -> list[str]:
    """Return a sentence on what was measured in one of the two runs only."""
    keys_before = {_key(each) for each in before.measurements}
    keys_now = {_key(each) for each in now.measurements}
    lines = []
    if n_before := len(keys_before - keys_now):
        lines.append(f"{n_before} quantities were measured only before.")
    if n_now := len(keys_now - keys_before):
        lines.append(f"{n_now} quantities were measured only now.")
    return lines
