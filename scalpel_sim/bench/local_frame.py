"""The cost of a frame that is local: it depends on the zone around the blade, not on the body.

The same shallow slit is cut into the upper side of bodies of 6,000 to 1,000,188 tetrahedra. In a
frame that splits any, about a dozen tetrahedra are split. Only what is near the blade, or moves, is
relaxed: by the paper's hierarchy with its far nodes frozen, as printed, or by local time stepping,
where what is at rest sleeps. The times are those of whole frames.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.bench.blocks import BLOCKS, CELL, held_nodes, jittered_block, sizes_up_to
from scalpel_sim.bench.engine import FRAME_DT, block_material
from scalpel_sim.bench.machine import memory_bytes
from scalpel_sim.bench.memory import sizes_that_fit
from scalpel_sim.bench.results import (
    BenchmarkResult,
    Measurement,
    Quantity,
    Skipped,
    summarise_times,
)
from scalpel_sim.bench.tables import compact_table, print_skipped, three_digits
from scalpel_sim.bench.timing import CPU
from scalpel_sim.bench.watch import SILENT, Watch
from scalpel_sim.simulation import no_garbage_collection
from tissue import (
    BladeSegment,
    BladeSweep,
    FloatArray,
    Hierarchical,
    Law,
    LocalTimeStepping,
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
N_AT_REST = 80
"""Frames before the blade arrives: the far nodes of a body at rest fall asleep."""
_TOUGHNESS = 1.0
"""Toughness [J/m2], so low that the blade hardly drags the tissue along and cuts where it
passes."""
N_ENTRY = 3
"""First frames, which are not counted: the edge enters the body."""

BENCHED_RELAXATIONS: dict[str, tuple[Law, Hierarchical | LocalTimeStepping]] = {
    "hierarchical (I 64, s_max 6)": (
        "springs",
        Hierarchical(updates=64, rings=6, far="frozen"),
    ),
    "local, springs": ("springs", LocalTimeStepping()),
    "local, neo-Hookean": ("neo_hookean", LocalTimeStepping()),
}
"""Law of elasticity and relaxation, by the name in the tables."""
_US_PER_S = 1e6

_ABOUT = (
    "Whole frames of 1 ms: detection, cut, relaxation, the force on the blade, and the work of "
    "Python. Cut: frames that split tetrahedra, `splits` of them on average. Else: frames in which "
    "the blade moves on and splits nothing. Share: of the time in the smallest body. CPU time of "
    "the thread. Hierarchical: the paper's relaxation by rings, whose far nodes stay fixed. Local: "
    "its successor, whose far nodes sleep until they are pulled."
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
    """The cost of a frame with one relaxation in one body, medians over rounds."""

    relaxation: str
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
    """Cut a slit into each body up to the largest, with each relaxation, in turns."""
    fitting, skipped = sizes_that_fit(
        sizes_up_to(tuple(sizes), largest), memory_bytes(), "local frame"
    )
    cases = [(size, name) for name in BENCHED_RELAXATIONS for size in fitting]
    for law, relaxation in BENCHED_RELAXATIONS.values():
        _cut_slit(fitting[0], law, relaxation)  # loads the kernels
    watch.begin(n_rounds * len(cases))
    rounds: list[list[SlitFrames]] = []
    for _ in range(n_rounds):
        rounds.append([])
        for size, name in cases:
            rounds[-1].append(_cut_slit(size, *BENCHED_RELAXATIONS[name]))
            watch.tick(f"{name}, {size:,}")
    costs = [
        _cost(name, size, frames)
        for (size, name), frames in zip(cases, zip(*rounds, strict=True), strict=True)
    ]
    measured = [measurement for each in costs for measurement in (each.cut, each.other)]
    return BenchmarkResult(measured, skipped, partial(_print, costs, skipped))


def _cut_slit(
    n_tetrahedra: int, law: Law, relaxation: Hierarchical | LocalTimeStepping
) -> SlitFrames:
    """Cut the slit into a new body at rest."""
    mesh = jittered_block(n_tetrahedra)
    tissue = Tissue(
        mesh,
        replace(block_material(law), toughness=_TOUGHNESS),
        fixed=held_nodes(mesh),
        gravity=(0.0, 0.0, 0.0),
        solver=SolverSettings(relaxation=relaxation),
    )
    for _ in range(N_AT_REST):
        tissue.step(None, FRAME_DT)
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


def _cost(name: str, size: int, rounds: Sequence[SlitFrames]) -> LocalFrameCost:
    """Return the cost with one relaxation in one body."""
    splits = float(np.mean([each.splits.mean() for each in rounds]))

    def measurement(case: str, samples: Sequence[FloatArray], note: str) -> Measurement:
        quantity = Quantity(
            "local frame", f"{name}: {case}", size, "time", "µs", CPU.name, note=note
        )
        return summarise_times(quantity, samples, lambda s: _US_PER_S * s)

    return LocalFrameCost(
        name,
        size,
        splits,
        measurement("cut frame", [each.cut for each in rounds], f"{splits:.1f} tetrahedra split"),
        measurement("blade moves, nothing split", [each.other for each in rounds], ""),
    )


def _print(costs: Sequence[LocalFrameCost], skipped: Sequence[Skipped], console: "Console") -> None:
    """Print a row for each relaxation and body."""
    table = compact_table("local frame, CPU time in µs")
    table.add_column("relaxation")
    for heading in ("tetrahedra", "splits", "cut", "p95", "p99", "share", "else", "n"):
        table.add_column(heading, justify="right")
    for each in costs:
        smallest = next(one for one in costs if one.relaxation == each.relaxation)
        table.add_row(
            each.relaxation if each is smallest else "",
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
