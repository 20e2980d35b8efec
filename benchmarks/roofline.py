"""The limits of this machine, bandwidth and arithmetic, and the share of them that a step uses.

What a Runge-Kutta step of springs moves and computes is counted by hand, stage by stage, from
`tissue.elasticity.springs` and `tissue.integrators.nystroem` as the loops are written: a
change of either is a change here. What a row gathers from its neighbours is not counted as bytes:
the same pass over the nodes reads them anyway.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.engine import (
    VECTOR_LENGTH,
    EngineLoops,
    jittered_block,
    multiply_and_add,
    sizes_up_to,
    triad_pass,
)
from benchmarks.timing import Case, Largest, Rounds, TurnWatch, time_in_turns
from scalpel_sim.validate.speed.machine import CacheSizes, cache_sizes
from scalpel_sim.validate.speed.measurements import (
    CPU,
    HIGHER,
    BenchmarkResult,
    Measurement,
    Quantity,
    summarise_times,
    summarise_values,
)
from scalpel_sim.validate.speed.tables import as_rows
from scalpel_sim.validate.speed.watch import SILENT
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

BYTES_PER_ELEMENT = 24
"""Bytes of an element of the triad: two doubles read, one written. The line that a store must fetch
first is not counted, as in McCalpin's STREAM."""
N_CHAINS = 8
"""Vectors that `multiply_and_add` updates in turn: an operation takes 4 cycles, and two may begin
in each cycle, so that fewer vectors would wait for their own results."""
N_LINKS = 1000
"""Updates of each vector in a call."""
FLOPS_PER_CALL = 2 * VECTOR_LENGTH * N_CHAINS * N_LINKS
"""Operations of a call: a multiplication and an addition for each number and update."""
BEYOND_CACHES = 3.0
"""Size of the largest triad, in sizes of the last cache: what it reads has been evicted since it
was read before."""

VECTOR_BYTES = 24
"""Bytes of a position, velocity or force."""
NODE_BYTES = 8 + 8 + 8 + 1
"""Bytes of a node's row (start and length), its mass, and whether it is held."""
ELASTIC_SLOT_BYTES = 4 + 8 + 8
"""Bytes of a slot of a row: neighbour, stiffness, rest pull."""
DAMPING_SLOT_BYTES = 4 + 8
"""Bytes of a slot of a row without the rest pull."""


class StageCost(NamedTuple):
    """Memory traffic and operations of one stage of the step, which passes over all rows."""

    slot_bytes: int
    """Bytes of each slot of a row."""
    slot_flops: int
    """Operations for each slot; a square root or a division counts as one."""
    node_vectors: int
    """Vectors of each node that are read or written."""
    node_flops: int
    """Operations for each node besides those of its row."""


_UNDAMPED_STAGES = (
    StageCost(ELASTIC_SLOT_BYTES, 18, 3 + 3, 34),
    StageCost(ELASTIC_SLOT_BYTES, 18, 3 + 3 + 3, 46),
    StageCost(ELASTIC_SLOT_BYTES, 18, 3 + 4 + 2, 64),
)
DAMPED_STAGES = (*_UNDAMPED_STAGES, StageCost(DAMPING_SLOT_BYTES, 25, 2 + 1 + 3, 20))
"""Forces at three positions, and dampers once a step."""

VECTORS_PER_NODE = 9
"""Vectors of a node that a step touches: position, velocity, and seven of scratch."""


class StepTraffic(NamedTuple):
    """Least memory traffic and operations of one step."""

    n_springs: int
    n_slots: int
    """Slots in the rows: each spring has two, and rows are filled up to whole vectors."""
    n_bytes: int
    """Bytes that a step reads and writes, if nothing stayed in a cache from stage to stage."""
    n_flops: int
    """Operations of a step."""
    working_set: int
    """Bytes of all arrays that a step touches: the cache that holds them feeds it."""


def step_traffic(row_lengths: list[int], *, is_damped: bool) -> StepTraffic:
    """Return the traffic of a step of nodes with these numbers of springs."""
    n_nodes = len(row_lengths)
    n_slots = sum(-(-length // VECTOR_LENGTH) * VECTOR_LENGTH for length in row_lengths)
    stages = DAMPED_STAGES if is_damped else _UNDAMPED_STAGES
    return StepTraffic(
        n_springs=sum(row_lengths) // 2,
        n_slots=n_slots,
        n_bytes=sum(
            stage.slot_bytes * n_slots + (VECTOR_BYTES * stage.node_vectors + NODE_BYTES) * n_nodes
            for stage in stages
        ),
        n_flops=sum(stage.slot_flops * n_slots + stage.node_flops * n_nodes for stage in stages),
        working_set=ELASTIC_SLOT_BYTES * n_slots
        + (VECTOR_BYTES * VECTORS_PER_NODE + NODE_BYTES) * n_nodes,
    )


class Triad:
    """The loop a = b + s c over arrays that fill a number of bytes together."""

    def __init__(self, n_bytes: int) -> None:
        n = n_bytes // BYTES_PER_ELEMENT
        self.n_bytes = n * BYTES_PER_ELEMENT
        self._a, self._b, self._c = np.zeros(n), np.ones(n), np.ones(n)

    def run(self, n: int) -> None:
        """Run the loop `n` times."""
        triad_pass(self._a, self._b, self._c, n)


def triads_by_level(sizes: CacheSizes) -> dict[str, Triad]:
    """Return a triad for each level, by its name: half of a cache, and more than the last."""
    return {
        "L1": Triad(sizes.l1 // 2),
        "L2": Triad(sizes.l2 // 2),
        "L3": Triad(sizes.l3 // 4),
        "memory": Triad(round(BEYOND_CACHES * sizes.l3)),
    }


def memory_level(working_set: int, sizes: CacheSizes) -> str:
    """Return the level that feeds a loop over this many bytes."""
    for name, size in zip(("L1", "L2", "L3"), sizes, strict=True):
        if working_set <= size:
            return name
    return "memory"


def arithmetic_case() -> Case:
    """Return a case that only multiplies and adds, in the engine's own vectors."""
    values = np.zeros(N_CHAINS * VECTOR_LENGTH)
    return Case("multiply and add", lambda n: multiply_and_add(values, n * N_LINKS))


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


def roofline(
    *, runs: Rounds = 5, watch: TurnWatch = SILENT, largest: Largest = None
) -> BenchmarkResult:
    """Measure bandwidth and arithmetic of this machine, and the share of them that a step uses."""
    sizes = sizes_up_to((_SMALLEST, *_SIZES), largest)
    sizes = tuple(n for n in sizes if n != _SMALLEST) or sizes
    caches = cache_sizes()
    triads = triads_by_level(caches)
    bodies = {size: EngineLoops(jittered_block(size)) for size in sizes}
    cases = [Case(f"triad, {name}", triad.run) for name, triad in triads.items()]
    cases.append(arithmetic_case())
    cases += [Case(f"step, {n:,} tetrahedra", body.runge_kutta_steps) for n, body in bodies.items()]
    taken = time_in_turns(cases, runs, clock=CPU, watch=watch)

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
            for r in range(runs)
        ]
        measured += _step_measurements(size, traffic, rounds, limits)
    return as_rows("roofline", measured, about=_ABOUT)


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
