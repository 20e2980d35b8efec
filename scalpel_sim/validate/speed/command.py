"""The commands `scalpel-sim bench ...`: measure, print a table, save and compare the results."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.validate.speed.watch import Watch, watching

if TYPE_CHECKING:  # `--help` should not wait for it
    from scalpel_sim.validate.speed.measurements import BenchmarkResult, SavedResults

MOST_ROUNDS = 1000
"""More rounds are taken for a typing error."""

bench = App(
    name="bench",
    help="Measure the program on this machine: warm, in rounds in which the cases take turns. "
    "More benchmarks come with a clone of the repository: `python -m benchmarks`.",
)


@Parameter(name="*")
@dataclass(frozen=True)
class BenchOptions:
    """Options that all benchmarks have."""

    runs: int = 5
    "Rounds; in each of them every case has one turn."
    save: Path | None = None
    "Write the results to this JSON file too."
    compare: Path | None = None
    "Compare with the results in this file, which --save wrote."


@bench.default
def _bench_by_name(
    *names: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
) -> None:
    asked = f"there is no benchmark {names[0]!r}" if names else "name a benchmark"
    raise UsageError(
        f"{asked}: scenes or table1; a clone of the repository has others, such as kernels, "
        "real-time and peers: python -m benchmarks NAME"
    )


@bench.command(name="scenes")
def _bench_scenes(
    *names: str,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run whole scenes: time of a frame, and of each of its stages.

    Args:
        names: Scenes that come with the project; without a name all of them.
    """
    from scalpel_sim.validate.speed.scenes import checked_scene_names, measure_scenes

    chosen = checked_scene_names(names)
    run_benchmark(lambda watch: measure_scenes(options.runs, chosen, watch), options, printing)


@bench.command(name="table1")
def _bench_table1(
    *,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Cut the three grids of the paper's Table 1 by each scheme, next to the paper's figures."""
    from scalpel_sim.validate.speed.table1 import measure_table1

    run_benchmark(lambda watch: measure_table1(options.runs, watch=watch), options, printing)


def run_benchmark(
    measure: "Callable[[Watch], BenchmarkResult | Sequence[BenchmarkResult]]",
    options: BenchOptions,
    printing: PrintOptions,
) -> bool:
    """Run a benchmark; print, save and compare its results.

    Args:
        measure: Measures and returns the results.
        options: Number of rounds, and files.
        printing: What is printed.

    Returns:
        Whether everything that the benchmark judges is as it should be.

    Raises:
        UsageError: an option is wrong.
    """
    from scalpel_sim.output.export import check_file
    from scalpel_sim.runs.prepared_run import load_kernels
    from scalpel_sim.validate.speed.machine import clock_under_load, load_average
    from scalpel_sim.validate.speed.measurements import (
        BenchmarkResult,
        collect_results,
        load_results,
        results_as_json,
        save_results,
    )

    if not 1 <= options.runs <= MOST_ROUNDS:
        raise UsageError(f"--runs is {options.runs}; it must be from 1 to {MOST_ROUNDS}")
    before = None if options.compare is None else load_results(options.compare)
    if options.save is not None:
        check_file(options.save, ".json", "--save")
    load_at_start = load_average()
    with log_to_stderr(printing), watching(printing) as watch:
        load_kernels(printing)
        measured = measure(watch)
        clock = clock_under_load()
    found = [measured] if isinstance(measured, BenchmarkResult) else measured
    results = collect_results(found, load_at_start, clock)
    text = results_as_json(results)
    if options.save is not None:
        save_results(options.save, text)
    if printing.json:
        print(text)
    elif not printing.quiet:
        _print(found, results, before)
    return all(each.is_right for each in found)


def _print(
    found: Sequence["BenchmarkResult"], results: "SavedResults", before: "SavedResults | None"
) -> None:
    """Print the results, and their comparison with those of another run."""
    from rich.console import Console

    from scalpel_sim.validate.speed.machine import machine_line
    from scalpel_sim.validate.speed.tables import is_busy, print_comparison

    console = Console()
    for each in found:
        each.show(console)
    console.print(f"Measured on: {machine_line(results.machine)}.", style="dim")
    if is_busy(results):
        console.print(
            f"The machine was busy: load {results.load:.1f} at the start. Wall times are too long, "
            "and CPU times too, as caches are shared.",
            style="dim",
        )
    if before is not None:
        print_comparison(before, results, console)
