"""The commands `scalpel-sim bench ...`: measure, print a table, keep and compare the figures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from scalpel_sim.bench.watch import Watch, watching
from scalpel_sim.cli.console import log_to_stderr
from scalpel_sim.cli.options import PrintOptions
from scalpel_sim.errors import UsageError

if TYPE_CHECKING:  # `--help` should not wait for it
    from scalpel_sim.bench.results import Findings, Results

MOST_ROUNDS = 1000
"""More is a slip of the keyboard."""
SHORT = 20_250
"""Largest body of the short set [tetrahedra]."""

bench = App(
    name="bench",
    help="Measure the program on this machine: warm, in rounds in which cases take turns.",
)


@Parameter(name="*")
@dataclass(frozen=True)
class Measuring:
    """How it is measured."""

    runs: int = 5
    "Rounds; in each of them every case has a turn."
    save: Path | None = None
    "Also write the figures as JSON to this file."
    compare: Path | None = None
    "Compare with the figures in this file, which --save wrote."


Largest = Annotated[int | None, Parameter(help="Leave out bodies of more tetrahedra than this.")]

Measure = Callable[[Watch], "Findings"]


@bench.default
def short(*, measuring: Measuring = Measuring(), printing: PrintOptions = PrintOptions()) -> None:
    """A short set: the kernels in small bodies, a scene, and what the machine could do at best."""
    from scalpel_sim.bench import kernels, roofline, scenes

    _run(
        [
            lambda watch: kernels.measure(measuring.runs, SHORT, watch),
            lambda watch: scenes.measure(measuring.runs, ["slab"], watch),
            lambda watch: roofline.measure(measuring.runs, SHORT, watch),
        ],
        measuring,
        printing,
    )


@bench.command
def scenes(
    *names: str, measuring: Measuring = Measuring(), printing: PrintOptions = PrintOptions()
) -> None:
    """Whole runs of the scenes: time of a frame, and of each stage of it.

    Args:
        names: organ, slab, grid2, grid7; all of them if not given.
    """
    from scalpel_sim.bench import scenes as benchmark

    chosen = benchmark.check_names(names)
    _run([lambda watch: benchmark.measure(measuring.runs, chosen, watch)], measuring, printing)


@bench.command
def kernels(
    *,
    largest: Largest = None,
    measuring: Measuring = Measuring(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Forces, steps, a cut step and the search for contact, in 576 to 60,000 tetrahedra."""
    from scalpel_sim.bench import kernels as benchmark

    _run([lambda watch: benchmark.measure(measuring.runs, largest, watch)], measuring, printing)


@bench.command
def scaling(
    *,
    largest: Largest = None,
    measuring: Measuring = Measuring(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """What a step, and a local frame, cost in bodies of 576 to 1,000,000 tetrahedra."""
    from scalpel_sim.bench import local_frame
    from scalpel_sim.bench import scaling as benchmark

    _run(
        [
            lambda watch: benchmark.measure(measuring.runs, largest, watch),
            lambda watch: local_frame.measure(measuring.runs, largest, watch),
        ],
        measuring,
        printing,
    )


@bench.command
def roofline(
    *,
    largest: Largest = None,
    measuring: Measuring = Measuring(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Bandwidth and arithmetic of this machine, and the share of them that a step uses."""
    from scalpel_sim.bench import roofline as benchmark

    _run([lambda watch: benchmark.measure(measuring.runs, largest, watch)], measuring, printing)


@bench.command
def peers(
    *,
    largest: Largest = None,
    python: Path | None = None,
    measuring: Measuring = Measuring(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """MuJoCo flex, Newton and Rapier in the same rounds as ours, as far as they are installed.

    Args:
        python: The Python of an environment that has them, where this one has not.
    """
    from scalpel_sim.bench import peers as benchmark

    _run(
        [lambda watch: benchmark.measure(measuring.runs, largest, python, watch)],
        measuring,
        printing,
    )


@bench.command
def table1(*, measuring: Measuring = Measuring(), printing: PrintOptions = PrintOptions()) -> None:
    """The three grids of the paper's Table 1, with its own scheme and ours, beside its figures."""
    from scalpel_sim.bench import table1 as benchmark

    _run([lambda watch: benchmark.measure(measuring.runs, watch=watch)], measuring, printing)


@bench.command
def cut(*, measuring: Measuring = Measuring(), printing: PrintOptions = PrintOptions()) -> None:
    """The cost of a cut step in bodies of 1,000, 10,000 and 100,000 tetrahedra."""
    from scalpel_sim.bench import cut as benchmark

    _run([lambda watch: benchmark.measure(measuring.runs, watch=watch)], measuring, printing)


def _run(benchmarks: Sequence[Measure], measuring: Measuring, printing: PrintOptions) -> None:
    """Measure, and say, keep and compare what was found."""
    from scalpel_sim.bench.machine import load as machine_load
    from scalpel_sim.bench.results import as_json, load, results_of, save
    from scalpel_sim.cli.run_setup import load_kernels
    from scalpel_sim.output.run_folder import check_file

    if not 1 <= measuring.runs <= MOST_ROUNDS:
        raise UsageError(f"--runs is {measuring.runs}; it must be from 1 to {MOST_ROUNDS}")
    before = None if measuring.compare is None else load(measuring.compare)
    if measuring.save is not None:
        check_file(measuring.save, ".json", "--save")
    load_at_start = machine_load()
    with log_to_stderr(printing), watching(printing) as watch:
        load_kernels(printing)
        found = [measure(watch) for measure in benchmarks]
    results = results_of(found, load_at_start)
    text = as_json(results)
    if measuring.save is not None:
        save(measuring.save, text)
    if printing.json:
        print(text)
    elif not printing.quiet:
        _print(found, results, before)


def _print(found: Sequence["Findings"], results: "Results", before: "Results | None") -> None:
    """Print what was found, and how it compares."""
    from rich.console import Console

    from scalpel_sim.bench.compare import is_busy, show

    console = Console()
    for each in found:
        each.show(console)
    if is_busy(results):
        console.print(
            f"The machine was busy: load {results.load:.1f} at the start. Wall times are too long, "
            "and CPU times too, as caches are shared.",
            style="dim",
        )
    if before is not None:
        show(before, results, console)
