"""What a cut step costs as the body grows around it, while the blade does the same to it.

Three blocks of the same cells, of some 1,000, 10,000 and 100,000 tetrahedra, get the same slit in
the middle of their upper side. Every node is held, so that the blade meets the same tetrahedra in
each: what differs is only how much body there is around. A cut step is the paper's CD and GC:
search, splitting, un-gluing, and the springs and masses that change; RX, which must move all nodes,
is no part of it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from scalpel_sim.simulation import no_garbage_collection
from tissue.material import Material
from tissue.shapes import grid
from tissue.tissue import Tissue
from tissue.types import BladeSegment, BladeSweep

Cells = tuple[int, int, int]

CELLS: tuple[Cells, ...] = ((5, 6, 6), (11, 12, 13), (25, 26, 26))
"""Of the blocks along x, y and z: 1,080, 10,296 and 101,400 tetrahedra."""
CELL = 5e-3
"""Side of a cell [m]."""
SLIT = 3.5
"""Length of the slit [cells]."""
DEPTH, ABOVE = 3.37, 2.0
"""How far the edge reaches below the upper side, and above [cells]."""
ASIDE = 0.37
"""Distance of the slit from the grid's planes [cells]: none of it runs along faces that are
there."""
STEP = 2.5e-4
"""Way of the blade in a step [m]: 0.25 m/s at 1 kHz, fast for a hand."""
DT = 1e-3
"""[s]."""
SHARP = Material(toughness=1.0)
"""The blade hardly drags: it cuts where it passes."""

US_PER_S = 1e6


class CutCost(NamedTuple):
    """Cost of cutting one block, medians over runs; times in seconds of wall time."""

    n_tetrahedra: int
    """Before the cut."""
    n_split: int
    """Tetrahedra that were split: each split leaves one more than there were."""
    n_steps: int
    """Steps in which the mesh changed."""
    step_mean: float
    """Mean of those steps [s], the occasional growth of arrays included."""
    step_median: float
    """Median of those steps [s]."""
    step_longest: float
    """[s]."""
    idle_median: float
    """Median of the steps with the blade in the tissue in which nothing was split [s]."""
    per_split: float
    """Time of those steps for each split tetrahedron [s]."""


def measure(n_runs: int, blocks: Sequence[Cells] = CELLS) -> list[CutCost]:
    """Return the cost for each block, medians over so many runs, in which blocks take turns."""
    _run(blocks[0])  # the kernels are loaded, and the processor is awake
    rounds = [[_run(cells) for cells in blocks] for _ in range(n_runs)]
    return [_median(runs) for runs in zip(*rounds, strict=True)]


def print_costs(costs: Sequence[CutCost], console: Console) -> None:
    """Print the costs as a table."""
    table = Table(title="cost of a cut step, wall time in µs", title_justify="left")
    for heading in ("tetrahedra", "split", "cut steps", "a step", "share", "a split", "idle step"):
        table.add_column(heading, justify="right")
    for cost in costs:
        table.add_row(
            f"{cost.n_tetrahedra:,}",
            f"{cost.n_split:,}",
            f"{cost.n_steps}",
            f"{US_PER_S * cost.step_mean:.0f}",
            f"{cost.step_mean / costs[0].step_mean:.2f}",
            f"{US_PER_S * cost.per_split:.1f}",
            f"{US_PER_S * cost.idle_median:.0f}",
        )
    console.print(table)
    console.print(
        f"The same slit in each block: {SLIT:g} x {DEPTH:g} cells of {CELL * 1e3:g} mm, "
        f"{STEP * 1e3:g} mm a step. A cut step splits tetrahedra; its time is CD + GC, search, "
        "splitting, un-gluing, masses and springs, without relaxation; the share is that of the "
        "smallest block. A split leaves one tetrahedron more. In an idle step the blade moves on "
        "in the tissue, and nothing is split.",
        style="dim",
    )


def _run(cells: Cells) -> CutCost:
    """Cut one fresh block."""
    mesh = grid(cells, [CELL * n for n in cells])
    held = np.ones(len(mesh.positions), dtype=bool)
    tissue = Tissue(mesh, SHARP, fixed=held, gravity=(0.0, 0.0, 0.0))
    before = _edge(cells, 0.0)
    n_before = tissue.n_tetrahedra
    busy: list[float] = []
    idle: list[float] = []
    with no_garbage_collection():
        for i in range(1, round(SLIT * CELL / STEP) + 1):
            n = tissue.n_tetrahedra
            after = _edge(cells, i * STEP)
            result = tissue.step(BladeSweep(before, after), DT)
            spent = result.profile.collision + result.profile.topology
            (busy if result.n_tetrahedra > n else idle).append(spent)
            before = after
    n_split = tissue.n_tetrahedra - n_before
    return CutCost(
        n_tetrahedra=n_before,
        n_split=n_split,
        n_steps=len(busy),
        step_mean=float(np.mean(busy)),
        step_median=float(np.median(busy)),
        step_longest=max(busy),
        idle_median=float(np.median(idle)),
        per_split=sum(busy) / n_split,
    )


def _edge(cells: Cells, way: float) -> BladeSegment:
    """Return the upright edge, so far [m] along the slit, which is in the middle of the block."""
    x = CELL * (cells[0] // 2 + ASIDE)
    y = CELL * (cells[1] // 2 - SLIT / 2) + way
    top = CELL * cells[2]
    return BladeSegment(
        np.array([x, y, top - DEPTH * CELL]),
        np.array([x, y, top + ABOVE * CELL]),
        np.array([0.0, 1.0, 0.0]),
    )


def _median(runs: Sequence[CutCost]) -> CutCost:
    """Return the median of each figure; counts are the same in every run."""
    columns = zip(*runs, strict=True)
    return CutCost(*(type(column[0])(np.median(column)) for column in columns))
