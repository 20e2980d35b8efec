"""Compares two runs of the same benchmarks: ratios, and a verdict only where the spread allows."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from scalpel_sim.validate.speed.measurements import HIGHER, NEITHER, Measurement, SavedResults
from scalpel_sim.validate.speed.tables import compact_table

if TYPE_CHECKING:
    from rich.console import Console

FEWEST_ROUNDS = 4
"""With fewer rounds on either side there is no verdict. By chance the medians of four and four
rounds do not overlap in 2 of 70 comparisons, those of three and three rounds in 1 of 10."""

DRIFT = 0.1
"""Smaller relative changes get no verdict. Two runs of the same program on a shared machine
differed by up to this much although the rounds within each run agreed far better: a neighbour may
occupy caches and memory for a whole run."""

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
    """How many times better it is now: above 1 is faster."""
    verdict: str


def compare_measurements(
    before: Sequence[Measurement], now: Sequence[Measurement]
) -> list[Comparison]:
    """Return a comparison for each quantity that was measured both times."""
    known = {_key(each): each for each in before}
    return [_compare(known[_key(each)], each) for each in now if _key(each) in known]


def print_comparison(before: SavedResults, now: SavedResults, console: "Console") -> None:
    """Print every quantity that can be compared, and what differs between the two runs."""
    table = compact_table("compared")
    table.add_column("case")
    for heading in ("tetrahedra", "before", "now", "unit", "ratio"):
        table.add_column(heading, justify="right")
    table.add_column("verdict")
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
            if old.get(name) != value
        ]
        if changed:
            lines.append(f"{title}: {'; '.join(changed)}.")
    return lines


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
