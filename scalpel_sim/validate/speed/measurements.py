"""The one format of benchmark results: measurements with unit, clock and spread, and their file."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import numpy as np
from msgspec.structs import asdict

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.summary import versions
from scalpel_sim.validate.speed.machine import describe_machine
from tissue import FloatArray
from tissue.support import whole_file

if TYPE_CHECKING:
    from rich.console import Console

FORMAT = "scalpel-sim bench 1"
"""First entry of a results file; the number changes where older files can no longer be read."""

LOWER, HIGHER, NEITHER = "lower", "higher", "neither"
"""Which values of a quantity are better."""

COUNTED = "counted"
"""Name of the clock of a quantity that is no time."""


class Clock(NamedTuple):
    """A clock that a case is timed with."""

    name: str
    now: Callable[[], float]
    """Returns the time since some fixed moment [s]."""


CPU = Clock("CPU", time.thread_time)
"""CPU time of this thread: other work on the machine does not count, except that it takes its share
of caches and memory. For kernels, which do nothing but compute."""
WALL = Clock("wall", time.perf_counter)
"""Wall time, what a person waits for. For frames, whose deadline is in wall time."""


class Quantity(msgspec.Struct, frozen=True):
    """Quantity that is measured, and its unit."""

    benchmark: str
    case: str
    tetrahedra: int | None
    """Size of the body; None where there is no body."""
    quantity: str
    """Name of the quantity: `time`, `rate` and the like."""
    unit: str
    clock: str
    """`CPU`, `wall`, or `counted`."""
    better: str = LOWER
    """`lower`, `higher`, or `neither`."""
    note: str = ""
    """Facts to know before comparing it with another."""


class Measurement(Quantity, frozen=True, kw_only=True):
    """The measured values of a quantity."""

    n: int
    """Number of samples."""
    median: float
    p95: float
    """19 of 20 samples are as good as this, or better."""
    p99: float
    """99 of 100 samples are as good as this, or better."""
    lowest: float
    """Lowest of the medians of the rounds."""
    highest: float
    """Highest of the medians of the rounds."""
    rounds: int
    """Number of rounds."""


class Skipped(msgspec.Struct, frozen=True):
    """Something that was not measured."""

    benchmark: str
    case: str
    tetrahedra: int | None
    reason: str
    """Why, and what to do about it."""


class BenchmarkResult(NamedTuple):
    """Outcome of one benchmark."""

    measurements: list[Measurement]
    skipped: list[Skipped]
    show: Callable[["Console"], None]
    """Prints the result as a table."""
    is_right: bool = True
    """Whether everything that the benchmark judges is as it should be."""


class SavedResults(msgspec.Struct, frozen=True):
    """The content of a results file."""

    machine: dict[str, Any]
    versions: dict[str, str]
    load: float
    """Mean number of running programs on the machine in the minute before the start."""
    measurements: list[Measurement] = msgspec.field(name="figures")
    skipped: list[Skipped]
    format: str = FORMAT


def summarise_times(
    quantity: Quantity, rounds: Sequence[FloatArray], convert: Callable[[float], float]
) -> Measurement:
    """Return the measurement of a quantity that follows from timed samples.

    Args:
        quantity: What was measured.
        rounds: Samples [s], an array for each round.
        convert: From seconds to the unit of the quantity; it falls with time where higher values
            are better.
    """
    samples = np.concatenate(rounds)
    median, p95, p99 = (convert(float(q)) for q in np.percentile(samples, (50, 95, 99)))
    medians = [convert(float(np.median(samples))) for samples in rounds]
    return Measurement(
        **asdict(quantity),
        n=len(samples),
        median=median,
        p95=p95,
        p99=p99,
        lowest=min(medians),
        highest=max(medians),
        rounds=len(rounds),
    )


def summarise_values(quantity: Quantity, values: Sequence[float]) -> Measurement:
    """Return the measurement of a quantity with one value for each round."""
    best = 100.0 if quantity.better == HIGHER else 0.0
    median, p95, p99 = (float(np.percentile(values, abs(best - q))) for q in (50, 95, 99))
    return Measurement(
        **asdict(quantity),
        n=len(values),
        median=median,
        p95=p95,
        p99=p99,
        lowest=float(min(values)),
        highest=float(max(values)),
        rounds=len(values),
    )


def collect_results(
    found: Sequence[BenchmarkResult], load: float, clock: float | None = None
) -> SavedResults:
    """Return the results of all benchmarks with machine and versions.

    Args:
        found: Results of the benchmarks.
        load: Load of the machine at the start.
        clock: Clock of the core under load [Hz], where it was measured.
    """
    return SavedResults(
        machine=describe_machine() | {"clock_hz": clock},
        versions=versions(),
        load=load,
        measurements=[measurement for each in found for measurement in each.measurements],
        skipped=[skipped for each in found for skipped in each.skipped],
    )


def results_as_json(results: SavedResults) -> str:
    """Return results as JSON text."""
    return msgspec.json.format(msgspec.json.encode(results), indent=2).decode()


def save_results(path: Path, text: str) -> None:
    """Write a results file.

    Raises:
        RunError: the file cannot be written.
    """
    try:
        with whole_file(path) as unfinished:
            unfinished.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose another --save"
        ) from error


def load_results(path: Path) -> SavedResults:
    """Read a results file.

    Raises:
        UsageError: the file is missing or unreadable, or is no results file of this format.
    """
    try:
        content = msgspec.json.decode(path.read_bytes())
    except OSError as error:
        raise UsageError(
            f"{path}: cannot be read ({error.strerror or error}); make one with --save FILE"
        ) from error
    except msgspec.DecodeError as error:
        raise UsageError(f"{path}: is no results file: it is not JSON ({error})") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise UsageError(
            f"{path}: is no results file of this version, which has "
            f'"format": "{FORMAT}"; make one with --save FILE'
        )
    try:
        return msgspec.convert(content, SavedResults)
    except msgspec.ValidationError as error:
        raise UsageError(f"{path}: is a results file with parts missing ({error})") from error
