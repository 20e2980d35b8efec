"""`python -m benchmarks NAME ...`: run a benchmark or a study by its name."""

import sys
from collections.abc import Callable, Sequence
from typing import Annotated

from cyclopts import App, CycloptsError, Parameter

from benchmarks.costs import checked_steps, images, saved_state, score, surface_values, undo
from benchmarks.device_link import device_link
from benchmarks.frame import fixed_cost, frame
from benchmarks.links import lag, round_trip
from benchmarks.peers.benchmark import peers
from benchmarks.real_time import real_time
from benchmarks.scaling import cut, kernels, scaling
from benchmarks.scene_costs import measure_scene_costs
from benchmarks.strokes import random_strokes
from benchmarks.studies.cutting_law import cutting_law
from benchmarks.studies.environments import environments
from benchmarks.studies.mesh_study import mesh_study
from benchmarks.studies.tasks import tasks
from benchmarks.timing import Rounds, TurnWatch
from scalpel_sim.errors import EXIT_OK, EXIT_RUN_FAILED, EXIT_WRONG_USE, exit_code, one_line
from scalpel_sim.runs.console import say_error
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.validate.speed.command import BenchOptions, run_benchmark
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.scenes import measure_scenes
from scalpel_sim.validate.speed.watch import SILENT, Watch

SHORT_LARGEST = 20_250
"""Largest body of the short set [tetrahedra]."""


def short(*, runs: Rounds = 5, watch: TurnWatch = SILENT) -> list[BenchmarkResult]:
    """Run a short set: the kernels in small bodies, and one scene."""
    return [
        kernels(runs=runs, watch=watch, largest=SHORT_LARGEST),
        measure_scenes(runs, ["slab"], watch),
    ]


BENCHMARKS: dict[str, Callable[..., BenchmarkResult | list[BenchmarkResult]]] = {
    "short": short,
    "kernels": kernels,
    "scaling": scaling,
    "cut": cut,
    "real-time": real_time,
    "scene-costs": measure_scene_costs,
    "random-strokes": random_strokes,
    "frame": frame,
    "fixed-cost": fixed_cost,
    "checked-steps": checked_steps,
    "saved-state": saved_state,
    "score": score,
    "surface-values": surface_values,
    "images": images,
    "undo": undo,
    "round-trip": round_trip,
    "device-link": device_link,
    "lag": lag,
    "peers": peers,
    "mesh-study": mesh_study,
    "cutting-law": cutting_law,
    "tasks": tasks,
    "environments": environments,
}
"""The benchmarks by name. Arguments `runs` and `watch` come from the options that all have."""

benchmarks_app = App(
    name="python -m benchmarks",
    help="Measure the engine from a clone of the repository, on an idle machine: warm, in rounds "
    "in which the cases take turns.",
    version_flags=(),
)
for _name, _function in BENCHMARKS.items():
    benchmarks_app.command(_function, name=_name)


@benchmarks_app.meta.default
def _run(
    *words: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    options: BenchOptions = BenchOptions(),
    printing: PrintOptions = PrintOptions(),
) -> int:
    if not words:
        benchmarks_app.help_print()
        return EXIT_OK
    command, bound, unparsed = benchmarks_app.parse_args(
        words, exit_on_error=False, print_error=False
    )

    def measure(watch: Watch) -> BenchmarkResult | Sequence[BenchmarkResult]:
        shared = {"runs": options.runs, "watch": watch}
        given = {name: value for name, value in shared.items() if name in unparsed}
        found: BenchmarkResult | Sequence[BenchmarkResult]
        found = command(*bound.args, **bound.kwargs, **given)
        return found

    return EXIT_OK if run_benchmark(measure, options, printing) else EXIT_RUN_FAILED


def benchmark_line(words: Sequence[str]) -> int:
    """Run the benchmark that the words name, and return the exit code.

    Every error becomes one line on standard error.
    """
    try:
        code: int | None = benchmarks_app.meta(
            words, exit_on_error=False, print_error=False, result_action="return_value"
        )
    except CycloptsError as error:
        say_error(f"{error} See python -m benchmarks --help.")
        return EXIT_WRONG_USE
    except Exception as error:
        if {"-v", "--verbose"} & set(words):
            raise
        say_error(one_line(error))
        return exit_code(error)
    return code or EXIT_OK


if __name__ == "__main__":
    sys.exit(benchmark_line(sys.argv[1:]))
