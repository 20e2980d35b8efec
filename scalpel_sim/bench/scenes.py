"""Whole runs of the scenes: what a frame of arm, bridge and tissue costs on the wall."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from scalpel_sim.bench.results import HIGHER, NEITHER, Figure, Findings, of_times, of_values
from scalpel_sim.bench.tables import print_figures
from scalpel_sim.bench.timing import WALL
from scalpel_sim.bench.watch import SILENT, Watch
from scalpel_sim.output.recording import Recording
from scalpel_sim.output.summary import STAGES
from scalpel_sim.preparation import prepare
from scalpel_sim.scenes import SCENES, scene_called
from scalpel_sim.simulation import Simulation

_MS_PER_S = 1e3

_ABOUT = (
    "Each scene's whole stroke; no pictures, no files. A frame is 1 ms of life: arm, bridge, "
    "search (CD), cut (GC), relaxation (RX). In the tissue: frames with the blade in it. Late: "
    "frames that took longer than the time that they stand for. Wall time: other work on the "
    "machine counts. Real-time factor: seconds of life a second."
)


def check_names(names: Sequence[str]) -> list[str]:
    """Return the scenes that are asked for, all if none is.

    Raises:
        UsageError: there is no such scene.
    """
    return [scene_called(name).name for name in names] or list(SCENES)


def measure(
    n_rounds: int, names: Sequence[str], watch: Watch = SILENT, seconds: float | None = None
) -> Findings:
    """Run each scene once in each round; `seconds` of it, or its whole stroke."""
    _run(min(names, key=list(SCENES)[::-1].index), 2e-2)  # the kernels are loaded
    watch.begin(n_rounds * len(names))
    runs: dict[str, list[Recording]] = {name: [] for name in names}
    sizes: dict[str, int] = {}
    for _ in range(n_rounds):
        for name in names:
            simulation, sizes[name] = _run(name, seconds)
            runs[name].append(simulation.recording)
            watch.tick(name)
    figures = [f for name in names for f in _figures(name, sizes[name], runs[name])]
    return Findings(figures, [], partial(print_figures, "scenes", figures, [], about=_ABOUT))


def _run(name: str, seconds: float | None) -> tuple[Simulation, int]:
    """Do one run; return it, and the tetrahedra that it began with."""
    simulation = prepare(SCENES[name])
    n_tetrahedra = simulation.link.describe().n_tetrahedra
    simulation.run(simulation.stroke.duration if seconds is None else seconds)
    return simulation, n_tetrahedra


def _figures(name: str, size: int, runs: Sequence[Recording]) -> list[Figure]:
    """Return the figures of one scene."""

    def of_frames(case: str, rounds: list[np.ndarray]) -> Figure:
        return of_times(
            "scenes", f"{name}: {case}", size, "time", "ms", rounds,
            clock=WALL.name, convert=lambda s: _MS_PER_S * s,
        )  # fmt: skip

    frames = [run.column("frame_s") for run in runs]
    figures = [of_frames("frame", frames)]
    inside = [run.column("anchored_length_m") > 0.0 for run in runs]
    if all(each.any() for each in inside):
        figures.append(
            of_frames("frame, blade in the tissue",
                      [f[i] for f, i in zip(frames, inside, strict=True)])
        )  # fmt: skip
    for stage, column in STAGES.items():
        if stage != "RD":
            figures.append(of_frames(stage, [run.column(column) for run in runs]))
    for case, unit, better, values in (
        ("real-time factor", "s/s", HIGHER, [_speed(run) for run in runs]),
        ("late frames", "%", NEITHER, [_late(run) for run in runs]),
    ):
        figures.append(
            of_values("scenes", f"{name}: {case}", size, case, unit, values,
                      clock=WALL.name, better=better)
        )  # fmt: skip
    return figures


def _speed(run: Recording) -> float:
    """Return how much faster than life it was."""
    return len(run) * _frame(run) / float(run.column("frame_s").sum())


def _late(run: Recording) -> float:
    """Return the share of frames that missed their deadline [%]."""
    return 100.0 * float((run.column("frame_s") > _frame(run)).mean())


def _frame(run: Recording) -> float:
    """Return the simulated time of a frame [s]."""
    return float(np.diff(run.column("time_s")[:2])[0])
