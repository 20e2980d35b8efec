"""The command `dataset`: demonstrations, in the formats from which policies learn."""

import json
import re
import shutil
from collections.abc import Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from scalpel_sim.cli.camera_options import CAMERA
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr, progress, say
from scalpel_sim.runs.options import OUTPUT, Flag, PrintOptions
from scalpel_sim.runs.stop_signals import StopSignals

if TYPE_CHECKING:  # `--help` should not wait for a compiler
    from scalpel_sim.datasets.card import Card
    from scalpel_sim.datasets.dataset import Written
    from scalpel_sim.datasets.demonstration import DatasetLayout, DatasetWriter
    from scalpel_sim.scene.observe_table import CameraTable

_FORMS = {"lerobot": "LeRobot v3.0", "robomimic": "robomimic HDF5"}
"""Names of the formats, by what chooses them."""

_SIZED = re.compile(r"(.+):(\d+)x(\d+)")
"""A camera and the size of its images, as NAME:WIDTHxHEIGHT."""


def dataset(
    *runs: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"], group=OUTPUT)],
    form: Annotated[
        Literal["lerobot", "robomimic"], Parameter(name="--format", group=OUTPUT)
    ] = "lerobot",
    cameras: Annotated[
        tuple[str, ...] | None, Parameter(consume_multiple=True, negative="", group=CAMERA)
    ] = None,
    fps: Annotated[int | None, Parameter(group=CAMERA)] = None,
    video: Annotated[Flag, Parameter(group=CAMERA)] = False,
    task: Annotated[str | None, Parameter(group=OUTPUT)] = None,
    licence: Annotated[str, Parameter(name=["--licence", "--license"], group=OUTPUT)] = "cc-by-4.0",
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Write runs as a dataset from which policies learn: for LeRobot, or for robomimic.

    A demonstration is a scene and what the hands did. So each run is done again from its folder, to
    the bit, and images and observations are taken meanwhile: of one demonstration as often as you
    like, with other cameras, sizes and rates. Numbers are those of `[observe]` of the scene,
    actions those of `[act]`. LeRobot's format needs the extra `data` (pip install
    'scalpel-sim[data]'). For example:

    ```console
    scalpel-sim view incise-v0 --hand live --out demos/first
    scalpel-sim dataset demos/* --cameras endoscope:128x128 overview:128x96 -o cuts
    scalpel-sim dataset demos/* --format robomimic --fps 20 -o cuts_robomimic
    ```

    Args:
        runs: Folders of runs that a hand, a device or a script led, each one an episode.
        output: Folder of the dataset, which must be new. It appears when it is whole.
        form: lerobot, version 3.0 of its format; or robomimic, a file of HDF5.
        cameras: Cameras, each with the size of its images: NAME:WIDTHxHEIGHT [default: those of
            `[observe]` of the scene].
        fps: Control steps a second [default: as `[act]` has them, 50].
        video: Write the images as videos, by the ffmpeg on the PATH: smaller, and not without loss.
            For lerobot alone.
        task: The task in words, for policies that read them [default: what the scene is about].
        licence: Licence of the dataset, as hubs write it.
    """
    with log_to_stderr(printing):
        _check(runs, form, video=video)
        sizes = None if cameras is None else _sized(cameras)
        from scalpel_sim.camera.gl_context import renderer_name
        from scalpel_sim.datasets.card import Card
        from scalpel_sim.datasets.dataset import write_dataset
        from scalpel_sim.datasets.recorded_runs import recorded_run
        from scalpel_sim.datasets.repeated_run import RepeatedRun, RunRequest, expect_alike
        from scalpel_sim.datasets.whole_folder import expect_new_folder
        from scalpel_sim.runs.prepared_run import load_kernels

        expect_new_folder(output)
        request = RunRequest(sizes, fps, task)
        stop = StopSignals()
        episodes = [
            RepeatedRun(
                recorded_run(folder),
                request,
                progress=partial(progress, options=printing),
                stop_reason=lambda: stop.reason,
            )
            for folder in runs
        ]
        expect_alike(episodes)
        renderer = renderer_name() if episodes[0].cameras else None
        for episode in episodes:
            load_kernels(printing, episode.run.scene)
        layout = episodes[0].layout()
        card = Card(output.name, _FORMS[form], licence, renderer, layout)
        write = partial(_writer, form, layout, is_video=video)
        with stop:
            written = write_dataset(output, episodes, write, card, partial(_tell, printing))
    _report(output, written, card, printing)


def _check(runs: Sequence[Path], form: str, *, video: bool) -> None:
    """Refuse a request that makes no sense, or for which something is not installed.

    Raises:
        UsageError: it is one.
    """
    if not runs:
        raise UsageError(
            "no run is given: name folders that `scalpel-sim run` or `view --hand live` wrote"
        )
    if form == "lerobot" and find_spec("pyarrow") is None:
        raise UsageError(
            "a dataset for LeRobot needs pyarrow, which is not installed: pip install "
            "'scalpel-sim[data]'"
        )
    if video and form != "lerobot":
        raise UsageError(f"--video is for --format lerobot, and this is {form}; omit one of them")
    if video and shutil.which("ffmpeg") is None:
        raise UsageError("--video needs ffmpeg on the PATH: install it, or omit --video")


def _sized(given: Sequence[str]) -> "list[CameraTable]":
    """Return cameras and the sizes of their images.

    Raises:
        UsageError: one is no NAME:WIDTHxHEIGHT, or is given twice.
    """
    from scalpel_sim.camera.camera import image_size
    from scalpel_sim.scene.observe_table import CameraTable

    found: dict[str, CameraTable] = {}
    for text in given:
        match = _SIZED.fullmatch(text)
        if match is None:
            raise UsageError(
                f"--cameras has '{text}'; write the name and the size of the images, such as "
                "endoscope:128x128"
            )
        name, size = match[1], image_size(int(match[2]), int(match[3]))
        if name in found:
            raise UsageError(f"--cameras has '{name}' twice; omit one of them")
        found[name] = CameraTable(name=name, size=(size.width, size.height))
    return list(found.values())


def _writer(form: str, layout: "DatasetLayout", folder: Path, *, is_video: bool) -> "DatasetWriter":
    """Return what writes a format to a folder."""
    from scalpel_sim.datasets.lerobot_writer import LeRobotWriter
    from scalpel_sim.datasets.robomimic_writer import RobomimicWriter

    if form == "lerobot":
        return LeRobotWriter(folder, layout, is_video=is_video)
    return RobomimicWriter(folder, layout)


def _tell(printing: PrintOptions, episode: dict[str, Any]) -> None:
    """Print how an episode ended."""
    if not printing.quiet:
        ended = {True: "success", False: "no success", None: "no task asks for anything"}
        say(f"{episode['run']}: {episode['steps']} control steps, {ended[episode['success']]}")


def _report(output: Path, written: "Written", card: "Card", printing: PrintOptions) -> None:
    """Print what was written; warn of hands that were faster than actions may be."""
    fast = sum(each["steps_faster_than_limits"] for each in written.episodes)
    if fast and not printing.quiet:
        say(
            f"warning: in {fast} of {written.n_steps} control steps a hand was faster than [act] "
            "permits: their actions are beyond plus or minus 1, and no policy can do them. Raise "
            "its speed and turn, or lead more slowly"
        )
    found = {
        "folder": str(output),
        "format": card.form,
        "episodes": written.n_episodes,
        "steps": written.n_steps,
        "fps": card.layout.fps,
        "succeeded": sum(bool(each["success"]) for each in written.episodes),
        "steps_faster_than_limits": fast,
        "renderer": card.renderer,
    }
    if printing.json:
        print(json.dumps(found, indent=2))
    elif not printing.quiet:
        print(
            f"{output}: {written.n_episodes} episodes, {written.n_steps} control steps, {card.form}"
        )
