"""The commands `scalpel-sim bench ...`: measure, print a table, save and compare the results."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from scalpel_sim.cli.console import log_to_stderr
from scalpel_sim.cli.options import Flag, PrintOptions
from scalpel_sim.errors import UsageError
from scalpel_sim.validate.speed.watch import Watch, watching

if TYPE_CHECKING:  # `--help` should not wait for it
    from scalpel_sim.validate.speed.measurements import BenchmarkResult, SavedResults

MOST_ROUNDS = 1000
"""More rounds are taken for a typing error."""
SHORT_LARGEST = 20_250
"""Largest body of the short set [tetrahedra]."""

bench = App(
    name="bench",
    help="Measure the program on this machine: warm, in rounds in which the cases take turns.",
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


Largest = Annotated[int | None, Parameter(help="Omit bodies of more tetrahedra than this.")]

Names = Annotated[list[str] | None, Parameter(consume_multiple=True)]

Benchmark = Callable[[Watch], "BenchmarkResult"]


@bench.default
def bench_short_set(
    *,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run a short set: the kernels in small bodies, one scene, and the limits of the machine."""
    from benchmarks.kernels import measure_kernels
    from benchmarks.roofline import measure_roofline
    from scalpel_sim.validate.speed.scenes import measure_scenes

    _run(
        [
            lambda watch: measure_kernels(options.runs, SHORT_LARGEST, watch),
            lambda watch: measure_scenes(options.runs, ["slab"], watch),
            lambda watch: measure_roofline(options.runs, SHORT_LARGEST, watch),
        ],
        options,
        printing,
    )


@bench.command(name="scenes")
def bench_scenes(
    *names: str,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run whole scenes: time of a frame, and of each of its stages.

    Args:
        names: organ, incision, slab, grid2, grid7; without a name all of them.
    """
    from scalpel_sim.validate.speed.scenes import checked_scene_names, measure_scenes

    chosen = checked_scene_names(names)
    _run([lambda watch: measure_scenes(options.runs, chosen, watch)], options, printing)


@bench.command(name="real-time")
def bench_real_time(
    *,
    scenes: Names = None,
    materials: Names = None,
    strokes: Annotated[list[int] | None, Parameter(consume_multiple=True)] = None,
    quick: Flag = False,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run whole strokes in each material, with account and viewer, and after random strokes.

    Takes many minutes: choose with the options. For example:

    ```console
    scalpel-sim bench real-time --scenes organ --materials liver fat --runs 1
    ```

    Args:
        scenes: organ, incision, slab, grid2, grid7 [default: all].
        materials: Names of materials, or "as shipped" [default: that, and all].
        strokes: After how many random strokes frames are timed [default: 0 10 26 50].
        quick: Only the begin of each stroke, and the middle of a random one, as shipped, once.
    """
    from benchmarks.real_time import (
        AS_SHIPPED,
        STROKE_COUNTS,
        checked_materials,
        checked_strokes,
        measure_real_time,
    )
    from scalpel_sim.validate.speed.scenes import checked_scene_names

    chosen = checked_scene_names(scenes or ())
    of_material = checked_materials(materials or ([AS_SHIPPED] if quick else []))
    counts = checked_strokes(strokes or ((0, 1) if quick else STROKE_COUNTS))
    runs = 1 if quick else options.runs
    _run(
        [
            lambda watch: measure_real_time(
                runs, chosen, of_material, counts, quick=quick, watch=watch
            )
        ],
        options,
        printing,
    )


@bench.command(name="kernels")
def bench_kernels(
    *,
    largest: Largest = None,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Time forces, steps, a cut step and contact detection in 576 to 60,000 tetrahedra."""
    from benchmarks.kernels import measure_kernels

    _run([lambda watch: measure_kernels(options.runs, largest, watch)], options, printing)


@bench.command(name="scaling")
def bench_scaling(
    *,
    largest: Largest = None,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Time a step, and a local frame, in bodies of 576 to 1,000,000 tetrahedra."""
    from benchmarks.local_frame import measure_local_frames
    from benchmarks.scaling import measure_scaling

    _run(
        [
            lambda watch: measure_scaling(options.runs, largest, watch),
            lambda watch: measure_local_frames(options.runs, largest, watch),
        ],
        options,
        printing,
    )


@bench.command(name="roofline")
def bench_roofline(
    *,
    largest: Largest = None,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Measure bandwidth and arithmetic of this machine, and the share of them that a step uses."""
    from benchmarks.roofline import measure_roofline

    _run([lambda watch: measure_roofline(options.runs, largest, watch)], options, printing)


@bench.command(name="peers")
def bench_peers(
    *,
    largest: Largest = None,
    python: Path | None = None,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Time MuJoCo flex, Newton and Rapier in turns with this engine, where they are installed.

    Args:
        python: The Python of an environment that has the engines that this one lacks.
    """
    from benchmarks.peers.benchmark import measure_peers

    _run([lambda watch: measure_peers(options.runs, largest, python, watch)], options, printing)


@bench.command(name="table1")
def bench_table1(
    *,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Cut the three grids of the paper's Table 1 by each scheme, beside the paper's figures."""
    from scalpel_sim.validate.speed.table1 import measure_table1

    _run([lambda watch: measure_table1(options.runs, watch=watch)], options, printing)


@bench.command(name="cut")
def bench_cut_steps(
    *,
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Time a cut step in bodies of 1,000, 10,000 and 100,000 tetrahedra."""
    from benchmarks.cut import measure_cut_steps

    _run([lambda watch: measure_cut_steps(options.runs, watch=watch)], options, printing)


def _run(benchmarks: Sequence[Benchmark], options: BenchOptions, printing: PrintOptions) -> None:
    """Run benchmarks; print, save and compare their results."""
    from scalpel_sim.cli.run_setup import load_kernels
    from scalpel_sim.output.file_check import check_file
    from scalpel_sim.validate.speed.machine import load_average
    from scalpel_sim.validate.speed.measurements import (
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
        found = [measure(watch) for measure in benchmarks]
    results = collect_results(found, load_at_start)
    text = results_as_json(results)
    if options.save is not None:
        save_results(options.save, text)
    if printing.json:
        print(text)
    elif not printing.quiet:
        _print(found, results, before)


def _print(
    found: Sequence["BenchmarkResult"], results: "SavedResults", before: "SavedResults | None"
) -> None:
    """Print the results, and their comparison with those of another run."""
    from rich.console import Console

    from scalpel_sim.validate.speed.compare import is_busy, print_comparison

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
        print_comparison(before, results, console)
