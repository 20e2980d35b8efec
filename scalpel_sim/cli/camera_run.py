"""Runs that cameras see: a scene that is simulated for its images alone, or a recorded run."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from scalpel_sim.camera.camera import Camera
from scalpel_sim.camera.gl_context import renderer_name
from scalpel_sim.cli.camera_options import CameraOptions
from scalpel_sim.cli.options import ArmOptions, TissueOptions, expect_no_options
from scalpel_sim.cli.run_setup import check_steps_of_frames
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.errors import UsageError
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.preparation.tissue import check_scene
from scalpel_sim.runs.file_names import SCENE
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.runs.prepared_run import load_kernels
from scalpel_sim.saved_run.layout import VTKHDF_SUFFIX
from scalpel_sim.saved_run.played_camera import PlayedCamera
from scalpel_sim.saved_run.saved_run import SavedRun
from scalpel_sim.scene.scene import Scene
from scalpel_sim.simulation import Simulation


class CameraRequest(NamedTuple):
    """A run that a command shows, and what is asked of it."""

    name: str | None
    """A scene, a FILE.toml, the folder of a run, or a recording; None for the default scene."""
    tissue: TissueOptions
    arm: ArmOptions
    camera: CameraOptions
    printing: PrintOptions

    @property
    def is_folder(self) -> bool:
        """Whether it is the folder of a run."""
        return self.name is not None and Path(self.name).is_dir()

    @property
    def recording(self) -> Path | None:
        """The recording that is named, or the only one in the folder; None: there is none."""
        path = Path(self.name or "")
        if path.suffix.lower() == VTKHDF_SUFFIX:
            return path
        found = sorted(path.glob(f"*{VTKHDF_SUFFIX}")) if self.is_folder else []
        return found[0] if len(found) == 1 else None

    @property
    def scene(self) -> str | None:
        """The scene that is named, or that of the run in the folder.

        Raises:
            UsageError: the folder has no scene, or its run is to be changed.
        """
        if self.name is None or not self.is_folder:
            return self.name
        self.expect_no_change()
        if not (Path(self.name) / SCENE).is_file():
            raise UsageError(
                f"{self.name} has no {SCENE}: it is no folder of a run, or of one whose body was "
                "elsewhere"
            )
        return str(Path(self.name) / SCENE)

    def expect_no_change(self) -> None:
        """Refuse to change a run that was.

        Raises:
            UsageError: an option would change it.
        """
        options = (self.tissue, self.arm)
        expect_no_options(options, f"the run in {self.name}, which is shown as it was")


class CameraRun(NamedTuple):
    """A simulation at its start, and a camera that sees it."""

    simulation: Simulation
    scene: Scene
    camera: Camera


class PlayedRun(NamedTuple):
    """A recorded run, and a camera that sees it."""

    run: SavedRun
    camera: PlayedCamera


@contextmanager
def camera_run(request: CameraRequest) -> Iterator[CameraRun]:
    """Yield a scene at its start and a camera; a lack of OpenGL shows before anything is computed.

    Raises:
        UsageError: options that make no sense, or no such camera.
        RenderError: no OpenGL is there.
    """
    name, options = request.scene, request.camera
    renderer_name()
    scene = chosen_scene(name, request.tissue, request.arm)
    check_scene(scene)
    load_kernels(request.printing, scene)
    simulation = prepare(scene, records=False)
    check_steps_of_frames(simulation)
    with Camera(
        simulation,
        options.camera,
        width=options.width,
        height=options.height,
        shadows=options.shadows,
        samples=options.samples,
    ) as camera:
        yield CameraRun(simulation, scene, camera)


@contextmanager
def played_run(request: CameraRequest, recording: Path) -> Iterator[PlayedRun]:
    """Yield a recorded run and a camera that sees its steps. Nothing is simulated.

    Args:
        request: What is asked for.
        recording: File of the run.

    Raises:
        UsageError: it is no recording, it is to be changed, or no such camera is in it.
        RenderError: no OpenGL is there.
    """
    request.expect_no_change()
    options = request.camera
    with SavedRun(recording) as run:
        renderer_name()
        with PlayedCamera(
            run,
            options.camera,
            width=options.width,
            height=options.height,
            shadows=options.shadows,
            samples=options.samples,
        ) as camera:
            yield PlayedRun(run, camera)
