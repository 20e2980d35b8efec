"""Runs of which there are films: a scene that is simulated, or a recorded run that is played."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

import numpy as np

from scalpel_sim.camera.film import film_frames
from scalpel_sim.camera.force_panel import ForcePanel
from scalpel_sim.cli.camera_run import CameraRequest, PlayedRun, camera_run, played_run
from scalpel_sim.recording.columns import vector_columns
from scalpel_sim.runs.console import progress, say
from scalpel_sim.runs.run import run_time
from scalpel_sim.saved_run.recorder import STEPS_PER_SECOND
from scalpel_sim.saved_run.saved_run import SavedRun

_ROUNDING = 1e-9
"""Share of a picture that is rounding."""

MakePictures = Callable[[ForcePanel | None], Iterator[np.ndarray]]


class FilmSource(NamedTuple):
    """A run of which there will be a film."""

    scene: str
    """Name of the scene."""
    seconds: float
    """Time that it lasts, as far as is known [s]."""
    camera: str
    """Name of the camera."""
    graspers: Sequence[str]
    """Names of its graspers."""
    pictures: MakePictures
    """Yields its pictures, with a plot if there is one."""
    renderer: str
    """Name of what draws."""


@contextmanager
def film_source(request: CameraRequest, *, interval: float) -> Iterator[FilmSource]:
    """Yield a run that is filmed: a recorded one is played, any other simulated meanwhile.

    The run in a folder is simulated too, where pictures follow one another faster than steps of its
    recording.

    Args:
        request: What is asked for.
        interval: Simulated time from one picture to the next [s].
    """
    recording, is_slow = request.recording, interval < (1.0 - _ROUNDING) / STEPS_PER_SECOND
    if recording is not None and not (is_slow and request.is_folder):
        if is_slow and not request.printing.quiet:
            say(
                f"{recording} has {STEPS_PER_SECOND:g} steps a second, fewer than this film has "
                "pictures: several of them are the same. A film of the scene, or of the folder of "
                "the run, has none twice"
            )
        with played_run(request, recording) as played:
            yield _played_source(played, interval)
        return
    with camera_run(request) as (simulation, scene, camera):
        ends = partial(run_time, seconds=scene.seconds)
        seconds = ends(simulation)
        with progress(seconds, request.printing) as advance:

            def pictures(panel: ForcePanel | None) -> Iterator[np.ndarray]:
                return film_frames(
                    simulation, camera, ends, interval=interval, panel=panel, every_frame=advance
                )

            names = [each.name for each in simulation.graspers]
            yield FilmSource(scene.name, seconds, camera.name, names, pictures, camera.renderer)


def _played_source(played: PlayedRun, interval: float) -> FilmSource:
    """Return a recorded run that is filmed with a picture each `interval` [s]."""
    run, camera = played
    first, last = float(run.times[0]), float(run.times[-1])

    def pictures(panel: ForcePanel | None) -> Iterator[np.ndarray]:
        rows = np.empty((0, 0)) if panel is None else _plotted(run)
        n_rows = 0
        for i in range(1 + int((last - first) / interval + _ROUNDING)):
            now = first + i * interval
            picture = camera.rgb(run.at(now))
            if panel is None:
                yield picture
                continue
            while n_rows < len(rows) and rows[n_rows, 0] < now:
                time, area, *forces = rows[n_rows].tolist()
                panel.add(time, area, forces)
                n_rows += 1
            yield np.hstack([picture, panel.picture()])

    return FilmSource(run.scene_name, last, camera.name, run.graspers, pictures, camera.renderer)


def _plotted(run: SavedRun) -> np.ndarray:
    """Return time, area and forces of each frame of a run, shape (n, 3 + n_graspers)."""
    forces = ["force", *(f"{name}_force" for name in run.graspers)]
    sizes = [
        np.linalg.norm([run.column(column) for column in vector_columns(name, "n")], axis=0)
        for name in forces
    ]
    return np.stack([run.column("time_s"), run.column("cut_area_m2"), *sizes], axis=1)
