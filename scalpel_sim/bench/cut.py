"""What a cut step costs as the body grows around it, while the blade does the same to it.

Three blocks of the same cells, of some 1,000, 10,000 and 100,000 tetrahedra, get the same slit in
the middle of their upper side. Every node is held, so that the blade meets the same tetrahedra in
each: what differs is only how much body there is around. A cut step is the paper's CD and GC:
search, splitting, un-gluing, and the springs and masses that change; RX, which must move all nodes,
is no part of it.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.bench.results import Figure, Findings, of_times
from scalpel_sim.bench.timing import WALL
from scalpel_sim.bench.watch import SILENT, Watch
from scalpel_sim.simulation import no_garbage_collection
from tissue import BladeSegment, BladeSweep, FloatArray, Material, Tissue, block

if TYPE_CHECKING:
    from rich.console import Console

_Cells = tuple[int, int, int]

CELLS: tuple[_Cells, ...] = ((5, 6, 6), (11, 12, 13), (25, 26, 26))
"""Of the blocks along x, y and z: 1,080, 10,296 and 101,400 tetrahedra."""
_CELL = 5e-3
"""Side of a cell [m]."""
SLIT = 3.5
"""Length of the slit [cells]."""
_DEPTH, _ABOVE = 3.37, 2.0
"""How far the edge reaches below the upper side, and above [cells]."""
_ASIDE = 0.37
"""Distance of the slit from the grid's planes [cells]: none of it runs along faces that are
there."""
_STEP = 2.5e-4
"""Way of the blade in a step [m]: 0.25 m/s at 1 kHz, fast for a hand."""
_DT = 1e-3
"""[s]."""
_SHARP = Material(toughness=1.0)
"""The blade hardly drags: it cuts where it passes."""

_US_PER_S = 1e6


class Slit(NamedTuple):
    """What cutting one block cost, step by step."""

    n_tetrahedra: int
    """Before the cut."""
    steps: FloatArray
    """Wall time of each step in which the mesh changed [s]."""
    splits: FloatArray
    """Tetrahedra split in each of them: each split leaves one more than there were."""
    idle: FloatArray
    """Wall time of each step with the blade in the tissue in which nothing was split [s]."""


class CutCost(NamedTuple):
    """Cost of cutting one block, medians over runs; times in seconds of wall time."""

    n_tetrahedra: int
    """Before the cut."""
    n_split: int
    """Tetrahedra that were split."""
    n_steps: int
    """Steps in which the mesh changed."""
    step_mean: float
    """Mean of those steps [s], the occasional growth of arrays included."""
    step_longest: float
    """[s]."""
    idle_median: float
    """Median of the steps in which nothing was split [s]."""
    per_split: float
    """Time of the steps that split, for each split tetrahedron [s]."""


def measure(n_rounds: int, blocks: Sequence[_Cells] = CELLS, watch: Watch = SILENT) -> Findings:
    """Return the cost for each block, over so many rounds, in which blocks take turns."""
    slits = slits_of(n_rounds, blocks, watch)
    return Findings(_figures(slits), [], partial(print_costs, list(map(cost_of, slits))))


def slits_of(
    n_rounds: int, blocks: Sequence[_Cells] = CELLS, watch: Watch = SILENT
) -> list[list[Slit]]:
    """Return what each round cost, for each block."""
    _run(blocks[0])  # the kernels are loaded, and the processor is awake
    watch.begin(n_rounds * len(blocks))
    rounds = [[_turn(cells, watch) for cells in blocks] for _ in range(n_rounds)]
    return [list(slits) for slits in zip(*rounds, strict=True)]


def cost_of(slits: Sequence[Slit]) -> CutCost:
    """Return the median of each figure over the rounds; counts are the same in all."""
    first = slits[0]
    return CutCost(
        n_tetrahedra=first.n_tetrahedra,
        n_split=int(first.splits.sum()),
        n_steps=len(first.steps),
        step_mean=float(np.median([slit.steps.mean() for slit in slits])),
        step_longest=float(np.median([slit.steps.max() for slit in slits])),
        idle_median=float(np.median([np.median(slit.idle) for slit in slits])),
        per_split=float(np.median([slit.steps.sum() / slit.splits.sum() for slit in slits])),
    )


def _figures(blocks: Sequence[Sequence[Slit]]) -> list[Figure]:
    """Return what a cut step, a split, and a step without a split cost: every step is a sample."""
    figures = []
    for slits in blocks:
        for case, samples in (
            ("cut step", [s.steps for s in slits]),
            ("split tetrahedron", [s.steps / s.splits for s in slits]),
            ("blade moves, nothing split", [s.idle for s in slits]),
        ):
            figures.append(
                of_times(
                    "cut", case, slits[0].n_tetrahedra, "time", "µs", samples,
                    clock=WALL.name, convert=lambda s: _US_PER_S * s,
                )
            )  # fmt: skip
    return figures


def print_costs(costs: Sequence[CutCost], console: "Console") -> None:
    """Print the costs as a table."""
    from rich.table import Table

    table = Table(title="cost of a cut step, wall time in µs", title_justify="left")
    for heading in ("tetrahedra", "split", "cut steps", "a step", "share", "a split", "idle step"):
        table.add_column(heading, justify="right")
    for cost in costs:
        table.add_row(
            f"{cost.n_tetrahedra:,}",
            f"{cost.n_split:,}",
            f"{cost.n_steps}",
            f"{_US_PER_S * cost.step_mean:.0f}",
            f"{cost.step_mean / costs[0].step_mean:.2f}",
            f"{_US_PER_S * cost.per_split:.1f}",
            f"{_US_PER_S * cost.idle_median:.0f}",
        )
    console.print(table)
    console.print(
        f"The same slit in each block: {SLIT:g} x {_DEPTH:g} cells of {_CELL * 1e3:g} mm, "
        f"{_STEP * 1e3:g} mm a step. A cut step splits tetrahedra; its time is CD + GC, search, "
        "splitting, un-gluing, masses and springs, without relaxation; the share is that of the "
        "smallest block. A split leaves one tetrahedron more. In an idle step the blade moves on "
        "in the tissue, and nothing is split.",
        style="dim",
    )


def _turn(cells: _Cells, watch: Watch) -> Slit:
    """Cut one fresh block, and say so."""
    slit = _run(cells)
    watch.tick(f"cut in {slit.n_tetrahedra:,} tetrahedra")
    return slit


def _run(cells: _Cells) -> Slit:
    """Cut one fresh block."""
    mesh = block(cells, [_CELL * n for n in cells])
    held = np.ones(len(mesh.positions), dtype=bool)
    tissue = Tissue(mesh, _SHARP, fixed=held, gravity=(0.0, 0.0, 0.0))
    before = _edge(cells, 0.0)
    taken: list[float] = []
    sizes = [tissue.n_tetrahedra]
    with no_garbage_collection():
        for i in range(1, round(SLIT * _CELL / _STEP) + 1):
            after = _edge(cells, i * _STEP)
            result = tissue.step(BladeSweep(before, after), _DT)
            taken.append(result.profile.collision + result.profile.topology)
            sizes.append(result.n_tetrahedra)
            before = after
    seconds, splits = np.array(taken), np.diff(np.array(sizes, dtype=np.float64))
    return Slit(sizes[0], seconds[splits > 0], splits[splits > 0], seconds[splits == 0])


def _edge(cells: _Cells, way: float) -> BladeSegment:
    """Return the upright edge, so far [m] along the slit, which is in the middle of the block."""
    x = _CELL * (cells[0] // 2 + _ASIDE)
    y = _CELL * (cells[1] // 2 - SLIT / 2) + way
    top = _CELL * cells[2]
    return BladeSegment(
        np.array([x, y, top - _DEPTH * _CELL]),
        np.array([x, y, top + _ABOVE * _CELL]),
        np.array([0.0, 1.0, 0.0]),
    )
