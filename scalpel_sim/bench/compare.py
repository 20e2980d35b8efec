"""Two runs of the same benchmarks: ratios, and a verdict only where the spread allows one."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from scalpel_sim.bench.results import HIGHER, NEITHER, Figure, Results
from scalpel_sim.bench.tables import compact

if TYPE_CHECKING:
    from rich.console import Console

FEWEST_ROUNDS = 4
"""Fewer on either side give no verdict. That the medians of two times four rounds do not overlap
happens by chance in 2 of 70 comparisons, of two times three rounds in 1 of 10."""

DRIFT = 0.1
"""Change below which there is no verdict either. Two runs of the same program on a shared machine
were up to this far apart, each with rounds that agreed among themselves far better: a neighbour may
take caches and memory for the whole of a run."""

BUSY = 0.5
"""Programs that run at the same time on average, above which the machine is not one's own."""

FASTER, SLOWER, SAME = "faster", "slower", "same"
TOO_FEW = "too few rounds"
COUNT = "no time"


class Comparison(NamedTuple):
    """One figure, before and now."""

    before: Figure
    now: Figure
    ratio: float
    """How many times better it is now: above 1 is faster."""
    verdict: str


def compared(before: Sequence[Figure], now: Sequence[Figure]) -> list[Comparison]:
    """Return a comparison for each figure of now that was there before."""
    known = {_key(figure): figure for figure in before}
    return [_compared(known[_key(f)], f) for f in now if _key(f) in known]


def show(before: Results, now: Results, console: "Console") -> None:
    """Print all that can be compared, and what cannot."""
    table = compact("compared")
    table.add_column("case")
    for heading in ("tetrahedra", "before", "now", "unit", "ratio"):
        table.add_column(heading, justify="right")
    table.add_column("verdict")
    comparisons = compared(before.figures, now.figures)
    for each in comparisons:
        if each.now.better == NEITHER:
            continue
        figure = each.now
        table.add_row(
            f"{figure.benchmark}, {figure.case}",
            "" if figure.tetrahedra is None else f"{figure.tetrahedra:,}",
            f"{each.before.median:.4g}",
            f"{figure.median:.4g}",
            figure.unit,
            f"{each.ratio:.2f}",
            each.verdict,
        )
    console.print(table)
    for line in (*_other_circumstances(before, now), *_without_partner(before, now)):
        console.print(line, style="dim")
    console.print(
        "Ratio: above 1 is faster now. A verdict needs medians of rounds that do not "
        f"overlap, {FEWEST_ROUNDS} rounds on either side, and a change of more than "
        f"{DRIFT:.0%}, as two runs of one program on a shared machine differ. Wall times take in "
        "what else the machine does.",
        style="dim",
    )


def _key(figure: Figure) -> tuple[object, ...]:
    """Return what makes two figures the same."""
    return (figure.benchmark, figure.case, figure.tetrahedra, figure.quantity, figure.unit)


def _compared(before: Figure, now: Figure) -> Comparison:
    if now.better == NEITHER:
        return Comparison(before, now, 1.0, COUNT)
    rises = now.better == HIGHER
    ratio = now.median / before.median if rises else before.median / now.median
    if min(before.rounds, now.rounds) < FEWEST_ROUNDS:
        return Comparison(before, now, ratio, TOO_FEW)
    is_apart = now.lowest > before.highest or now.highest < before.lowest
    if not is_apart or 1.0 / (1.0 + DRIFT) <= ratio <= 1.0 + DRIFT:
        return Comparison(before, now, ratio, SAME)
    return Comparison(before, now, ratio, FASTER if ratio > 1.0 else SLOWER)


def _other_circumstances(before: Results, now: Results) -> list[str]:
    """Say what else has changed."""
    lines = [
        f"The machine was busy {when}: load {results.load:.1f} at the start."
        for when, results in (("then", before), ("now", now))
        if is_busy(results)
    ]
    for what, of_before, of_now in (
        ("machine", before.machine, now.machine),
        ("versions", dict(before.versions), dict(now.versions)),
    ):
        changed = [
            f"{name}: {of_before.get(name)} then, {value} now"
            for name, value in of_now.items()
            if of_before.get(name) != value
        ]
        if changed:
            lines.append(f"Another {what.rstrip('s')}: {'; '.join(changed)}.")
    return lines


def is_busy(results: Results) -> bool:
    """Whether others ran on the machine when the benchmark began."""
    return results.load > BUSY


def _without_partner(before: Results, now: Results) -> list[str]:
    """Say what was measured in one of the two only."""
    n_before = len({_key(f) for f in before.figures} - {_key(f) for f in now.figures})
    n_now = len({_key(f) for f in now.figures} - {_key(f) for f in before.figures})
    lines = []
    if n_before:
        lines.append(f"{n_before} figures of before were not measured now.")
    if n_now:
        lines.append(f"{n_now} figures of now were not there before.")
    return lines
