"""Does it run in real time? Whole strokes in each material, with account and viewer."""

import itertools
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from cyclopts import Parameter

from benchmarks.timing import Rounds, TurnWatch
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.runs.run import run_time
from scalpel_sim.scene.checks import moves_together
from scalpel_sim.scene.materials import material_called
from scalpel_sim.scene.read import scene_called
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.simulation import Simulation
from scalpel_sim.validate.speed.measurements import (
    COUNTED,
    HIGHER,
    LOWER,
    NEITHER,
    WALL,
    BenchmarkResult,
    Quantity,
    Skipped,
    summarise_times,
)
from scalpel_sim.validate.speed.scenes import checked_scene_names
from scalpel_sim.validate.speed.tables import Rows, compact_table, print_notes, three_digits
from scalpel_sim.validate.speed.watch import SILENT
from tissue import MATERIALS, FloatArray, TissueError

if TYPE_CHECKING:
    from rich.console import Console

Names = Annotated[Sequence[str], Parameter(consume_multiple=True)]

AS_SHIPPED = "as shipped"
"""Stands for the material of the scene itself."""
RUN_MODES = ("plain", "account", "viewer")
QUICK_SECONDS = 0.05
"""Time of a stroke that is simulated for a quick test [s]."""
_MS_PER_S = 1e3

_ABOUT = (
    "Wall time of a frame of 1 ms; other work on the machine counts. Factor: simulated seconds per "
    "second. Late: frames that took longer than they simulate. Steps: of the relaxation in a frame,"
    " median and most. Account: with an account of the energy. Viewer: with the live page served, "
    "also where no browser has it open. The arm does the scene's whole stroke."
)


class TimedRun(NamedTuple):
    """One line of the table."""

    scene: str
    material: str
    what: str
    """One of `RUN_MODES`."""

    @property
    def name(self) -> str:
        """Its name in results files."""
        return f"{self.scene}, {self.material}: {self.what}"


class Frames(NamedTuple):
    """The frames of one turn."""

    tetrahedra: int
    dt: float
    """Simulated time of a frame [s]."""
    seconds: FloatArray
    """Wall time of each [s]."""
    substeps: FloatArray
    added_mass: float
    """The most mass that was added to light nodes, as a share of the body's own."""


def real_time(
    *,
    runs: Rounds = 5,
    watch: TurnWatch = SILENT,
    scenes: Names = (),
    materials: Names = (),
    quick: Annotated[bool, Parameter(negative="")] = False,
) -> BenchmarkResult:
    """Run whole strokes in each material, with account and viewer.

    Takes many minutes: choose with the options. For example:

    ```console
    python -m benchmarks real-time --scenes organ --materials liver fat --runs 1
    ```

    Args:
        runs: Number of rounds; cases take turns.
        watch: Receives the progress.
        scenes: organ, incision, slab, grid2, grid7 [default: all].
        materials: Names of materials, or "as shipped" [default: that, and all].
        quick: Only the begin of each stroke, as shipped, once.

    Raises:
        UsageError: there is no such scene or material.
    """
    chosen = checked_scene_names(scenes)
    of_material = list(materials) or ([AS_SHIPPED] if quick else [AS_SHIPPED, *MATERIALS])
    for name in of_material:
        if name != AS_SHIPPED:
            material_called(name)
    cases = list(itertools.starmap(TimedRun, itertools.product(chosen, of_material, RUN_MODES)))
    cases *= 1 if quick else runs
    seconds = QUICK_SECONDS if quick else None
    found: dict[TimedRun, list[Frames]] = {}
    rows = Rows("real-time")
    watch.begin(len(cases))
    for case in cases:
        try:
            found.setdefault(case, []).append(_stroke_frames(case, seconds))
        except (TissueError, ValueError) as error:
            rows.skip(case.name, None, str(error))
        watch.tick(case.name)
    for case, turns in found.items():
        _add(rows, case, turns)
    return BenchmarkResult(rows.measured, rows.skipped, partial(_print, found, rows.skipped))


def _scene(name: str, material: str) -> Scene:
    """Return a scene in a material."""
    scene = scene_called(name)
    return scene if material == AS_SHIPPED else changed(scene, material=material_called(material))


def _stroke_frames(case: TimedRun, seconds: float | None) -> Frames:
    """Do the stroke of a scene once."""
    scene = _scene(case.scene, case.material)
    audit = case.what == "account" and moves_together(scene.solver.relaxation)
    simulation = prepare(changed(scene, audit=audit))
    n_tetrahedra = simulation.link.describe().n_tetrahedra
    substeps: list[int] = []

    def count(now: Simulation) -> bool:
        substeps.append(now.result.n_substeps)
        return False

    with ExitStack() as scope:
        if case.what == "viewer":
            from scalpel_sim.viewer.pictures import into_viewer
            from scalpel_sim.viewer.viewer import Viewer

            viewer = Viewer(simulation.arm.model, title=case.name, frame=simulation.frame)
            simulation.pictures.append(into_viewer(scope.enter_context(viewer)))
        simulation.run(run_time(simulation, seconds), count)
    return Frames(
        n_tetrahedra,
        simulation.dt,
        simulation.recording.column("frame_s").copy(),
        np.array(substeps, dtype=np.float64),
        simulation.link.cut_report().now.most_added_mass,
    )


def _add(rows: Rows, case: TimedRun, turns: Sequence[Frames]) -> None:
    """Add the measurements of one case."""
    name, size = case.name, turns[0].tetrahedra
    rows.times(name, size, [turn.seconds for turn in turns], quantity="frame")
    substeps = Quantity("real-time", name, size, "substeps", "steps", COUNTED)
    rows.measured.append(summarise_times(substeps, [turn.substeps for turn in turns], float))
    for quantity, unit, clock, better, values in (
        ("p99.9 of a frame", "ms", WALL.name, LOWER, [_p999(turn) for turn in turns]),
        ("real-time factor", "s/s", WALL.name, HIGHER, [_factor(turn) for turn in turns]),
        ("late frames", "%", WALL.name, NEITHER, [_late(turn) for turn in turns]),
        ("added mass", "%", COUNTED, NEITHER, [100.0 * turn.added_mass for turn in turns]),
    ):
        rows.values(name, size, values, unit, quantity=quantity, better=better, clock=clock)


def _p999(turn: Frames) -> float:
    """Return the 99.9th percentile of a frame [ms]."""
    return _MS_PER_S * float(np.percentile(turn.seconds, 99.9))


def _factor(turn: Frames) -> float:
    """Return simulated time over wall time."""
    return len(turn.seconds) * turn.dt / float(turn.seconds.sum())


def _late(turn: Frames) -> float:
    """Return the share of frames that took longer than they simulate [%]."""
    return 100.0 * float((turn.seconds > turn.dt).mean())


def _print(
    found: dict[TimedRun, list[Frames]], skipped: Sequence[Skipped], console: "Console"
) -> None:
    """Print a line for each case."""
    right = ("factor", "median ms", "p99", "p99.9", "late %", "steps", "added %")
    table = compact_table("real time", ("case",), right)
    body = None
    for case, turns in sorted(found.items(), key=lambda item: item[0][:2]):
        if body != case[:2]:
            body = case[:2]
            table.add_row(f"[bold]{case.scene}, {case.material}[/bold]")
        milliseconds = _MS_PER_S * np.concatenate([turn.seconds for turn in turns])
        steps = np.concatenate([turn.substeps for turn in turns])
        table.add_row(
            f"{case.what}, {turns[0].tetrahedra:,} tets",
            three_digits(float(np.median([_factor(turn) for turn in turns]))),
            *(three_digits(float(p)) for p in np.percentile(milliseconds, (50, 99, 99.9))),
            three_digits(float(np.mean([_late(turn) for turn in turns]))),
            f"{np.median(steps):.0f}, {steps.max():.0f}",
            three_digits(100.0 * turns[-1].added_mass),
        )
    console.print(table)
    print_notes(_ABOUT, skipped, console)
