"""A frame whose cost is that of the zone around the blade, in bodies of 6,000 to 1,000,000.

The same shallow slit is cut into the upper side of each body; some dozen tetrahedra are split in a
frame that splits any. Only what is near the blade, or moves, is relaxed: by the paper's hierarchy
with its far nodes frozen, as printed, or by local time stepping, where what is at rest sleeps. All
of the frame counts, whatever it is spent on.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.bench.blocks import BLOCKS, CELL, block_mesh, held, up_to
from scalpel_sim.bench.engine import DT, material
from scalpel_sim.bench.machine import memory
from scalpel_sim.bench.memory import that_fit
from scalpel_sim.bench.results import Figure, Findings, Skipped, of_times
from scalpel_sim.bench.tables import compact, number, print_skipped
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
from tissue.integrators.options import IntegratorOptions

if TYPE_CHECKING:
    from rich.console import Console

_SIZES = (6_000, 60_000, 1_000_188)
"""Of the blocks [tetrahedra]."""
_DEPTH, _ABOVE = 1.4, 2.0
"""How far the edge reaches below the upper side, and above [cells]."""
_ASIDE = 0.37
"""Distance of the slit from the grid's planes [cells]: none of it runs along faces that are
there."""
_STEP = 7e-4
"""Way of the blade in a frame [m]: a frame that splits any splits a dozen tetrahedra."""
N_FRAMES = 40
"""With the blade."""
N_AT_REST = 80
"""Frames before it comes: the far nodes of a body at rest fall asleep."""
_SHARP = 1.0
"""Toughness [J/m2]: the blade hardly drags; it cuts where it passes."""
ENTRY = 3
"""First frames, left out: the edge comes into the body."""

WAYS: dict[str, tuple[Law, IntegratorOptions]] = {
    "hierarchical (I 64, s_max 6)": (
        "springs",
        Hierarchical(updates=64, rings=6, far="frozen"),
    ),
    "local, springs": ("springs", LocalTimeStepping()),
    "local, neo-Hookean": ("neo_hookean", LocalTimeStepping()),
}
_US_PER_S = 1e6

_ABOUT = (
    "Whole frames of 1 ms: search, cut, relaxation, the force on the blade, and what Python does. "
    "Cut: frames that split tetrahedra, as many as `splits` on average. Else: the blade moves on "
    "and splits nothing. Share: of the smallest body. CPU time of the thread. Hierarchical is the "
    "paper's relaxation with its rings, whose far nodes stay; local is its heir, whose far nodes "
    "sleep until they are pulled."
)


class Frames(NamedTuple):
    """What the frames of one slit cost."""

    cut: FloatArray
    """CPU time of each that split tetrahedra [s]."""
    splits: FloatArray
    """How many each of them split."""
    other: FloatArray
    """CPU time of the others with the blade in the tissue [s]."""


class Local(NamedTuple):
    """One way to relax in one body; medians."""

    way: str
    tetrahedra: int
    splits: float
    cut: Figure
    other: Figure


def measure(
    n_rounds: int,
    largest: int | None = None,
    watch: Watch = SILENT,
    sizes: Sequence[int] = _SIZES,
) -> Findings:
    """Cut a slit into each body up to the largest, with each way to relax, in turns."""
    sizes, skipped = that_fit(up_to(tuple(sizes), largest), memory(), "local frame")
    cases = [(size, way) for way in WAYS for size in sizes]
    for law, relaxing in WAYS.values():
        _slit(sizes[0], law, relaxing)  # the kernels are loaded
    watch.begin(n_rounds * len(cases))
    rounds: list[list[Frames]] = []
    for _ in range(n_rounds):
        rounds.append([])
        for size, way in cases:
            rounds[-1].append(_slit(size, *WAYS[way]))
            watch.tick(f"{way}, {size:,}")
    found = [
        _local(way, size, frames)
        for (size, way), frames in zip(cases, zip(*rounds, strict=True), strict=True)
    ]
    figures = [figure for each in found for figure in (each.cut, each.other)]
    return Findings(figures, skipped, partial(_print, found, skipped))


def _slit(n_tetrahedra: int, law: Law, relaxing: IntegratorOptions) -> Frames:
    """Cut the slit into a fresh body at rest."""
    mesh = block_mesh(n_tetrahedra)
    sharp = replace(material(law), toughness=_SHARP)
    tissue = Tissue(
        mesh,
        sharp,
        fixed=held(mesh),
        gravity=(0.0, 0.0, 0.0),
        solver=SolverSettings(relaxation=relaxing),
    )
    for _ in range(N_AT_REST):
        tissue.step(None, DT)
    seconds, sizes = np.zeros(N_FRAMES), np.full(N_FRAMES + 1, n_tetrahedra)
    before = _edge(n_tetrahedra, 0)
    with no_garbage_collection():
        for i in range(N_FRAMES):
            after = _edge(n_tetrahedra, i + 1)
            start = CPU.now()
            result = tissue.step(BladeSweep(before, after), DT)
            seconds[i] = CPU.now() - start
            sizes[i + 1] = result.n_tetrahedra
            before = after
    splits = np.diff(sizes).astype(np.float64)[ENTRY:]
    seconds = seconds[ENTRY:]
    return Frames(seconds[splits > 0], splits[splits > 0], seconds[splits == 0])


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


def _local(way: str, size: int, rounds: Sequence[Frames]) -> Local:
    """Return the figures of one way to relax in one body."""
    splits = float(np.mean([each.splits.mean() for each in rounds]))

    def figure(case: str, samples: Sequence[FloatArray], note: str) -> Figure:
        return of_times(
            "local frame", f"{way}: {case}", size, "time", "µs", samples,
            clock=CPU.name, convert=lambda s: _US_PER_S * s, note=note,
        )  # fmt: skip

    return Local(
        way,
        size,
        splits,
        figure("cut frame", [each.cut for each in rounds], f"{splits:.1f} tetrahedra split"),
        figure("blade moves, nothing split", [each.other for each in rounds], ""),
    )


def _print(found: Sequence[Local], skipped: Sequence[Skipped], console: "Console") -> None:
    """Print a row for each way and body."""
    table = compact("local frame, CPU time in µs")
    table.add_column("relaxation")
    for heading in ("tetrahedra", "splits", "cut", "p95", "p99", "share", "else", "n"):
        table.add_column(heading, justify="right")
    for each in found:
        least = next(one for one in found if one.way == each.way)
        table.add_row(
            each.way if each is least else "",
            f"{each.tetrahedra:,}",
            f"{each.splits:.1f}",
            *map(number, (each.cut.median, each.cut.p95, each.cut.p99)),
            f"{each.cut.median / least.cut.median:.2f}",
            number(each.other.median),
            f"{each.cut.n:,}",
        )
    console.print(table)
    print_skipped(skipped, console)
    console.print(_ABOUT, style="dim")
