"""How close a step of springs comes to the limits of the machine that it runs on.

The limits are measured in the same rounds: bytes per second from each cache, and multiplications
and additions per second. What a step needs of both is counted from the layout of the engine's
arrays. The larger of the two times is the least that such a step could take; its share of the time
that the step does take is the figure of merit.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from benchmarks.blocks import jittered_block, sizes_up_to
from benchmarks.engine import EngineLoops
from benchmarks.limits import (
    FLOPS_PER_CALL,
    Triad,
    arithmetic_case,
    memory_level,
    triads_by_level,
)
from benchmarks.timing import CPU, Case, time_in_turns
from benchmarks.traffic import StepTraffic, step_traffic
from scalpel_sim.validate.speed.machine import CacheSizes, cache_sizes
from scalpel_sim.validate.speed.measurements import (
    HIGHER,
    BenchmarkResult,
    Measurement,
    Quantity,
    summarise_times,
    summarise_values,
)
from scalpel_sim.validate.speed.tables import print_measurements
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import FloatArray

_SIZES = (6_000, 60_000, 600_000)
"""Sizes of the blocks [tetrahedra]: in a core's own cache, in the shared cache, in memory."""
_SMALLEST = 576
"""Size that is measured only where no larger one is wanted [tetrahedra]."""
_GIGA = 1e9

_ABOUT = (
    "Triad: a = b + s c, 24 bytes per element. Bytes and operations of a step are counted from "
    "the layout of the arrays, as if nothing stayed in a cache between the stages of a step; the "
    "limit is the larger of bytes over the bandwidth of the level that holds the body, and "
    "operations over the peak. Share of the limit: that time over the time taken."
)


class RooflineBound(NamedTuple):
    """The least time that a step could take."""

    bytes_seconds: float
    """Time to move its bytes [s]."""
    flops_seconds: float
    """Time to do its operations [s]."""
    level: str
    """The cache, or memory, that the bytes come from."""

    @property
    def seconds(self) -> float:
        """The larger of the two times [s]."""
        return max(self.bytes_seconds, self.flops_seconds)


def roofline_bound(
    traffic: StepTraffic, bandwidth: dict[str, float], flops_per_second: float, sizes: CacheSizes
) -> RooflineBound:
    """Return the limit of a step.

    Args:
        traffic: What the step moves and computes.
        bandwidth: Bandwidth of each level [bytes/s].
        flops_per_second: Peak of the core [operations/s].
        sizes: Sizes of the caches.
    """
    level = memory_level(traffic.working_set, sizes)
    return RooflineBound(
        traffic.n_bytes / bandwidth[level], traffic.n_flops / flops_per_second, level
    )


def measure_roofline(
    n_rounds: int, largest: int | None = None, watch: Watch = SILENT
) -> BenchmarkResult:
    """Time the limits and a Runge-Kutta step of springs, in each body up to the largest."""
    sizes = sizes_up_to((_SMALLEST, *_SIZES), largest)
    sizes = tuple(n for n in sizes if n != _SMALLEST) or sizes
    caches = cache_sizes()
    triads = triads_by_level(caches)
    bodies = {size: EngineLoops(jittered_block(size)) for size in sizes}
    cases = [Case(f"triad, {name}", triad.run) for name, triad in triads.items()]
    cases.append(arithmetic_case())
    cases += [Case(f"step, {n:,} tetrahedra", body.runge_kutta_steps) for n, body in bodies.items()]
    taken = time_in_turns(cases, n_rounds, clock=CPU, watch=watch)

    n_levels = len(triads)
    of_triads = dict(zip(triads, taken[:n_levels], strict=True))
    of_arithmetic, of_steps = taken[n_levels], taken[n_levels + 1 :]
    measured = [
        _rate(f"triad from {name}, {t.n_bytes / 1e6:.3g} MB", "GB/s", t.n_bytes, of_triads[name])
        for name, t in triads.items()
    ]
    measured.append(_rate("multiply and add", "GFLOP/s", FLOPS_PER_CALL, of_arithmetic))
    for (size, body), rounds in zip(bodies.items(), of_steps, strict=True):
        traffic = step_traffic(body.springs_per_node, is_damped=True)
        limits = [
            roofline_bound(
                traffic,
                _bandwidths(triads, of_triads, r),
                FLOPS_PER_CALL / _median(of_arithmetic[r]),
                caches,
            )
            for r in range(n_rounds)
        ]
        measured += _step_measurements(size, traffic, rounds, limits)
    show = partial(print_measurements, "roofline", measured, [], about=_ABOUT)
    return BenchmarkResult(measured, [], show)


def _bandwidths(
    triads: dict[str, Triad], of_triads: dict[str, list[FloatArray]], n: int
) -> dict[str, float]:
    """Return the bandwidth of each level in a round [bytes/s]."""
    return {name: triad.n_bytes / _median(of_triads[name][n]) for name, triad in triads.items()}


def _step_measurements(
    size: int, traffic: StepTraffic, rounds: Sequence[FloatArray], limits: Sequence[RooflineBound]
) -> list[Measurement]:
    """Return the measurements of a step in one body."""
    n = traffic.n_springs
    level = limits[0].level
    binding = "bytes" if limits[0].bytes_seconds > limits[0].flops_seconds else "operations"
    note = (
        f"{traffic.n_bytes / n:.0f} bytes and {traffic.n_flops / n:.0f} operations for each of "
        f"{n:,} springs ({traffic.n_slots / n:.2f} slots each), {traffic.working_set:,} bytes "
        f"in all: fed from {level}, limited by {binding}"
    )
    medians = [_median(samples) for samples in rounds]

    def share(case: str, least_seconds: Sequence[float]) -> Measurement:
        quantity = Quantity("roofline", case, size, case, "%", CPU.name, HIGHER, note)
        shares = [100.0 * s / taken for s, taken in zip(least_seconds, medians, strict=True)]
        return summarise_values(quantity, shares)

    time_per_spring = Quantity(
        "roofline", "Runge-Kutta step", size, "time per spring", "ns/spring", CPU.name, note=note
    )
    return [
        summarise_times(time_per_spring, rounds, lambda s: _GIGA * s / n),
        share(f"share of the limit ({level}, {binding})", [each.seconds for each in limits]),
        share(f"share of the bandwidth of {level}", [each.bytes_seconds for each in limits]),
        share("share of the peak of operations", [each.flops_seconds for each in limits]),
    ]


def _rate(case: str, unit: str, amount: float, rounds: Sequence[FloatArray]) -> Measurement:
    """Return the measurement of an amount per second."""
    quantity = Quantity("roofline", case, None, "rate", unit, CPU.name, HIGHER)
    return summarise_times(quantity, rounds, lambda s: amount / s / _GIGA)


def _median(samples: FloatArray) -> float:
    return float(np.median(samples))
