"""The paper's Table 1: three grids cut part of the way, by each scheme, beside the printed figures.

The whole loop runs, as in the paper: read the arm, CD, GC, RX, force to the arm, and RD, a picture
as the live view has it. Frames count while the blade is in the tissue.
"""

from collections.abc import Sequence
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.bench.results import (
    COUNTED,
    HIGHER,
    LOWER,
    NEITHER,
    Figure,
    Findings,
    of_values,
)
from scalpel_sim.bench.timing import WALL
from scalpel_sim.bench.watch import SILENT, Watch
from scalpel_sim.output.recording import Recording
from scalpel_sim.output.summary import STAGES
from scalpel_sim.output.table_1 import MACHINE, TABLE_1
from scalpel_sim.scene_body import make_tissue
from scalpel_sim.scenes import SCHEMES, Scene
from scalpel_sim.simulation import DrawFrame, Simulation
from scalpel_sim.strokes.cuts import PlannedCut, prepare_cut
from scalpel_sim.viewer.messages import UPDATES_PER_SECOND
from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from scalpel_sim.viewer.pictures import readings
from scalpel_sim.viewer.scene_packets import ScenePackets
from tissue import block

if TYPE_CHECKING:
    from rich.console import Console

_Cells = tuple[int, int, int]

_CELL = 0.01
"""Side of a cell [m]; the paper has no lengths."""
_WAY = np.array([[0.38, -0.4], [0.38, 1.6]])
"""Straight through, off the planes of each grid, and on behind the body: the blade drags tissue."""
DEPTHS = {(2, 2, 2): 0.58, (2, 4, 3): 0.58, (4, 6, 4): 0.7}
"""How far the blade goes down, as a share of the height: part of the way, so that the paper's
scheme splits 18, 48 and 108 tetrahedra. The paper's counts tell of 18, 48 and 110."""


class Row(NamedTuple):
    """One grid, cut by one scheme on this machine; medians over runs."""

    cells: _Cells
    scheme: str
    tetrahedra_initial: int
    tetrahedra_final: int
    """In the paper's scheme by the paper's count, in which a tetrahedron that was split stays."""
    frame_rate: float
    """Frames of 1 ms a second while the blade is in the tissue, pictures included, mean."""
    percent: dict[str, float]
    """RX, RD, GC, CD, and `other`: arm and bridge. They sum to 100 within a run."""
    picture_ms: float
    """What one picture costs [ms], median: the surface, and the message that shows it."""


def measure(n_rounds: int, schemes: Sequence[str] = SCHEMES, watch: Watch = SILENT) -> Findings:
    """Return what each grid and scheme costs, over so many rounds, in which they take turns."""
    cases = [(cells, scheme) for cells in TABLE_1 for scheme in schemes]
    for scheme in schemes:
        _run(next(iter(TABLE_1)), scheme)  # every kernel is loaded
    watch.begin(n_rounds * len(cases))
    rounds = [[_turn(case, watch) for case in cases] for _ in range(n_rounds)]
    runs = list(zip(*rounds, strict=True))
    figures = [figure for each in runs for figure in _figures(each)]
    return Findings(figures, [], partial(print_rows, [_median(each) for each in runs]))


def _turn(case: tuple[_Cells, str], watch: Watch) -> Row:
    """Do one cut, and say so."""
    row = _run(*case)
    watch.tick(f"{'x'.join(map(str, row.cells))} cells, {row.scheme}")
    return row


def _figures(runs: Sequence[Row]) -> list[Figure]:
    """Return the figures of one grid and scheme."""
    first = runs[0]
    case = f"{'x'.join(map(str, first.cells))} cells, {first.scheme}"

    def figure(quantity: str, unit: str, values: list[float], clock: str, better: str) -> Figure:
        size = first.tetrahedra_initial
        return of_values("table1", case, size, quantity, unit, values, clock=clock, better=better)

    return [
        figure("frames", "1/s", [r.frame_rate for r in runs], WALL.name, HIGHER),
        figure("a picture", "ms", [r.picture_ms for r in runs], WALL.name, LOWER),
        *(
            figure(f"share of {stage}", "%", [r.percent[stage] for r in runs], WALL.name, NEITHER)
            for stage in first.percent
        ),
        figure("after the cut", "tetrahedra", [r.tetrahedra_final for r in runs], COUNTED, NEITHER),
    ]


def print_rows(rows: Sequence[Row], console: "Console") -> None:
    """Print the rows below the paper's."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title="Table 1 of Bielser, Maiwald, Gross (1998); RX to other in % of the time",
        title_justify="left",
        box=SIMPLE_HEAD,
        collapse_padding=True,
        pad_edge=False,
    )
    table.add_column("cells", no_wrap=True)
    table.add_column("scheme", no_wrap=True)
    for heading in ("before", "after", "frames/s", *STAGES, "other"):
        table.add_column(heading, justify="right", no_wrap=True)
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
                    row.scheme,
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
        "RX relaxation, RD rendering, GC geometry and topology, CD collision detection; other: "
        "here arm and bridge.\n"
        f"A frame here is 1 ms of life. RD is what the live view costs us: {UPDATES_PER_SECOND:g} "
        f"pictures a second of it, {pictures} ms each (surface and message; the browser draws "
        "them elsewhere).\n"
        "In the paper's scheme tetrahedra are counted as the paper does: 17 more for each that is "
        "split, which stays in the count.",
        style="dim",
    )


def _run(cells: _Cells, scheme: str) -> Row:
    """Do one cut."""
    size = [_CELL * n for n in cells]
    scene = Scene("table1", "a grid of the paper", lambda: block(cells, size), scheme=scheme)
    tissue = make_tissue(scene)
    n_before = tissue.n_tetrahedra
    simulation = prepare_cut(PlannedCut(scene, _WAY, DEPTHS[cells]), tissue)
    spent_on: list[float] = []
    simulation.pictures.append(_into_nothing(simulation, spent_on))
    simulation.run(simulation.stroke.duration)
    statistics = tissue.scheme_statistics()
    rows = _during_cut(simulation.recording)
    seconds = {stage: float(rows[name].sum()) for stage, name in STAGES.items()}
    total = float(rows["frame_s"].sum()) + seconds["RD"]
    percent = {stage: 100.0 * spent / total for stage, spent in seconds.items()}
    return Row(
        cells=cells,
        scheme=scheme,
        tetrahedra_initial=n_before,
        tetrahedra_final=tissue.n_tetrahedra if statistics is None else statistics.paper_count,
        frame_rate=len(rows["frame_s"]) / total,
        percent=percent | {"other": 100.0 - sum(percent.values())},
        picture_ms=1e3 * float(np.median(spent_on)),
    )


def _during_cut(recording: Recording) -> dict[str, np.ndarray]:
    """Return the times of the frames from the first with the blade in the tissue to the last."""
    inside = np.flatnonzero(recording.column("anchored_length_m") > 0.0)
    frames = slice(inside[0], inside[-1] + 1)
    return {name: recording.column(name)[frames] for name in (*STAGES.values(), "frame_s")}


def _into_nothing(simulation: Simulation, spent_on: list[float]) -> DrawFrame:
    """Return what makes the live view's pictures at its rate, and shows them to nobody.

    It adds the time [s] that each takes to `spent_on`.
    """
    stage = ScenePackets(shapes_of(simulation.arm.model), simulation.frame)
    stage.opening(simulation.link.surface(), body_poses(simulation.arm.data))
    every = round(1.0 / (UPDATES_PER_SECOND * simulation.dt))

    def picture(now: Simulation) -> None:
        if len(now.recording) % every == 0:
            start = perf_counter()
            stage.frame(now.link.surface(), body_poses(now.arm.data), readings(now))
            spent_on.append(perf_counter() - start)

    return picture


def _median(runs: Sequence[Row]) -> Row:
    """Return the median of each figure; counts are the same in every run."""
    first = runs[0]
    stages = first.percent
    return first._replace(
        frame_rate=float(np.median([run.frame_rate for run in runs])),
        percent={s: float(np.median([run.percent[s] for run in runs])) for s in stages},
        picture_ms=float(np.median([run.picture_ms for run in runs])),
    )
