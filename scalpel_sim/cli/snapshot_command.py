"""The command `snapshot`: an image of a scene at one instant."""

import json

from scalpel_sim.cli.camera_options import CameraOptions, ImageOptions
from scalpel_sim.cli.options import ArmOptions, SceneName, TissueOptions
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr, progress
from scalpel_sim.runs.options import PrintOptions

_SHORTEST_SHARE = 1e-3
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
    """Run a scene to an instant, and write an image of it; no screen is needed.

    For example:

    ```console
    scalpel-sim snapshot organ --at 0.8 -o organ.png
    scalpel-sim snapshot layers --at 1.2 --camera endoscope --shadows
    scalpel-sim snapshot out/organ --at 0.8 --depth depth.png --segmentation parts.png
    ```

    Args:
        scene: What to cut, as for `run`; or the folder of a run, which is done again.
        at: Simulated time of the instant [s]; default: the end of the run.
    """
    with log_to_stderr(printing):
        from scalpel_sim.camera.image_files import check_image_file, write_image
        from scalpel_sim.cli.camera_run import camera_run, scene_of_run
        from scalpel_sim.runs.run import run_time
        from scalpel_sim.scene.checks import LONGEST_RUN

        for option, path in output.files.items():
            check_image_file(path, f"--{option}")
        if at is not None and not 0.0 <= at <= LONGEST_RUN:
            raise UsageError(f"--at is {at}; it must be a time from 0 to {LONGEST_RUN:g} s")
        scene = scene_of_run(scene, tissue, arm)
        with camera_run(scene, tissue, arm, camera, printing) as run:
            seconds = run_time(run.simulation, run.scene.seconds) if at is None else at
            with progress(seconds, printing) as advance:
                run.simulation.run(seconds, advance)
            image = run.camera.image()
            names = write_image(run.camera, image, output.files)
            seen = {
                name: int(n)
                for name, number in run.camera.ids.items()
                if (n := (image.segmentation == number).sum())
            }
            found = {
                "scene": run.scene.name,
                "camera": run.camera.name,
                "time_s": run.simulation.time,
                "files": names,
                "ids": dict(run.camera.ids),
                "pixels": seen,
                "far_m": run.camera.far,
                "renderer": run.camera.renderer,
            }
        if printing.json:
            print(json.dumps(found, indent=2))
        elif not printing.quiet:
            parts = [
                f"{name} {100.0 * n / image.segmentation.size:.1f} %"
                for name, n in seen.items()
                if n > _SHORTEST_SHARE * image.segmentation.size
            ]
            instant = f"{found['scene']} after {found['time_s']:.3f} s"
            print(f"{', '.join(names)}: {instant}: {', '.join(parts)}")
