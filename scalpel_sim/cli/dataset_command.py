"""The command `dataset`: demonstrations, in the formats from which policies learn."""

import json
import re
import shutil
from collections.abc import Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scalpel_sim.cli.dataset_options import DatasetFiles, ExpertOptions, TakenOptions
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr, progress, say
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.runs.stop_signals import StopSignals
from scalpel_sim.tables.text_files import is_toml_file

if TYPE_CHECKING:  # `--help` should not wait for a compiler
    from scalpel_sim.datasets.card import Card
    from scalpel_sim.datasets.dataset import Written
    from scalpel_sim.datasets.demonstration import DatasetLayout, DatasetWriter
    from scalpel_sim.datasets.taking import DatasetRequest, TakenDemonstration
    from scalpel_sim.scene.observe_table import CameraTable
    from scalpel_sim.scene.scene import Scene

_FORMS = {"lerobot": "LeRobot v3.0", "robomimic": "robomimic HDF5"}
"""Names of the formats, by what chooses them."""

_SIZED = re.compile(r"(.+):(\d+)x(\d+)")
"""A camera and the size of its images, as NAME:WIDTHxHEIGHT."""


def dataset(
    *sources: str,
    files: DatasetFiles,
    taken: TakenOptions = TakenOptions(),
    expert: ExpertOptions = ExpertOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Write demonstrations as a dataset from which policies learn, for LeRobot or robomimic.

    A demonstration is a scene and what the hands did. So each run is done again from its folder, to
    the bit, and images and observations are taken meanwhile: of one demonstration as often as you
    like, with other cameras, sizes and rates. Numbers are those of `[observe]` of the scene,
    actions those of `[act]`. LeRobot's format needs the extra `data` (pip install
    'scalpel-sim[data]'). For example:

    ```console
    scalpel-sim view incise-v0 --hand live --out demos/first
    scalpel-sim dataset demos/* --cameras endoscope:128x128 overview:128x96 -o cuts
    scalpel-sim dataset demos/* --format robomimic --fps 20 -o cuts_robomimic
    scalpel-sim dataset incise-v0 --episodes 200 --cameras endoscope:64x64 -o expert
    ```

    Args:
        sources: Folders of runs that a hand, a device or a script led, each one an episode; or
            tasks by their name, or a FILE.toml, which their experts do.
    """
    with log_to_stderr(printing):
        _check(sources, files, taken)
        sizes = None if taken.cameras is None else _sized(taken.cameras)
        from scalpel_sim.camera.gl_context import renderer_name
        from scalpel_sim.datasets.card import Card
        from scalpel_sim.datasets.dataset import write_dataset
        from scalpel_sim.datasets.taking import DatasetRequest, expect_alike
        from scalpel_sim.datasets.whole_folder import expect_new_folder
        from scalpel_sim.runs.prepared_run import load_kernels

        expect_new_folder(files.output)
        stop = StopSignals()
        found = _Found(DatasetRequest(sizes, taken.fps, files.task), printing, stop)
        for source in sources:
            found.add(source, expert.seeds)
        expert.check(has_expert=found.has_expert)
        renderer = renderer_name() if found.demonstrations[0].cameras else None
        for scene in found.scenes:
            load_kernels(printing, scene)
        expect_alike(found.demonstrations)
        layout = found.demonstrations[0].layout()
        card = Card(files.output.name, _FORMS[files.form], files.licence, renderer, layout)
        write = partial(_writer, files.form, layout, is_video=taken.video)
        tell = partial(_tell, printing)
        with stop:
            written = write_dataset(files.output, found.demonstrations, write, card, tell)
    _report(files.output, written, card, printing)


class _Found:
    """Demonstrations that were asked for, in order.

    Args:
        request: What is taken of them.
        printing: What is printed meanwhile.
        stop: Ends them.
    """

    def __init__(
        self, request: "DatasetRequest", printing: PrintOptions, stop: StopSignals
    ) -> None:
        self._request, self._stop = request, stop
        self._progress = partial(progress, options=printing)
        self.demonstrations: list[TakenDemonstration] = []
        """The demonstrations."""
        self.scenes: list[Scene] = []
        """Their scenes."""
        self.has_expert = False
        """Whether one is of an expert."""

    def add(self, source: str, seeds: range) -> None:
        """Add the run in a folder, or the demonstrations of the expert of a task.

        Args:
            source: The folder, or the task.
            seeds: Seeds of the demonstrations of an expert.

        Raises:
            UsageError: there is no such run or task.
        """
        from scalpel_sim.datasets.expert_demonstration import ExpertDemonstration, ExpertTask
        from scalpel_sim.datasets.recorded_runs import recorded_run
        from scalpel_sim.datasets.repeated_run import RepeatedRun
        from scalpel_sim.scene.read import TASK_SCENES, read_scene, scene_called

        request, bar = self._request, self._progress

        def stop_reason() -> str | None:
            return self._stop.reason

        if source not in TASK_SCENES and not is_toml_file(source):
            run = recorded_run(Path(source))
            self.scenes.append(run.scene)
            self.demonstrations.append(
                RepeatedRun(run, request, progress=bar, stop_reason=stop_reason)
            )
            return
        scene = read_scene(source) if is_toml_file(source) else scene_called(source)
        of = ExpertTask(scene, request, progress=bar, stop_reason=stop_reason)
        self.scenes.append(of.scene)
        self.has_expert = True
        self.demonstrations += [ExpertDemonstration(of, seed) for seed in seeds]


def _check(sources: Sequence[str], files: DatasetFiles, taken: TakenOptions) -> None:
    """Refuse a request that makes no sense, or for which something is not installed.

    Raises:
        UsageError: it is one.
    """
    if not sources:
        raise UsageError(
            "no run is given: name folders that `scalpel-sim run` or `view --hand live` wrote, or "
            "tasks"
        )
    form, video = files.form, taken.video
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
