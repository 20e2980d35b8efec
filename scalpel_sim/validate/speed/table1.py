"""The paper's Table 1: three grids, cut partly through, by ours and as printed, beside its figures.

The body is of springs and the blade a line, as in the paper. The whole loop runs: read the arm, CD,
GC, RX, force to the arm, and RD, a picture as in the live view. Only frames with the blade in the
tissue count.
"""

from collections.abc import Sequence
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.output.summary import MACHINE, STAGES, TABLE_1
from scalpel_sim.planned_cut import PlannedCut, prepare_cut
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.recording.recording import Recording
from scalpel_sim.scene.body import GivenBody
from scalpel_sim.scene.read import PHANTOM
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.simulation import DrawFrame, Simulation
from scalpel_sim.validate.speed.measurements import (
    COUNTED,
    HIGHER,
    LOWER,
    NEITHER,
    WALL,
    BenchmarkResult,
)
from scalpel_sim.validate.speed.tables import Rows, compact_table
from scalpel_sim.validate.speed.watch import SILENT, Watch
from scalpel_sim.viewer.messages import UPDATES_PER_SECOND
from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from scalpel_sim.viewer.pictures import state_of
from scalpel_sim.viewer.scene_packets import ScenePackets
from tissue import FloatArray, block

if TYPE_CHECKING:
    from rich.console import Console

_Cells = tuple[int, int, int]

_CELL = 0.01
"""Side of a cell [m]; the paper has no lengths."""
_PATH = np.array([[0.38, -0.4], [0.38, 1.6]])
"""Path of the blade, as shares of the grid's sides: straight through, off the planes of each grid,
and beyond the body, since the blade drags tissue along."""
_WAYS = {
    "stellar": ("stellar", "global"),
    "paper": ("paper", "global"),
    "paper, rings": ("paper", "paper"),
}
"""Scheme of cutting and relaxation: ours, the paper's scheme with ours, and the paper's own."""
_DEPTHS = {(2, 2, 2): 0.58, (2, 4, 3): 0.58, (4, 6, 4): 0.7}
"""Depth of the blade as a share of the height, chosen so that the paper's scheme splits 18, 48 and
108 tetrahedra. The paper's counts imply 18, 48 and 110."""


class GridRow(NamedTuple):
    """One grid, cut in one way on this machine; medians over runs."""

    cells: _Cells
    way: str
    tetrahedra_initial: int
    tetrahedra_final: int
    """Number of tetrahedra after the cut. In the paper's scheme this is its own count, which keeps
    tetrahedra that were split."""
    frame_rate: float
    """Mean number of frames of 1 ms per second with the blade in the tissue, pictures included."""
    percent: dict[str, float]
    """Share of the time of RX, RD, GC, CD, and `other`: arm and bridge. They sum to 100 within a
    run."""
    picture_ms: float
    """Median time of one picture [ms]: the surface, and the message that shows it."""


def measure_table1(n_rounds: int, watch: Watch = SILENT) -> BenchmarkResult:
    """Cut each grid in each way once in each round, in turns."""
    cases = [(cells, way) for cells in TABLE_1 for way in _WAYS]
    for way in _WAYS:
        _cut_grid(next(iter(TABLE_1)), way)  # loads the kernels
    watch.begin(n_rounds * len(cases))
    rounds = [[_turn(case, watch) for case in cases] for _ in range(n_rounds)]
    runs = list(zip(*rounds, strict=True))
    rows = Rows("table1")
    for each in runs:
        _add(rows, each)
    return BenchmarkResult(rows.measured, [], partial(print_rows, [_median(each) for each in runs]))


def _turn(case: tuple[_Cells, str], watch: Watch) -> GridRow:
    """Cut one grid and report the turn."""
    row = _cut_grid(*case)
    watch.tick(_name(row))
    return row


def _name(row: GridRow) -> str:
    """Return the name of a case in the measurements."""
    return f"{'x'.join(map(str, row.cells))} cells, {row.way}"


def _add(rows: Rows, runs: Sequence[GridRow]) -> None:
    """Add the measurements of one grid, cut in one way."""
    first = runs[0]
    case, size = _name(first), first.tetrahedra_initial
    shares = {f"share of {s}": [row.percent[s] for row in runs] for s in first.percent}
    finals = [float(row.tetrahedra_final) for row in runs]
    for quantity, unit, values, clock, better in (
        ("frames", "1/s", [row.frame_rate for row in runs], WALL.name, HIGHER),
        ("a picture", "ms", [row.picture_ms for row in runs], WALL.name, LOWER),
        *((share, "%", values, WALL.name, NEITHER) for share, values in shares.items()),
        ("after the cut", "tetrahedra", finals, COUNTED, NEITHER),
    ):
        rows.values(case, size, values, unit, quantity=quantity, better=better, clock=clock)


def print_rows(rows: Sequence[GridRow], console: "Console") -> None:
    """Print the rows below the paper's."""
    title = "Table 1 of Bielser, Maiwald, Gross (1998); RX to other in % of the time"
    right = ("before", "after", "frames/s", *STAGES, "other")
    table = compact_table(title, ("cells", "scheme"), right)
    for column in table.columns:
        column.no_wrap = True
    for cells, paper in TABLE_1.items():
        printed = [f"{paper.percent[stage]:.1f}" for stage in STAGES]
        rest = f"{100.0 - sum(paper.percent.values()):.1f}"
        table.add_row(
            "x".join(map(str, cells)),
            "paper 1998",
            f"{paper.tetrahedra_initial:,}",
            f"{paper.tetrahedra_final:,}",
            f"{paper.frame_rate:.2f}",
            *printed,
            rest,
            style="dim",
        )
        for row in rows:
            if row.cells == cells:
                table.add_row(
                    "",
                    row.way,
                    f"{row.tetrahedra_initial:,}",
                    f"{row.tetrahedra_final:,}",
                    f"{row.frame_rate:,.0f}",
                    *(f"{row.percent[stage]:.1f}" for stage in (*STAGES, "other")),
                )
        table.add_section()
    console.print(table)
    pictures = ", ".join(f"{row.picture_ms:.1f}" for row in rows)
    console.print(
        f"Before, after: tetrahedra. Paper 1998: as printed, {MACHINE}; the others: this machine. "
        "RX relaxation, RD rendering, GC geometry and topology, CD collision detection; other, "
        "here: arm and bridge. Rings: relaxation paper; else global.\n"
        f"A frame here simulates 1 ms. RD is the cost of the live view: {UPDATES_PER_SECOND:g} "
        f"pictures per simulated second, {pictures} ms each (surface and message; the browser "
        "draws them in another process).\n"
        "The paper's scheme counts tetrahedra as the paper does: 17 more for each that is split, "
        "which stays in the count.",
        style="dim",
    )


def _cut_grid(cells: _Cells, way: str) -> GridRow:
    """Cut one grid."""
    scheme, relaxation = _WAYS[way]
    size = [_CELL * n for n in cells]
    body = GivenBody(source=lambda: block(cells, size))
    grid = Scene(name="table1", about="a grid of the paper", body=body)
    scene = changed(grid, material=PHANTOM, blade=None, scheme=scheme, relaxation=relaxation)
    tissue = make_tissue(scene)
    n_before = tissue.n_tetrahedra
    simulation = prepare_cut(PlannedCut(scene, _PATH, _DEPTHS[cells]), tissue)
    picture_seconds: list[float] = []
    simulation.pictures.append(_picture_timer(simulation, picture_seconds))
    simulation.run(simulation.stroke.duration)
    statistics = tissue.scheme_statistics()
    rows = _during_cut(simulation.recording)
    spent = {stage: float(rows[name].sum()) for stage, name in STAGES.items()}
    total = float(rows["frame_s"].sum()) + spent["RD"]
    percent = {stage: 100.0 * seconds / total for stage, seconds in spent.items()}
    return GridRow(
        cells=cells,
        way=way,
        tetrahedra_initial=n_before,
        tetrahedra_final=tissue.n_tetrahedra if statistics is None else statistics.paper_count,
        frame_rate=len(rows["frame_s"]) / total,
        percent=percent | {"other": 100.0 - sum(percent.values())},
        picture_ms=1e3 * float(np.median(picture_seconds)),
    )


def _during_cut(recording: Recording) -> dict[str, FloatArray]:
    """Return the times of the frames from the first with the blade in the tissue to the last."""
    inside = np.flatnonzero(recording.column("anchored_length_m") > 0.0)
    frames = slice(inside[0], inside[-1] + 1)
    return {name: recording.column(name)[frames] for name in (*STAGES.values(), "frame_s")}


def _picture_timer(simulation: Simulation, seconds: list[float]) -> DrawFrame:
    """Return a callback that makes the live view's pictures at its rate and discards them.

    It appends the time that each takes [s] to `seconds`.
    """
    packets = ScenePackets(shapes_of(simulation.arm.model), simulation.frame)
    packets.opening(simulation.link.surface(), body_poses(simulation.arm.data))
    every = round(1.0 / (UPDATES_PER_SECOND * simulation.dt))

    def picture(now: Simulation) -> None:
        if len(now.recording) % every == 0:
            start = perf_counter()
            packets.frame(state_of(now))
            seconds.append(perf_counter() - start)

    return picture


def _median(runs: Sequence[GridRow]) -> GridRow:
    """Return the median of each number; counts are the same in every run."""
    first = runs[0]
    stages = first.percent
    return first._replace(
        frame_rate=float(np.median([run.frame_rate for run in runs])),
        percent={s: float(np.median([run.percent[s] for run in runs])) for s in stages},
        picture_ms=float(np.median([run.picture_ms for run in runs])),
    )
