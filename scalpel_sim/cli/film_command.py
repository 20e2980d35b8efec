"""The command `film`: a film of a scene, or of a run whose folder is there."""

import json
from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scalpel_sim.cli.camera_options import CameraOptions, FilmOptions
from scalpel_sim.cli.options import ArmOptions, SceneName, TissueOptions, expect_no_options
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr, progress, say
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
    their place. A run is done again from its folder, which gives the same bits.

    For example:

    ```console
    scalpel-sim film organ --camera endoscope -o cut.mp4
    scalpel-sim film out/retract --plot --slow 4 -o retract.webm
    scalpel-sim film slab --width 320 --height 240 --fps 10 -o slab.gif
    ```

    Args:
        scene: What to cut, as for `run`; or the folder of a run.
        output: File of the film: .mp4, .webm, .png (animated), .gif or .webp.
    """
    with log_to_stderr(printing):
        from scalpel_sim.camera.canvas import PixelSize
        from scalpel_sim.camera.film import film_frames
        from scalpel_sim.camera.film_files import film_path, open_film
        from scalpel_sim.camera.force_panel import ForcePanel
        from scalpel_sim.cli.camera_run import camera_run
        from scalpel_sim.runs.run import run_time

        pace.check()
        path, told = film_path(output)
        if scene is not None and Path(scene).is_dir():
            expect_no_options((tissue, arm), f"the run in {scene}, which is done again as it was")
            scene = _scene_of_run(Path(scene))
        if told and not printing.quiet:
            say(told)
        n_pictures = 0
        with camera_run(scene, tissue, arm, camera, printing) as run:
            simulation = run.simulation
            ends = partial(run_time, seconds=run.scene.seconds)
            seconds, panel = ends(simulation), None
            size = PixelSize(camera.width, camera.height)
            if pace.plot:
                names = [each.name for each in simulation.graspers]
                panel = ForcePanel(names, seconds, size)
                size = PixelSize(2 * size.width, size.height)
            with progress(seconds, printing) as advance, open_film(path, size, pace.fps) as file:
                for picture in film_frames(
                    simulation,
                    run.camera,
                    ends,
                    interval=1.0 / (pace.fps * pace.slow),
                    panel=panel,
                    every_frame=advance,
                ):
                    file.add(picture)
                    n_pictures += 1
            found = {
                "scene": run.scene.name,
                "camera": run.camera.name,
                "file": str(path),
                "pictures": n_pictures,
                "fps": pace.fps,
                "simulated_s": simulation.time,
                "renderer": run.camera.renderer,
            }
        if printing.json:
            print(json.dumps(found, indent=2))
        elif not printing.quiet:
            print(
                f"{path}: {n_pictures} pictures, {n_pictures / pace.fps:.1f} s of film, of "
                f"{found['scene']}, {found['simulated_s']:.2f} s"
            )


def _scene_of_run(folder: Path) -> str:
    """Return the scene file of a run.

    Raises:
        UsageError: the folder has none.
    """
    from scalpel_sim.runs.file_names import SCENE

    if not (folder / SCENE).is_file():
        raise UsageError(
            f"{folder} has no {SCENE}: it is no folder of a run, or of one whose body was elsewhere"
        )
    return str(folder / SCENE)
