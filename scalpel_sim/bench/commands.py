"""The commands `scalpel-sim bench ...`: measure, print a table, keep the figures."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App, Parameter

from scalpel_sim.console import talking
from scalpel_sim.errors import UsageError
from scalpel_sim.options import Talk

if TYPE_CHECKING:  # `--help` should not wait for it
    from rich.console import Console

MOST_RUNS = 1000
"""More is a slip of the keyboard."""

bench = App(
    name="bench",
    help="Measure the program on this machine: kernels warm, medians over several runs.",
)


@Parameter(name="*")
@dataclass(frozen=True)
class Measuring:
    """How it is measured."""

    runs: int = 5
    "Runs; figures are their medians."
    save: Path | None = None
    "Also write the figures as JSON to this file."


@bench.command
def table1(*, measuring: Measuring = Measuring(), talk: Talk = Talk()) -> None:
    """The three grids of the paper's Table 1, with its own scheme and ours, beside its figures."""
    from scalpel_sim.bench import table1 as benchmark

    def measure() -> list[benchmark.Row]:
        return benchmark.measure(measuring.runs)

    _run("table1", measure, benchmark.print_rows, measuring, talk)


@bench.command
def cut(*, measuring: Measuring = Measuring(), talk: Talk = Talk()) -> None:
    """The cost of a cut step in bodies of 1,000, 10,000 and 100,000 tetrahedra."""
    from scalpel_sim.bench import cut as benchmark

    def measure() -> list[benchmark.CutCost]:
        return benchmark.measure(measuring.runs)

    _run("cut", measure, benchmark.print_costs, measuring, talk)


def _run(
    name: str,
    measure: Callable[[], list[Any]],
    print_table: Callable[[list[Any], "Console"], None],
    measuring: Measuring,
    talk: Talk,
) -> None:
    """Measure, and say and keep what was found; rows are NamedTuples."""
    from rich.console import Console

    from scalpel_sim.bench.results import results_json, save
    from scalpel_sim.outputs import check_file
    from scalpel_sim.ready import load_kernels

    if not 1 <= measuring.runs <= MOST_RUNS:
        raise UsageError(f"--runs is {measuring.runs}; it must be from 1 to {MOST_RUNS}")
    if measuring.save is not None:
        check_file(measuring.save, ".json", "--save")
    with talking(talk):
        load_kernels(talk)
        rows = measure()
    text = results_json(name, measuring.runs, [row._asdict() for row in rows])
    if measuring.save is not None:
        save(measuring.save, text)
    if talk.json:
        print(text)
    elif not talk.quiet:
        print_table(rows, Console())
