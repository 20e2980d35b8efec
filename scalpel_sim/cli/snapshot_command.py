"""The command `snapshot`: an image of a scene, or of a recorded run, at one instant."""

import json
from typing import TYPE_CHECKING, NamedTuple

from scalpel_sim.cli.camera_options import CameraOptions, ImageOptions
from scalpel_sim.cli.options import ArmOptions, SceneName, TissueOptions
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr, progress
from scalpel_sim.runs.options import PrintOptions

if TYPE_CHECKING:  # they load MuJoCo's renderer
    from scalpel_sim.camera.camera import CameraImage
    from scalpel_sim.cli.camera_run import CameraRequest

_SMALLEST_SHARE = 1e-3
"""Share of an image that a thing must have to be named: less is a pixel here and there."""


def snapshot(
    scene: SceneName = None,
    /,
    *,
    at: float | None = None,
    output: ImageOptions = ImageOptions(),
    camera: CameraOptions = CameraOptions(),
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Write an image of a scene, or of a run, at one instant; no screen is needed.

    A scene is run to that instant. A run with a recording (`run --record`) is played, any other is
    done again from its folder, which gives the same bits. For example:

    ```console
    scalpel-sim snapshot organ --at 0.8 -o organ.png
    scalpel-sim snapshot layers --at 1.2 --camera endoscope --shadows
    scalpel-sim snapshot out/organ --at 0.8 --depth depth.png --segmentation parts.png
    ```

    Args:
        scene: What to cut, as for `run`; or the folder of a run, or its recording, a FILE.vtkhdf.
        at: Simulated time of the instant [s]; default: the end of the run. Of a recording the last
            step that is not after it.
    """
    with log_to_stderr(printing):
        from scalpel_sim.camera.image_files import check_image_file, write_image
        from scalpel_sim.cli.camera_run import CameraRequest
        from scalpel_sim.scene.checks import LONGEST_RUN

        for option, path in output.files.items():
            check_image_file(path, f"--{option}")
        if at is not None and not 0.0 <= at <= LONGEST_RUN:
            raise UsageError(f"--at is {at}; it must be a time from 0 to {LONGEST_RUN:g} s")
        request = CameraRequest(scene, tissue, arm, camera, printing)
        seen = _simulated(request, at) if request.recording is None else _played(request, at)
        files = write_image(seen.image, output.files, far=seen.far, ids=seen.ids)
        pixels = {
            name: int(n)
            for name, number in seen.ids.items()
            if (n := (seen.image.segmentation == number).sum())
        }
        if printing.json:
            found = {
                "scene": seen.scene,
                "camera": seen.camera,
                "time_s": seen.time,
                "files": files,
                "ids": seen.ids,
                "pixels": pixels,
                "far_m": seen.far,
                "renderer": seen.renderer,
            }
            print(json.dumps(found, indent=2))
        elif not printing.quiet:
            size = seen.image.segmentation.size
            parts = [
                f"{name} {100.0 * n / size:.1f} %"
                for name, n in pixels.items()
                if n > _SMALLEST_SHARE * size
            ]
            instant = f"{seen.scene} after {seen.time:.3f} s"
            print(f"{', '.join(files)}: {instant}: {', '.join(parts)}")


class _Seen(NamedTuple):
    """An image, and what it shows."""

    scene: str
    """Name of the scene."""
    time: float
    """Instant [s]."""
    image: "CameraImage"
    camera: str
    """Name of the camera."""
    ids: dict[str, int]
    """Numbers of the segmentation."""
    far: float
    """Depth where nothing is [m]."""
    renderer: str
    """Name of what draws."""


def _simulated(request: "CameraRequest", at: float | None) -> _Seen:
    """Run a scene to an instant [s], and return what is seen then."""
    from scalpel_sim.cli.camera_run import camera_run
    from scalpel_sim.runs.run import run_time

    with camera_run(request) as (simulation, scene, camera):
        seconds = run_time(simulation, scene.seconds) if at is None else at
        with progress(seconds, request.printing) as advance:
            simulation.run(seconds, advance)
        image, ids = camera.image(), dict(camera.ids)
        return _Seen(
            scene.name, simulation.time, image, camera.name, ids, camera.far, camera.renderer
        )


def _played(request: "CameraRequest", at: float | None) -> _Seen:
    """Return what is seen of a recorded run at an instant [s]."""
    from scalpel_sim.cli.camera_run import played_run

    assert request.recording is not None
    with played_run(request, request.recording) as (run, camera):
        step = run.step(-1) if at is None else run.at(at)
        image, ids = camera.image(step), dict(camera.ids)
        return _Seen(
            run.scene_name, step.time, image, camera.name, ids, camera.far, camera.renderer
        )
