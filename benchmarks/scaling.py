"""The cost of a step in bodies of 576 to 1,000,188 tetrahedra.

A step of the whole body grows with the body; its time per tetrahedron shows where the mesh outgrows
each cache.
"""

from collections.abc import Sequence
from functools import partial

from benchmarks.blocks import jittered_block, sizes_up_to
from benchmarks.engine import LAW_NAMES, EngineLoops
from benchmarks.memory import sizes_that_fit
from benchmarks.timing import CPU, Case, time_in_turns
from scalpel_sim.validate.speed.machine import memory_bytes
from scalpel_sim.validate.speed.measurements import (
    BenchmarkResult,
    Measurement,
    Quantity,
    summarise_times,
)
from scalpel_sim.validate.speed.tables import print_measurements
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import FloatArray

_SIZES = (576, 6_000, 60_000, 199_800, 600_000, 1_000_188)
"""Sizes of the blocks [tetrahedra]."""
_NS_PER_S, _MS_PER_S = 1e9, 1e3

_ABOUT = (
    "Blocks of jittered cells of 10 mm, held on four sides; one thread; sizes take turns. CPU: CPU "
    "time. A step of the whole body costs the same per tetrahedron until the body outgrows a cache."
)


def measure_scaling(
    n_rounds: int,
    largest: int | None = None,
    watch: Watch = SILENT,
    sizes: Sequence[int] = _SIZES,
) -> BenchmarkResult:
    """Time a Runge-Kutta step at each size up to the largest, under each law."""
    fitting, skipped = sizes_that_fit(
        sizes_up_to(tuple(sizes), largest), memory_bytes(), "scaling", len(LAW_NAMES)
    )
    cases: list[tuple[str, int, Case]] = []
    for size in fitting:
        for law, law_name in LAW_NAMES.items():
            name = f"{law_name}: Runge-Kutta step"
            loops = EngineLoops(jittered_block(size), law)
            cases.append((name, size, Case(f"{name}, {size:,}", loops.runge_kutta_steps)))
    taken = time_in_turns([case for _, _, case in cases], n_rounds, clock=CPU, watch=watch)
    measured: list[Measurement] = []
    for (name, size, _), rounds in zip(cases, taken, strict=True):
        measured += _measurements(name, size, rounds)
    measured.sort(key=lambda each: (each.case, each.unit, each.tetrahedra))
    show = partial(print_measurements, "scaling", measured, skipped, about=_ABOUT)
    return BenchmarkResult(measured, skipped, show)


def _measurements(name: str, size: int, rounds: Sequence[FloatArray]) -> list[Measurement]:
    """Return the time of a step: whole, and per tetrahedron."""
    return [
        summarise_times(
            Quantity("scaling", name, size, "time per tetrahedron", "ns/tet", CPU.name),
            rounds,
            lambda s: _NS_PER_S * s / size,
        ),
        summarise_times(
            Quantity("scaling", name, size, "time", "ms", CPU.name), rounds, lambda s: _MS_PER_S * s
        ),
    ]
