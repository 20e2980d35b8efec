"""The command `film`: a film of a scene, or of a run whose folder is there."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scalpel_sim.cli.camera_options import CameraOptions, FilmOptions
from scalpel_sim.cli.options import ArmOptions, SceneName, TissueOptions
from scalpel_sim.runs.console import log_to_stderr, say
from scalpel_sim.runs.options import OUTPUT, PrintOptions


def film(
    scene: SceneName = None,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"], group=OUTPUT)] = Path("film.mp4"),
    pace: FilmOptions = FilmOptions(),
    camera: CameraOptions = CameraOptions(),
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Make a film of a scene, or of a run; no screen is needed.

    MP4 and WebM are written by the ffmpeg on the PATH; where there is none, an animated PNG takes
    their place. A run with a recording (`run --record`) is played, any other is done again from its
    folder, which gives the same bits; so is a film of a folder in slow motion.

    For example:

    ```console
    scalpel-sim film organ --camera endoscope -o cut.mp4
    scalpel-sim film out/retract --plot --slow 4 -o retract.webm
    scalpel-sim film slab --width 320 --height 240 --fps 10 -o slab.gif
    ```

    Args:
        scene: What to cut, as for `run`; or the folder of a run, or its recording, a FILE.vtkhdf.
        output: File of the film: .mp4, .webm, .png (animated), .gif or .webp.
    """
    with log_to_stderr(printing):
        from scalpel_sim.camera.canvas import PixelSize
        from scalpel_sim.camera.film_files import film_path, open_film
        from scalpel_sim.camera.force_panel import ForcePanel
        from scalpel_sim.cli.camera_run import CameraRequest
        from scalpel_sim.cli.film_sources import film_source

        pace.check()
        path, told = film_path(output)
        if told and not printing.quiet:
            say(told)
        interval = 1.0 / (pace.fps * pace.slow)
        size, panel, n_pictures = PixelSize(camera.width, camera.height), None, 0
        request = CameraRequest(scene, tissue, arm, camera, printing)
        with film_source(request, interval=interval) as source:
            if pace.plot:
                panel = ForcePanel(source.graspers, source.seconds, size)
                size = PixelSize(2 * size.width, size.height)
            with open_film(path, size, pace.fps) as file:
                for picture in source.pictures(panel):
                    file.add(picture)
                    n_pictures += 1
        found = {
            "scene": source.scene,
            "camera": source.camera,
            "file": str(path),
            "pictures": n_pictures,
            "fps": pace.fps,
            "simulated_s": (n_pictures - 1) * interval,
            "renderer": source.renderer,
        }
        if printing.json:
            print(json.dumps(found, indent=2))
        elif not printing.quiet:
            print(
                f"{path}: {n_pictures} pictures, {n_pictures / pace.fps:.1f} s of film, of "
                f"{found['scene']}, {found['simulated_s']:.2f} s"
            )
