"""Whole runs of the scenes: the wall time of a frame of arm, bridge and tissue."""

from collections.abc import Sequence

import numpy as np

from scalpel_sim.output.summary import STAGES
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.recording.recording import Recording
from scalpel_sim.scene.read import SCENES, scene_called
from scalpel_sim.simulation import Simulation
from scalpel_sim.validate.speed.measurements import (
    HIGHER,
    NEITHER,
    WALL,
    BenchmarkResult,
)
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT, Watch

_ABOUT = (
    "The whole stroke of each scene, without pictures or files. A frame simulates 1 ms: arm, "
    "bridge, collision detection (CD), cut (GC), relaxation (RX). In the tissue: frames with the "
    "blade in it. Late: frames that took longer than the time that they simulate. Wall time: other "
    "work on the machine counts. Real-time factor: simulated seconds per second."
)


def checked_scene_names(names: Sequence[str]) -> list[str]:
    """Return the names of the scenes requested, all where none is named.

    Raises:
        UsageError: there is no scene of that name.
    """
    return [scene_called(name).name for name in names] or list(SCENES)


def measure_scenes(
    n_rounds: int, names: Sequence[str], watch: Watch = SILENT, seconds: float | None = None
) -> BenchmarkResult:
    """Run each scene once in each round.

    Args:
        n_rounds: Number of rounds.
        names: Scenes.
        watch: Receives the progress.
        seconds: How long to simulate [s]; None: the whole stroke.
    """
    _run_scene(min(names, key=list(SCENES)[::-1].index), 2e-2)  # loads the kernels
    watch.begin(n_rounds * len(names))
    runs: dict[str, list[Recording]] = {name: [] for name in names}
    sizes: dict[str, int] = {}
    for _ in range(n_rounds):
        for name in names:
            simulation, sizes[name] = _run_scene(name, seconds)
            runs[name].append(simulation.recording)
            watch.tick(name)
    rows = Rows("scenes")
    for name in names:
        _add(rows, name, sizes[name], runs[name])
    return rows.table("scenes", _ABOUT)


def _run_scene(name: str, seconds: float | None) -> tuple[Simulation, int]:
    """Run a scene once; return the run, and the number of tetrahedra at its start."""
    simulation = prepare(SCENES[name])
    n_tetrahedra = simulation.link.describe().n_tetrahedra
    simulation.run(simulation.stroke.duration if seconds is None else seconds)
    return simulation, n_tetrahedra


def _add(rows: Rows, name: str, size: int, runs: Sequence[Recording]) -> None:
    """Add the measurements of one scene."""
    frames = [run.column("frame_s") for run in runs]
    rows.times(f"{name}: frame", size, frames)
    inside = [run.column("anchored_length_m") > 0.0 for run in runs]
    if all(each.any() for each in inside):
        with_blade = [f[i] for f, i in zip(frames, inside, strict=True)]
        rows.times(f"{name}: frame, blade in the tissue", size, with_blade)
    for stage, column in STAGES.items():
        if stage != "RD":
            rows.times(f"{name}: {stage}", size, [run.column(column) for run in runs])
    for case, unit, better, values in (
        ("real-time factor", "s/s", HIGHER, [_real_time_factor(run) for run in runs]),
        ("late frames", "%", NEITHER, [_late_share(run) for run in runs]),
    ):
        rows.values(
            f"{name}: {case}", size, values, unit, quantity=case, better=better, clock=WALL.name
        )


def _real_time_factor(run: Recording) -> float:
    """Return simulated time over wall time."""
    return len(run) * _frame_dt(run) / float(run.column("frame_s").sum())


def _late_share(run: Recording) -> float:
    """Return the share of frames that missed their deadline [%]."""
    return 100.0 * float((run.column("frame_s") > _frame_dt(run)).mean())


def _frame_dt(run: Recording) -> float:
    """Return the simulated time of a frame [s]."""
    return float(np.diff(run.column("time_s")[:2])[0])
