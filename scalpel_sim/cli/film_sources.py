"""Runs of which there are films: a scene that is simulated, or a recorded run that is played."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.camera.film import film_frames
from scalpel_sim.camera.force_panel import ForcePanel
from scalpel_sim.camera.played_camera import PlayedCamera
from scalpel_sim.camera.viewpoints import usual_camera
from scalpel_sim.cli.camera_options import CameraOptions
from scalpel_sim.cli.camera_run import camera_run
from scalpel_sim.cli.options import ArmOptions, TissueOptions
from scalpel_sim.recording.columns import vector_columns
from scalpel_sim.runs.console import progress
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.runs.run import run_time
from scalpel_sim.saved_run.saved_run import SavedRun

MakePictures = Callable[[ForcePanel | None], Iterator[np.ndarray]]


class FilmSource(NamedTuple):
    """A run of which there will be a film."""

    title: str
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
def simulated_source(
    scene: str | None,
    tissue: TissueOptions,
    arm: ArmOptions,
    camera: CameraOptions,
    printing: PrintOptions,
    *,
    interval: float,
) -> Iterator[FilmSource]:
    """Yield a scene that is simulated as its pictures are made.

    Args:
        scene: A scene or a FILE.toml; None for the default one.
        tissue: What is asked of the tissue.
        arm: What is asked of the arm.
        camera: What is asked of the camera.
        printing: Whether progress is shown.
        interval: Simulated time from one picture to the next [s].
    """
    with camera_run(scene, tissue, arm, camera, printing) as run:
        ends = partial(run_time, seconds=run.scene.seconds)
        seconds = ends(run.simulation)
        with progress(seconds, printing) as advance:

            def pictures(panel: ForcePanel | None) -> Iterator[np.ndarray]:
                return film_frames(
                    run.simulation,
                    run.camera,
                    ends,
                    interval=interval,
                    panel=panel,
                    every_frame=advance,
                )

            names = [each.name for each in run.simulation.graspers]
            title, name, renderer = run.scene.name, run.camera.name, run.camera.renderer
            yield FilmSource(title, seconds, name, names, pictures, renderer)


@contextmanager
def recorded_source(path: Path, camera: CameraOptions, *, interval: float) -> Iterator[FilmSource]:
    """Yield a recorded run that is played: nothing is simulated.

    Args:
        path: The recording.
        camera: What is asked of the camera.
        interval: Simulated time from one picture to the next [s].

    Raises:
        UsageError: it is no recording, or no such camera is in it.
    """
    with SavedRun(path) as run:
        stage, first = run.stage, run.step(0)
        labels = {} if first.surface.labels is None else dict(run.label_names)
        labels |= {each.label: each.title for each in stage.look.labels if labels}
        played = PlayedCamera(
            stage.shapes,
            run.frame,
            labels,
            stage.look,
            shadows=camera.shadows,
            samples=camera.samples,
        )
        name = camera.camera or usual_camera(stage.views)
        played.aim(name, stage.views, first.surface, first.body_poses)
        size = PixelSize(camera.width, camera.height)

        def pictures(panel: ForcePanel | None) -> Iterator[np.ndarray]:
            rows = _plotted(run) if panel is not None else np.empty((0, 0))
            n_rows = 0
            for i in range(1 + int(run.times[-1] / interval + _ROUNDING)):
                step = run.at(i * interval)
                picture = played.rgb(step.surface, step.body_poses, size)
                if panel is None:
                    yield picture
                    continue
                while n_rows < len(rows) and rows[n_rows, 0] < i * interval:
                    time, area, *forces = rows[n_rows].tolist()
                    panel.add(time, area, forces)
                    n_rows += 1
                yield np.hstack([picture, panel.picture()])

        title = run.title.partition(":")[0]
        try:
            seconds, renderer = float(run.times[-1]), played.renderer()
            yield FilmSource(title, seconds, name, run.graspers, pictures, renderer)
        finally:
            played.close()


def _plotted(run: SavedRun) -> np.ndarray:
    """Return time, area and forces of each frame of a run, shape (n, 3 + n_graspers)."""
    forces = ["force", *(f"{name}_force" for name in run.graspers)]
    sizes = [
        np.linalg.norm([run.column(column) for column in vector_columns(name, "n")], axis=0)
        for name in forces
    ]
    return np.stack([run.column("time_s"), run.column("cut_area_m2"), *sizes], axis=1)


_ROUNDING = 1e-9
"""Share of a picture that is rounding."""
