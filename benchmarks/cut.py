"""The cost of a cut step in bodies of different size in which the blade makes the same cut.

Three blocks of the same cells, of about 1,000, 10,000 and 100,000 tetrahedra, get the same slit in
the middle of their upper side. Every node is held, so that the blade meets the same tetrahedra in
each block, and only the size of the body around it differs. A cut step is the paper's CD and GC:
collision detection, subdivision, separation, and the springs and masses that change. RX, which must
move all nodes, is not part of it.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from benchmarks.timing import WALL
from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.measurements import (
    BenchmarkResult,
    Measurement,
    Quantity,
    summarise_times,
)
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import BladeSegment, BladeSweep, FloatArray, Material, Tissue, block

if TYPE_CHECKING:
    from rich.console import Console

_Cells = tuple[int, int, int]

CUT_BLOCKS: tuple[_Cells, ...] = ((5, 6, 6), (11, 12, 13), (25, 26, 26))
"""Cells of the blocks along x, y and z: 1,080, 10,296 and 101,400 tetrahedra."""
_CELL = 5e-3
"""Side of a cell [m]."""
_SLIT_CELLS = 3.5
"""Length of the slit [cells]."""
_DEPTH, _ABOVE = 3.37, 2.0
"""How far the edge reaches below the upper side, and above it [cells]."""
_ASIDE = 0.37
"""Distance of the slit from the planes of the grid [cells]: no part of it runs along existing
faces."""
_STEP = 2.5e-4
"""Displacement of the blade in a step [m]: 0.25 m/s at 1 kHz, fast for a hand."""
_DT = 1e-3
"""Time step [s]."""
_MATERIAL = Material(law="springs", poisson_ratio=0.25, toughness=1.0)
"""Material of so little toughness that the blade hardly drags it along and cuts where it passes."""

_US_PER_S = 1e6


class SlitSteps(NamedTuple):
    """What the steps cost that cut the slit into one block."""

    n_tetrahedra: int
    """Number of tetrahedra before the cut."""
    steps: FloatArray
    """Wall time of each step in which the mesh changed [s]."""
    splits: FloatArray
    """Number of tetrahedra split in each of those steps: each split adds one tetrahedron."""
    idle: FloatArray
    """Wall time of each step with the blade in the tissue that split nothing [s]."""


class CutCost(NamedTuple):
    """The cost of cutting one block, medians over rounds; wall times in seconds."""

    n_tetrahedra: int
    """Number of tetrahedra before the cut."""
    n_split: int
    """Number of tetrahedra that were split."""
    n_steps: int
    """Number of steps in which the mesh changed."""
    step_mean: float
    """Mean of those steps [s], the occasional growth of arrays included."""
    step_longest: float
    """Longest of those steps [s]."""
    idle_median: float
    """Median of the steps in which nothing was split [s]."""
    per_split: float
    """Time of the steps that split, per split tetrahedron [s]."""


def measure_cut_steps(
    n_rounds: int, blocks: Sequence[_Cells] = CUT_BLOCKS, watch: Watch = SILENT
) -> BenchmarkResult:
    """Cut each block once in each round; blocks take turns."""
    slits = cut_slits(n_rounds, blocks, watch)
    costs = [median_cost(each) for each in slits]
    return BenchmarkResult(_measurements(slits), [], partial(print_costs, costs))


def cut_slits(
    n_rounds: int, blocks: Sequence[_Cells] = CUT_BLOCKS, watch: Watch = SILENT
) -> list[list[SlitSteps]]:
    """Return what each round cost, for each block."""
    _cut_slit(blocks[0])  # loads the kernels and wakes the processor
    watch.begin(n_rounds * len(blocks))
    rounds = [[_turn(cells, watch) for cells in blocks] for _ in range(n_rounds)]
    return [list(slits) for slits in zip(*rounds, strict=True)]


def median_cost(slits: Sequence[SlitSteps]) -> CutCost:
    """Return the median of each cost over the rounds; the counts are the same in all rounds."""
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


def _measurements(blocks: Sequence[Sequence[SlitSteps]]) -> list[Measurement]:
    """Return the time of a cut step, of a split, and of a step without a split, in each block."""
    measured = []
    for slits in blocks:
        for case, samples in (
            ("cut step", [s.steps for s in slits]),
            ("split tetrahedron", [s.steps / s.splits for s in slits]),
            ("blade moves, nothing split", [s.idle for s in slits]),
        ):
            quantity = Quantity("cut", case, slits[0].n_tetrahedra, "time", "µs", WALL.name)
            measured.append(summarise_times(quantity, samples, lambda s: _US_PER_S * s))
    return measured


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
        f"The same slit in each block: {_SLIT_CELLS:g} x {_DEPTH:g} cells of {_CELL * 1e3:g} mm, "
        f"{_STEP * 1e3:g} mm a step. A cut step splits tetrahedra; its time is CD + GC: collision "
        "detection, subdivision, separation, masses and springs, without relaxation. Share: of "
        "the time in the smallest block. A split adds one tetrahedron. In an idle step the blade "
        "moves on in the tissue and nothing is split.",
        style="dim",
    )


def _turn(cells: _Cells, watch: Watch) -> SlitSteps:
    """Cut one new block and report the turn."""
    slit = _cut_slit(cells)
    watch.tick(f"cut in {slit.n_tetrahedra:,} tetrahedra")
    return slit


def _cut_slit(cells: _Cells) -> SlitSteps:
    """Cut the slit into one new block."""
    mesh = block(cells, [_CELL * n for n in cells])
    held = np.ones(len(mesh.positions), dtype=bool)
    tissue = Tissue(mesh, _MATERIAL, fixed=held, gravity=(0.0, 0.0, 0.0))
    before = _edge(cells, 0.0)
    taken: list[float] = []
    sizes = [tissue.n_tetrahedra]
    with no_garbage_collection():
        for i in range(1, round(_SLIT_CELLS * _CELL / _STEP) + 1):
            after = _edge(cells, i * _STEP)
            result = tissue.step(BladeSweep(before, after), _DT)
            taken.append(result.stage_times.collision + result.stage_times.topology)
            sizes.append(result.n_tetrahedra)
            before = after
    seconds, splits = np.array(taken), np.diff(np.array(sizes, dtype=np.float64))
    return SlitSteps(sizes[0], seconds[splits > 0], splits[splits > 0], seconds[splits == 0])


def _edge(cells: _Cells, distance: float) -> BladeSegment:
    """Return the upright edge at a distance [m] along the slit in the middle of the block."""
    x = _CELL * (cells[0] // 2 + _ASIDE)
    y = _CELL * (cells[1] // 2 - _SLIT_CELLS / 2) + distance
    top = _CELL * cells[2]
    return BladeSegment(
        np.array([x, y, top - _DEPTH * _CELL]),
        np.array([x, y, top + _ABOVE * _CELL]),
        np.array([0.0, 1.0, 0.0]),
    )
