"""One run, from a simulation at its start to a folder of files, whatever may end it."""

import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bridge import LinkError
from scalpel_sim.errors import Interrupted, RunError, one_line
from scalpel_sim.output import run_folder as files
from scalpel_sim.output.export import export_surface
from scalpel_sim.output.run_folder import Outputs
from scalpel_sim.output.summary import COMPLETE, Summary, summarise
from scalpel_sim.simulation import Simulation
from scalpel_sim.stop_signals import StopSignals
from scalpel_sim.viewer.pictures import add_to, into_replay
from scalpel_sim.viewer.replay import ReplayWriter
from tissue.mesh.pieces import pieces_of

_log = logging.getLogger(__name__)

REST_AFTER_STROKE = 0.3
"""How long a run goes on after the stroke's end [s]: the tissue swings out, and the cut gapes."""

MANY_SUBSTEPS = 200
"""Runge-Kutta steps in a frame above which a person should be told. The scenes take 1 to 20."""


def perform(
    simulation: Simulation,
    outputs: Outputs,
    *,
    settings: dict[str, Any],
    seed: int = 0,
    seconds: float | None = None,
    every_frame: Callable[[Simulation], None] | None = None,
    exports: Sequence[Path] = (),
) -> Summary:
    """Do the run, and write its files.

    A run that ends before its time, by the user, the system or an error, leaves the files of the
    part that it did, and says in the summary's `status` what ended it.

    Args:
        simulation: At its start.
        outputs: Where the files go.
        settings: What to keep in the summary beside the figures.
        seed: The same.
        seconds: How long [s]; None for the stroke and `REST_AFTER_STROKE`.
        every_frame: Called after each frame.
        exports: Files that get the body's surface after the run; see `output.export`.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the run failed, or a file could not be written. The other files are.
    """
    seconds = run_time(simulation, seconds)
    link = simulation.link
    body = link.describe()
    outputs.write_mesh(files.INITIAL, link.snapshot())
    replay = ReplayWriter(simulation.arm.model, title=simulation.title, frame=simulation.frame)
    simulation.pictures.append(into_replay(replay))

    status, failure = COMPLETE, None
    with StopSignals() as stop:

        def after_frame(now: Simulation) -> bool:
            if len(now.recording) == 1:
                _warn_if_slow(now)
            outputs.write_forces(now.recording)
            if every_frame is not None:
                every_frame(now)
            return stop.reason is not None

        try:
            simulation.run(seconds, after_frame)
        except Exception as error:
            status, failure = f"failed: {one_line(error)}", error
    status = stop.reason or status

    unwritten = _Attempts()
    with unwritten:
        outputs.write_forces(simulation.recording, all_rows=True)
    pieces = quality = None
    with unwritten:
        end = link.snapshot()
        pieces = pieces_of(end)
        quality = link.quality()
        outputs.write_mesh(files.FINAL, end)
    result = simulation.bridge.result
    summary = summarise(
        simulation.recording,
        scene=body.scene,
        status=status,
        seed=seed,
        dt=simulation.dt,
        wall_seconds=simulation.wall_seconds,
        tetrahedra_initial=body.n_tetrahedra,
        tetrahedra_final=body.n_tetrahedra if result is None else result.n_tetrahedra,
        pieces=pieces,
        quality=quality,
        counters=simulation.bridge.counters.as_numbers(),
        touched=simulation.touching.frames,
        settings=settings,
    )
    with unwritten:
        outputs.write_summary(summary)
    outputs.start_plots(simulation.title)  # by another process, while this one writes the replay
    with unwritten:
        add_to(replay, simulation)
    with unwritten:
        outputs.write_replay(replay)
    for path in exports:
        with unwritten:
            export_surface(link.surface(), path)
    with unwritten:
        outputs.finish_plots()
    outputs.close()

    kept = f"{outputs.folder} holds what was done"
    if failure is not None:
        raise RunError(f"after {simulation.time:.3f} s: {one_line(failure)}; {kept}") from failure
    if stop.reason is not None:
        raise Interrupted(f"{stop.reason} after {simulation.time:.3f} s; {kept}")
    if unwritten.errors:
        raise unwritten.errors[0]
    return summary


def _warn_if_slow(simulation: Simulation) -> None:
    """Say so where a frame takes so many Runge-Kutta steps that one would think it hangs."""
    n_substeps = simulation.result.n_substeps
    if n_substeps > MANY_SUBSTEPS:
        _log.warning(
            "a frame takes %s Runge-Kutta steps, because the tissue's elements are small, stiff or "
            "light: the run will take long. Check --scale, or lower --young, or raise --density",
            f"{n_substeps:,}",
        )


class _Attempts:
    """Lets the files after one that fails be written too. Enter it once for each."""

    def __init__(self) -> None:
        self.errors: list[Exception] = []

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> bool:
        if not isinstance(error, (RunError, LinkError)):
            return False
        self.errors.append(error)
        _log.warning("%s", error)
        return True


def run_time(simulation: Simulation, seconds: float | None) -> float:
    """Return how long to simulate [s]: what was asked for, else the stroke and a rest."""
    return simulation.stroke.duration + REST_AFTER_STROKE if seconds is None else seconds
