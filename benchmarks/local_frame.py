"""The cost of a frame that is local: it depends on the zone around the blade, not on the body.

The same shallow slit is cut into the upper side of bodies of 6,000 to 1,000,188 tetrahedra. In a
frame that splits any, about a dozen tetrahedra are split. Only what is near the blade is relaxed:
by the paper's hierarchy with its far nodes frozen, as printed. The times are those of whole frames.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from benchmarks.blocks import BLOCKS, CELL, held_nodes, jittered_block, sizes_up_to
from benchmarks.engine import FRAME_DT, block_material
from benchmarks.memory import sizes_that_fit
from benchmarks.timing import CPU
from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.machine import memory_bytes
from scalpel_sim.validate.speed.measurements import (
    BenchmarkResult,
    Measurement,
    Quantity,
    Skipped,
    summarise_times,
)
from scalpel_sim.validate.speed.tables import compact_table, print_skipped, three_digits
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import (
    BladeSegment,
    BladeSweep,
    FloatArray,
    Hierarchical,
    SolverSettings,
    Tissue,
)

if TYPE_CHECKING:
    from rich.console import Console

_SIZES = (6_000, 60_000, 1_000_188)
"""Sizes of the blocks [tetrahedra]."""
_DEPTH, _ABOVE = 1.4, 2.0
"""How far the edge reaches below the upper side, and above it [cells]."""
_ASIDE = 0.37
"""Distance of the slit from the planes of the grid [cells]: no part of it runs along existing
faces."""
_STEP = 7e-4
"""Displacement of the blade in a frame [m]: a frame that splits any splits about a dozen
tetrahedra."""
N_FRAMES = 40
"""Frames with the blade."""
_TOUGHNESS = 1.0
"""Toughness [J/m2], so low that the blade hardly drags the tissue along and cuts where it
passes."""
N_ENTRY = 3
"""First frames, which are not counted: the edge enters the body."""

RELAXATION = Hierarchical(updates=64, rings=6, far="frozen")
"""The paper's rings; nodes beyond them do not move."""
RELAXATION_NAME = "hierarchical (I 64, s_max 6)"
"""Its name in the tables."""
_US_PER_S = 1e6

_ABOUT = (
    "Whole frames of 1 ms: detection, cut, relaxation, the force on the blade, and the work of "
    "Python. Cut: frames that split tetrahedra, `splits` of them on average. Else: frames in which "
    "the blade moves on and splits nothing. Share: of the time in the smallest body. CPU time of "
    "the thread. Hierarchical: the paper's relaxation by rings, whose far nodes stay fixed."
)


class SlitFrames(NamedTuple):
    """What the frames of one slit cost."""

    cut: FloatArray
    """CPU time of each frame that split tetrahedra [s]."""
    splits: FloatArray
    """Number of tetrahedra that each of those frames split."""
    other: FloatArray
    """CPU time of each other frame with the blade in the tissue [s]."""


class LocalFrameCost(NamedTuple):
    """The cost of a frame in one body, medians over rounds."""

    tetrahedra: int
    splits: float
    """Mean number of tetrahedra split in a frame that splits any."""
    cut: Measurement
    other: Measurement


def measure_local_frames(
    n_rounds: int,
    largest: int | None = None,
    watch: Watch = SILENT,
    sizes: Sequence[int] = _SIZES,
) -> BenchmarkResult:
    """Cut a slit into each body up to the largest, in turns."""
    fitting, skipped = sizes_that_fit(
        sizes_up_to(tuple(sizes), largest), memory_bytes(), "local frame"
    )
    _cut_slit(fitting[0])  # loads the kernels
    watch.begin(n_rounds * len(fitting))
    rounds: list[list[SlitFrames]] = []
    for _ in range(n_rounds):
        rounds.append([])
        for size in fitting:
            rounds[-1].append(_cut_slit(size))
            watch.tick(f"{RELAXATION_NAME}, {size:,}")
    costs = [
        _cost(size, frames) for size, frames in zip(fitting, zip(*rounds, strict=True), strict=True)
    ]
    measured = [measurement for each in costs for measurement in (each.cut, each.other)]
    return BenchmarkResult(measured, skipped, partial(_print, costs, skipped))


def _cut_slit(n_tetrahedra: int) -> SlitFrames:
    """Cut the slit into a new body at rest."""
    mesh = jittered_block(n_tetrahedra)
    tissue = Tissue(
        mesh,
        replace(block_material("springs"), toughness=_TOUGHNESS),
        fixed=held_nodes(mesh),
        gravity=(0.0, 0.0, 0.0),
        solver=SolverSettings(relaxation=RELAXATION),
    )
    seconds, sizes = np.zeros(N_FRAMES), np.full(N_FRAMES + 1, n_tetrahedra)
    before = _edge(n_tetrahedra, 0)
    with no_garbage_collection():
        for i in range(N_FRAMES):
            after = _edge(n_tetrahedra, i + 1)
            start = CPU.now()
            result = tissue.step(BladeSweep(before, after), FRAME_DT)
            seconds[i] = CPU.now() - start
            sizes[i + 1] = result.n_tetrahedra
            before = after
    splits = np.diff(sizes).astype(np.float64)[N_ENTRY:]
    seconds = seconds[N_ENTRY:]
    return SlitFrames(seconds[splits > 0], splits[splits > 0], seconds[splits == 0])


def _edge(n_tetrahedra: int, frame: int) -> BladeSegment:
    """Return the upright edge in a frame; the slit is in the middle of the body."""
    cells = BLOCKS[n_tetrahedra]
    x = CELL * (cells[0] // 2 + _ASIDE)
    y = 0.5 * (CELL * cells[1] - _STEP * N_FRAMES) + _STEP * frame
    top = CELL * cells[2]
    return BladeSegment(
        np.array([x, y, top - _DEPTH * CELL]),
        np.array([x, y, top + _ABOVE * CELL]),
        np.array([0.0, 1.0, 0.0]),
    )


def _cost(size: int, rounds: Sequence[SlitFrames]) -> LocalFrameCost:
    """Return the cost in one body."""
    splits = float(np.mean([each.splits.mean() for each in rounds]))

    def measurement(case: str, samples: Sequence[FloatArray], note: str) -> Measurement:
        quantity = Quantity(
            "local frame", f"{RELAXATION_NAME}: {case}", size, "time", "µs", CPU.name, note=note
        )
        return summarise_times(quantity, samples, lambda s: _US_PER_S * s)

    return LocalFrameCost(
        size,
        splits,
        measurement("cut frame", [each.cut for each in rounds], f"{splits:.1f} tetrahedra split"),
        measurement("blade moves, nothing split", [each.other for each in rounds], ""),
    )


def _print(costs: Sequence[LocalFrameCost], skipped: Sequence[Skipped], console: "Console") -> None:
    """Print a row for each body."""
    table = compact_table("local frame, CPU time in µs")
    table.add_column("relaxation")
    for heading in ("tetrahedra", "splits", "cut", "p95", "p99", "share", "else", "n"):
        table.add_column(heading, justify="right")
    for each in costs:
        smallest = costs[0]
        table.add_row(
            RELAXATION_NAME if each is smallest else "",
            f"{each.tetrahedra:,}",
            f"{each.splits:.1f}",
            *map(three_digits, (each.cut.median, each.cut.p95, each.cut.p99)),
            f"{each.cut.median / smallest.cut.median:.2f}",
            three_digits(each.other.median),
            f"{each.cut.n:,}",
        )
    console.print(table)
    print_skipped(skipped, console)
    console.print(_ABOUT, style="dim")
