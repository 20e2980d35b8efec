"""The engine's loops one by one: forces, steps, a cut step, and contact."""

from functools import partial

from benchmarks.blocks import jittered_block, sizes_up_to
from benchmarks.cut import CUT_BLOCKS, measure_cut_steps
from benchmarks.engine import LAW_NAMES, EngineLoops, TouchingBlocks
from benchmarks.timing import CPU, Case, time_in_turns
from scalpel_sim.validate.speed.measurements import (
    BenchmarkResult,
    Measurement,
    Quantity,
    summarise_times,
)
from scalpel_sim.validate.speed.tables import print_measurements
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import FloatArray

_SIZES = (576, 5_400, 20_250, 60_000)
"""Sizes of the blocks [tetrahedra]."""
TOUCHING_SIZE = 5_400
"""Size of each of the two blocks that touch [tetrahedra]."""
_NS_PER_S, _US_PER_S = 1e9, 1e6

_ABOUT = (
    "ns/tet: ns per tetrahedron. Blocks of jittered cells of 10 mm, held on four sides; one "
    "thread. CPU: CPU time. Forces: one evaluation, dampers included. A Runge-Kutta step evaluates "
    "forces three times and dampers four times. The time step includes everything that is done in "
    "1 ms without a blade."
)


def measure_kernels(
    n_rounds: int, largest: int | None = None, watch: Watch = SILENT
) -> BenchmarkResult:
    """Time every loop, at each size up to the largest."""
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
    touching_size = min(TOUCHING_SIZE, sizes[-1])
    touching = TouchingBlocks(touching_size)
    for name, run in (
        ("contact: search anew", touching.searches_anew),
        ("contact: search", touching.searches),
        ("contact: forces of a step", touching.forces),
    ):
        cases.append(Case(name, run))
        quantities.append(Quantity("kernels", name, 2 * touching_size, "time", "µs", CPU.name))
    taken = time_in_turns(cases, n_rounds, clock=CPU, watch=watch)
    measured = [_summary(each, rounds) for each, rounds in zip(quantities, taken, strict=True)]
    measured += measure_cut_steps(n_rounds, CUT_BLOCKS[:1], watch).measurements
    show = partial(print_measurements, "kernels", measured, [], about=_ABOUT)
    return BenchmarkResult(measured, [], show)


def _summary(quantity: Quantity, rounds: list[FloatArray]) -> Measurement:
    """Return the measurement of a loop: its whole time, or its time per tetrahedron."""
    size = quantity.tetrahedra
    if quantity.unit == "ns/tet" and size is not None:
        return summarise_times(quantity, rounds, lambda s: _NS_PER_S * s / size)
    return summarise_times(quantity, rounds, lambda s: _US_PER_S * s)
