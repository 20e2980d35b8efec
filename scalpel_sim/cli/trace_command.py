"""The command `trace`: a scene whose stroke goes along a line in an image of a camera."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scalpel_sim.cli.camera_options import CameraOptions
from scalpel_sim.cli.new_command import write_new_file
from scalpel_sim.cli.options import ArmOptions, SceneName, TissueOptions
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import Flag, PrintOptions


@Parameter(name="*")
@dataclass(frozen=True)
class LineOptions:
    """A line in an image, and the file of the scene that cuts along it."""

    pixel: Annotated[tuple[str, ...], Parameter(negative="")]
    """COLUMN,ROW of a point of the line, from the upper left corner of the image; give two or more,
    in order."""
    depth: float
    "Depth of the cut below the skin [m]."
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("traced.toml")
    "File for the scene."
    force: Flag = False
    "Replace the file if it exists."


def cut_along_pixels(
    scene: SceneName = None,
    /,
    *,
    line: LineOptions,
    camera: CameraOptions = CameraOptions(),
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Write a scene in which the arm cuts along a line that is given in an image of a camera.

    The image is that of `scalpel-sim snapshot SCENE --at 0` with the same camera and size.

    For example:

    ```console
    scalpel-sim trace --camera endoscope --pixel 256,224 --pixel 310,256 --depth 0.006 -o cut.toml
    scalpel-sim run cut.toml
    ```

    Args:
        scene: What to cut.
    """
    with log_to_stderr(printing):
        from scalpel_sim.camera.pixel_places import pixels_to_points
        from scalpel_sim.cli.camera_run import CameraRequest, camera_run
        from scalpel_sim.scene.scene import changed
        from scalpel_sim.scene.write import scene_text
        from scalpel_sim.strokes.kind import StrokeTable

        pixels = [_place(each) for each in line.pixel]
        with camera_run(CameraRequest(scene, tissue, arm, camera, printing)) as run:
            found = pixels_to_points(run.camera, pixels, run.camera.depth()).tolist()
        points = [(x, y, z) for x, y, z in found]
        stroke = StrokeTable(kind="traced", points=points, depth=line.depth)
        text = scene_text(changed(run.scene, strokes=(stroke,), seconds=None), line.output)
        assert text is not None, "a scene of the command line has its body in a table"
        write_new_file(line.output, text, force=line.force, instead="another file")
        if printing.json:
            print(json.dumps({"file": str(line.output), "points_m": points}, indent=2))
        elif not printing.quiet:
            print(f"{line.output}: written; run it with `scalpel-sim run {line.output}`")


def _place(text: str) -> tuple[float, float]:
    """Return a place of an image.

    Raises:
        UsageError: the text is no column and row.
    """
    try:
        column, row = (float(number) for number in text.split(","))
    except ValueError as error:
        raise UsageError(f"--pixel is {text}; write COLUMN,ROW, as --pixel 118,96") from error
    return column, row
