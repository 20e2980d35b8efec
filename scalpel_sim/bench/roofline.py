"""How near a step of springs comes to the limits of the machine that it runs on.

The limits are measured in the same rounds: bytes a second from each cache, and multiplications and
additions a second. What a step needs of both is counted from the layout of the engine's arrays. The
larger of the two times is the least that such a step could take; its share of what the step does
take is the figure of merit.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from scalpel_sim.bench.blocks import up_to
from scalpel_sim.bench.engine import Loops
from scalpel_sim.bench.limits import FLOPS_PER_CALL, arithmetic, level_of, triads
from scalpel_sim.bench.machine import Caches, caches
from scalpel_sim.bench.results import HIGHER, Figure, Findings, of_times, of_values
from scalpel_sim.bench.tables import print_figures
from scalpel_sim.bench.timing import CPU, Case, interleaved
from scalpel_sim.bench.traffic import Traffic
from scalpel_sim.bench.watch import SILENT, Watch
from tissue import FloatArray

_SIZES = (6_000, 60_000, 600_000)
"""Of the blocks [tetrahedra]: in a core's own cache, in the shared one, in memory."""
SMALLEST = 576
"""Measured where nothing larger is wanted."""
GIGA = 1e9


class Limit(NamedTuple):
    """The least time that a step could take [s], and what it would wait for."""

    bytes: float
    flops: float
    level: str
    """Where the bytes come from."""

    @property
    def seconds(self) -> float:
        """The larger of the two."""
        return max(self.bytes, self.flops)


def limit(
    traffic: Traffic, bandwidth: dict[str, float], flops_per_second: float, sizes: Caches
) -> Limit:
    """Return the limit of a step with this traffic.

    Args:
        traffic: What a step needs.
        bandwidth: Of each level [bytes/s].
        flops_per_second: That the core can do.
        sizes: Of the caches.
    """
    level = level_of(traffic.working_set, sizes)
    return Limit(traffic.n_bytes / bandwidth[level], traffic.n_flops / flops_per_second, level)


def measure(n_rounds: int, largest: int | None = None, watch: Watch = SILENT) -> Findings:
    """Time the limits and a Runge-Kutta step of springs, in each body up to the largest."""
    sizes = up_to((SMALLEST, *_SIZES), largest)
    sizes = tuple(n for n in sizes if n != SMALLEST) or sizes
    machine = caches()
    levels = triads(machine)
    bodies = {size: Loops(size) for size in sizes}
    cases = [Case(f"triad, {name}", triad.run) for name, triad in levels.items()]
    cases.append(arithmetic())
    cases += [Case(f"step, {n:,} tetrahedra", body.runge_kutta_steps) for n, body in bodies.items()]
    taken = interleaved(cases, n_rounds, clock=CPU, watch=watch)

    of_levels, of_arithmetic, of_steps = (
        taken[: len(levels)], taken[len(levels)], taken[len(levels) + 1 :],
    )  # fmt: skip
    figures = [
        _rate(f"triad from {name}, {triad.n_bytes / 1e6:.3g} MB", "GB/s", triad.n_bytes, rounds)
        for (name, triad), rounds in zip(levels.items(), of_levels, strict=True)
    ]
    figures.append(_rate("multiply and add", "GFLOP/s", FLOPS_PER_CALL, of_arithmetic))
    for (size, body), rounds in zip(bodies.items(), of_steps, strict=True):
        limits = [
            limit(
                body.traffic,
                {
                    name: triad.n_bytes / _median(taken[i][r])
                    for i, (name, triad) in enumerate(levels.items())
                },
                FLOPS_PER_CALL / _median(of_arithmetic[r]),
                machine,
            )
            for r in range(n_rounds)
        ]
        figures += _of_step(size, body.traffic, rounds, limits)
    about = (
        "Triad: a = b + s c, 24 bytes an element. A step's bytes and operations are counted from "
        "the layout of the arrays, as if nothing stayed in a cache between the stages of a step; "
        "its limit is the larger of bytes over the bandwidth of the level that holds the body, and "
        "operations over the peak. Share of the limit: that time over the time taken."
    )
    return Findings(figures, [], partial(print_figures, "roofline", figures, [], about=about))


def _of_step(
    size: int, traffic: Traffic, rounds: Sequence[FloatArray], limits: Sequence[Limit]
) -> list[Figure]:
    """Return the figures of a step in one body."""
    n = traffic.n_springs
    level = limits[0].level
    binding = "bytes" if limits[0].bytes > limits[0].flops else "operations"
    note = (
        f"{traffic.n_bytes / n:.0f} bytes and {traffic.n_flops / n:.0f} operations for each of "
        f"{n:,} springs ({traffic.n_slots / n:.2f} places each), {traffic.working_set:,} bytes "
        f"in all: fed from {level}, limited by {binding}"
    )

    def value(case: str, unit: str, values: list[float]) -> Figure:
        return of_values(
            "roofline", case, size, case, unit, values, clock=CPU.name, better=HIGHER, note=note
        )

    medians = [_median(samples) for samples in rounds]

    def per_spring(seconds: float) -> float:
        return GIGA * seconds / n

    return [
        of_times(
            "roofline", "Runge-Kutta step", size, "time per spring", "ns/spring", rounds,
            clock=CPU.name, convert=per_spring, note=note,
        ),
        value(
            f"share of the limit ({level}, {binding})", "%",
            [100.0 * one.seconds / taken for one, taken in zip(limits, medians, strict=True)],
        ),
        value(
            f"share of the bandwidth of {level}", "%",
            [100.0 * one.bytes / taken for one, taken in zip(limits, medians, strict=True)],
        ),
        value(
            "share of the peak of operations", "%",
            [100.0 * one.flops / taken for one, taken in zip(limits, medians, strict=True)],
        ),
    ]  # fmt: skip


def _rate(case: str, unit: str, amount: float, rounds: Sequence[FloatArray]) -> Figure:
    """Return so much a second."""
    return of_times(
        "roofline", case, None, "rate", unit, rounds, clock=CPU.name, better=HIGHER,
        convert=lambda s: amount / s / GIGA,
    )  # fmt: skip


def _median(samples: FloatArray) -> float:
    return float(np.median(samples))
