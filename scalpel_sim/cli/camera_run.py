"""A scene that is simulated for its images alone: no folder is written."""

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
from scalpel_sim.scene.scene import Scene
from scalpel_sim.simulation import Simulation


class CameraRun(NamedTuple):
    """A simulation at its start, and a camera that sees it."""

    simulation: Simulation
    scene: Scene
    camera: Camera


def scene_of_run(name: str | None, tissue: TissueOptions, arm: ArmOptions) -> str | None:
    """Return the scene that a name stands for: that of a run, where it is the folder of one.

    Args:
        name: A scene, a FILE.toml, or the folder of a run; None for the default scene.
        tissue: What is asked of the tissue.
        arm: What is asked of the arm.

    Raises:
        UsageError: the folder has no scene, or a run is to be changed.
    """
    if name is None or not Path(name).is_dir():
        return name
    expect_no_options((tissue, arm), f"the run in {name}, which is shown as it was")
    if not (Path(name) / SCENE).is_file():
        raise UsageError(
            f"{name} has no {SCENE}: it is no folder of a run, or of one whose body was elsewhere"
        )
    return str(Path(name) / SCENE)


@contextmanager
def camera_run(
    name: str | None,
    tissue: TissueOptions,
    arm: ArmOptions,
    options: CameraOptions,
    printing: PrintOptions,
    *,
    records: bool = False,
) -> Iterator[CameraRun]:
    """Yield a scene at its start and a camera; a lack of OpenGL shows before anything is computed.

    Args:
        name: A scene or a FILE.toml; None for the default one.
        tissue: What is asked of the tissue.
        arm: What is asked of the arm.
        options: What is asked of the camera.
        printing: Whether progress is shown.
        records: Whether the run is recorded.

    Raises:
        UsageError: options that make no sense, or no such camera.
        RenderError: no OpenGL is there.
    """
    renderer_name()
    scene = chosen_scene(name, tissue, arm)
    check_scene(scene)
    load_kernels(printing, scene)
    simulation = prepare(scene, records=records)
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
