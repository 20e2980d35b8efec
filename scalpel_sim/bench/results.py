"""The one format of what benchmarks find: figures with unit, clock and spread, and their file."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scalpel_sim.bench import machine
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.summary import versions
from tissue import FloatArray

if TYPE_CHECKING:
    from rich.console import Console

FORMAT = "scalpel-sim bench 1"
"""First entry of a results file; the number changes where older files can no longer be read."""

LOWER, HIGHER, NEITHER = "lower", "higher", "neither"
"""Which way is better."""

COUNTED = "counted"
"""The clock of what is no time."""


class Figure(NamedTuple):
    """One figure that a benchmark found."""

    benchmark: str
    case: str
    """What was measured."""
    tetrahedra: int | None
    """In how large a body; None where there is none."""
    quantity: str
    unit: str
    clock: str
    """CPU, wall, or `counted`."""
    better: str
    """`lower`, `higher`, or `neither`."""
    n: int
    """Samples in all."""
    median: float
    p95: float
    """19 of 20 samples are as good as this, or better."""
    p99: float
    """99 of 100."""
    lowest: float
    """Of the medians of the rounds."""
    highest: float
    """Of the medians of the rounds."""
    rounds: int
    note: str = ""
    """What to know before one compares it with another."""


class Skipped(NamedTuple):
    """What was not measured."""

    benchmark: str
    case: str
    tetrahedra: int | None
    reason: str
    """Why, and what would help."""


class Findings(NamedTuple):
    """What one benchmark found."""

    figures: list[Figure]
    skipped: list[Skipped]
    show: Callable[["Console"], None]
    """Prints it for a person."""


class Results(NamedTuple):
    """What a results file holds."""

    figures: list[Figure]
    skipped: list[Skipped]
    machine: dict[str, Any]
    versions: dict[str, str]
    load: float
    """Programs that ran on the machine in the minute before, on average."""


def of_times(
    benchmark: str,
    case: str,
    tetrahedra: int | None,
    quantity: str,
    unit: str,
    rounds: Sequence[FloatArray],
    *,
    clock: str,
    better: str = LOWER,
    convert: Callable[[float], float],
    note: str = "",
) -> Figure:
    """Return the figure of samples [s] of each round.

    Args:
        benchmark: Its name.
        case: What was measured.
        tetrahedra: Of the body.
        quantity: What the figure tells.
        unit: Of the figure.
        rounds: Samples, an array for each round.
        clock: What the samples are told by.
        better: Which way.
        convert: From seconds to the figure; falls with the time where higher is better.
        note: What to know.
    """
    samples = np.concatenate(rounds)
    median, p95, p99 = (convert(float(q)) for q in np.percentile(samples, (50, 95, 99)))
    medians = [convert(float(np.median(samples))) for samples in rounds]
    return Figure(
        benchmark, case, tetrahedra, quantity, unit, clock, better, len(samples),
        median, p95, p99, min(medians), max(medians), len(rounds), note,
    )  # fmt: skip


def of_values(
    benchmark: str,
    case: str,
    tetrahedra: int | None,
    quantity: str,
    unit: str,
    values: Sequence[float],
    *,
    clock: str,
    better: str,
    note: str = "",
) -> Figure:
    """Return the figure of one value for each round; the worst of them are its percentiles."""
    worst = 100.0 if better == HIGHER else 0.0
    median, p95, p99 = (float(np.percentile(values, abs(worst - q))) for q in (50, 95, 99))
    return Figure(
        benchmark, case, tetrahedra, quantity, unit, clock, better, len(values),
        median, p95, p99, float(min(values)), float(max(values)), len(values), note,
    )  # fmt: skip


def results_of(found: Sequence[Findings], load: float) -> Results:
    """Return all that benchmarks found, with what it depends on; `load` is that at the start."""
    return Results(
        figures=[figure for each in found for figure in each.figures],
        skipped=[skipped for each in found for skipped in each.skipped],
        machine=machine.description(),
        versions=versions(),
        load=load,
    )


def as_json(results: Results) -> str:
    """Return results as JSON text."""
    content = {
        "format": FORMAT,
        "machine": results.machine,
        "versions": results.versions,
        "load": results.load,
        "figures": [figure._asdict() for figure in results.figures],
        "skipped": [skipped._asdict() for skipped in results.skipped],
    }
    return json.dumps(content, indent=2, allow_nan=False)


def save(path: Path, text: str) -> None:
    """Write a results file.

    Raises:
        RunError: the system refuses.
    """
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose another --save"
        ) from error


def load(path: Path) -> Results:
    """Read a results file.

    Raises:
        UsageError: it is not there, cannot be read, or is no results file of this format.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(
            f"{path}: cannot be read ({error.strerror or error}); "
            "make one with scalpel-sim bench --save FILE"
        ) from error
    except ValueError as error:
        raise UsageError(f"{path}: is no results file: it is not JSON ({error})") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise UsageError(
            f"{path}: is no results file of this version, which begins with "
            f'"format": "{FORMAT}"; make one with scalpel-sim bench --save FILE'
        )
    try:
        return Results(
            figures=[Figure(**figure) for figure in content["figures"]],
            skipped=[Skipped(**skipped) for skipped in content["skipped"]],
            machine=content["machine"],
            versions=content["versions"],
            load=float(content["load"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UsageError(f"{path}: is a results file with parts missing ({error})") from error
