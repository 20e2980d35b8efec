"""The engine's loops one by one: forces, steps, a cut step, and contact."""

from benchmarks.engine import LAW_NAMES, EngineLoops, TouchingBlocks, jittered_block, sizes_up_to
from benchmarks.scaling import SMALLEST_CUT, cut
from benchmarks.timing import Case, Largest, Rounds, TurnWatch, time_in_turns
from scalpel_sim.validate.speed.measurements import (
    CPU,
    BenchmarkResult,
    Measurement,
    Quantity,
    summarise_times,
)
from scalpel_sim.validate.speed.tables import as_rows
from scalpel_sim.validate.speed.watch import SILENT
from tissue import FloatArray

_SIZES = (576, 5_400, 20_250, 60_000)
"""Sizes of the blocks [tetrahedra]."""
_TOUCHING_SIZE = 5_400
"""Size of each of the two blocks that touch [tetrahedra]."""
_NS_PER_S, _US_PER_S = 1e9, 1e6

_ABOUT = (
    "ns/tet: ns per tetrahedron. Blocks of jittered cells of 10 mm, held on four sides; one "
    "thread. CPU: CPU time. Forces: one evaluation, dampers included. A Runge-Kutta step evaluates "
    "forces three times and dampers four times. The time step includes everything that is done in "
    "1 ms without a blade."
)


def kernels(
    *, runs: Rounds = 5, watch: TurnWatch = SILENT, largest: Largest = None
) -> BenchmarkResult:
    """Time forces, steps, a cut step and contact detection in 576 to 60,000 tetrahedra."""
    sizes = sizes_up_to(_SIZES, largest)
    cases: list[Case] = []
    quantities: list[Quantity] = []
    for size in sizes:
        for law, law_name in LAW_NAMES.items():
            loops = EngineLoops(jittered_block(size), law)
            for what, run in (
                ("forces", loops.forces),
                ("Runge-Kutta step", loops.runge_kutta_steps),
                ("time step of 1 ms", loops.frames),
            ):
                name = f"{law_name}: {what}"
                cases.append(Case(f"{name}, {size:,}", run))
                quantities.append(Quantity("kernels", name, size, "time", "ns/tet", CPU.name))
    touching_size = min(_TOUCHING_SIZE, sizes[-1])
    touching = TouchingBlocks(touching_size)
    for name, run in (
        ("contact: new search", touching.new_searches),
        ("contact: search", touching.searches),
        ("contact: forces of a step", touching.forces),
    ):
        cases.append(Case(name, run))
        quantities.append(Quantity("kernels", name, 2 * touching_size, "time", "µs", CPU.name))
    taken = time_in_turns(cases, runs, clock=CPU, watch=watch)
    measured = [_summary(each, rounds) for each, rounds in zip(quantities, taken, strict=True)]
    measured += cut(runs=runs, watch=watch, largest=SMALLEST_CUT).measurements
    return as_rows("kernels", measured, about=_ABOUT)


def _summary(quantity: Quantity, rounds: list[FloatArray]) -> Measurement:
    """Return the measurement of a loop: its whole time, or its time per tetrahedron."""
    size = quantity.tetrahedra
    if quantity.unit == "ns/tet" and size is not None:
        return summarise_times(quantity, rounds, lambda s: _NS_PER_S * s / size)
    return summarise_times(quantity, rounds, lambda s: _US_PER_S * s)
