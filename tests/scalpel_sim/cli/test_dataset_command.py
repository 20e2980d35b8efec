"""`scalpel-sim dataset` writes what was simulated, whole, or says why it cannot."""

import json

import h5py
import numpy as np
import pytest

from scalpel_sim.cli import dataset_command
from scalpel_sim.cli.app import command_line
from scalpel_sim.datasets.recorded_runs import recorded_run
from scalpel_sim.datasets.repeated_run import RepeatedRun
from scalpel_sim.datasets.robomimic_writer import FILE
from scalpel_sim.datasets.taking import DatasetRequest
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE
from tests.scalpel_sim.datasets.recorded_demonstrations import (
    SCENE,
    led_folder,
    slab_task,
)

__all__ = ["led_folder", "slab_task"]

pq = pytest.importorskip("pyarrow.parquet")

RENDERED = ("README.md", "provenance.json")
"""Files that name the renderer and the machine."""


def written(capsys, *arguments):
    assert command_line(["dataset", *map(str, arguments), "--json"]) == EXIT_OK
    return json.loads(capsys.readouterr().out)


def refused(capsys, *arguments):
    assert command_line(["dataset", *map(str, arguments)]) == EXIT_WRONG_USE
    return capsys.readouterr().err


def steps_of(folder, **request):
    return list(RepeatedRun(recorded_run(folder), DatasetRequest(**request)).transitions())


def test_runs_become_a_dataset_for_lerobot(led_folder, tmp_path, capsys, renderer):
    out = tmp_path / "cuts"
    asked = (led_folder, led_folder, "--cameras", "endoscope:32x24", "overview:16x16")
    rate = ("--fps", "10")
    found = written(capsys, *asked, *rate, "--task", "Cut the slab.", "-o", out)
    steps = 2 * steps_of(led_folder, cameras=(), fps=10)
    assert (found["episodes"], found["steps"], found["succeeded"]) == (2, len(steps), 0)
    table = pq.read_table(out / "data" / "chunk-000" / "file-000.parquet")
    for column, name in (("wrench", "wrench"), ("tissue.points", "points:8")):
        rows = np.array(table[f"observation.{column}"].to_pylist(), np.float32)
        assert np.array_equal(rows, [step.before.observations[name] for step in steps])
    actions = np.array(table["action"].to_pylist(), np.float32)
    assert np.array_equal(actions, [step.action for step in steps])
    info = json.loads((out / "meta" / "info.json").read_text())
    assert info["features"]["observation.images.overview"]["shape"] == [16, 16, 3]
    assert info["features"]["action"]["names"][-1] == "left_jaws"
    tasks = pq.read_table(out / "meta" / "tasks.parquet").to_pylist()
    assert tasks == [{"task_index": 0, "task": "Cut the slab."}]


def test_the_cameras_of_the_scene_are_taken_where_none_is_named(
    led_folder, tmp_path, capsys, renderer
):
    written(capsys, led_folder, "-o", tmp_path / "cuts", "--fps", "5")
    info = json.loads((tmp_path / "cuts" / "meta" / "info.json").read_text())
    assert info["fps"] == 5
    assert info["features"]["observation.images.overview"]["shape"] == [36, 48, 3]


def test_runs_become_a_file_for_robomimic(led_folder, tmp_path, capsys, renderer):
    out = tmp_path / "cuts"
    asked = (led_folder, "--format", "robomimic", "--cameras", "overview:16x12", "--fps", "10")
    written(capsys, *asked, "--license", "mit", "-o", out)
    steps = steps_of(led_folder, cameras=(), fps=10)
    with h5py.File(out / FILE) as file:
        demo = file["data/demo_0"]
        assert np.array_equal(demo["actions"], [step.action for step in steps])
        assert np.array_equal(demo["states"], [step.before.hands for step in steps])
        after = [step.after.observations["blade"] for step in steps]
        assert np.array_equal(demo["next_obs/blade"], after)
        assert demo["obs/overview_image"].shape == (len(steps), 12, 16, 3)
    assert "license: mit" in (out / "README.md").read_text()


def test_a_run_gives_the_same_dataset_each_time(led_folder, tmp_path, capsys, renderer):
    for name in ("one", "two"):
        asked = (led_folder, "--cameras", "overview:16x16", "--fps", "10")
        written(capsys, *asked, "-o", tmp_path / name)
    files = [path for path in (tmp_path / "one").rglob("*") if path.is_file()]
    assert len(files) == 7
    for path in files:
        other = tmp_path / "two" / path.relative_to(tmp_path / "one")
        if path.name not in RENDERED:
            assert path.read_bytes() == other.read_bytes()


def test_what_cannot_be_is_said_before_anything_is_simulated(
    led_folder, tmp_path, capsys, monkeypatch
):
    out = ("-o", tmp_path / "cuts")
    assert "no run is given" in refused(capsys, *out)
    sized = refused(capsys, led_folder, "--cameras", "endoscope", *out)
    assert "'endoscope'; write the name and the size" in sized
    twice = refused(capsys, led_folder, "--cameras", "a:8x8", "a:9x9", *out)
    assert "'a' twice" in twice
    both = refused(capsys, led_folder, "--format", "robomimic", "--video", *out)
    assert "--video is for --format lerobot" in both
    there = refused(capsys, led_folder, "-o", led_folder)
    assert "is there already" in there
    monkeypatch.setattr(dataset_command, "find_spec", lambda name: None)
    assert "pip install 'scalpel-sim[data]'" in refused(capsys, led_folder, *out)
    assert list(tmp_path.iterdir()) == []


def test_a_camera_that_is_not_there_is_named_with_those_that_are(
    led_folder, tmp_path, capsys, renderer
):
    asked = (led_folder, "--cameras", "endoscop:32x32", "-o", tmp_path / "cuts")
    assert "Did you mean 'endoscope'?" in refused(capsys, *asked)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_command_keeps_what_is_whole(led_folder, tmp_path, capsys, monkeypatch):
    class Stopped:
        """Signals, of which one comes in the second run."""

        n_looks = 0

        @property
        def reason(self):
            self.n_looks += 1
            return "interrupted by SIGINT" if self.n_looks > 40 else None

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(dataset_command, "StopSignals", Stopped)
    n_steps = len(steps_of(led_folder, cameras=()))
    assert n_steps < 40
    asked = ["dataset", led_folder, led_folder, "--cameras", "-o", tmp_path / "cuts"]
    assert command_line([*map(str, asked)]) == 1
    assert "has the 1 of 2 demonstrations before it" in capsys.readouterr().err
    info = json.loads((tmp_path / "cuts" / "meta" / "info.json").read_text())
    assert info["total_frames"] == n_steps


def test_experts_of_tasks_give_demonstrations_by_the_number(tmp_path, capsys):
    scene = tmp_path / "slab_task.toml"
    scene.write_text(SCENE)
    asked = (scene, "--episodes", "2", "--seed", "7", "--cameras", "--format", "robomimic")
    found = written(capsys, *asked, "-o", tmp_path / "cuts")
    assert (found["episodes"], found["succeeded"]) == (2, 2)
    told = json.loads((tmp_path / "cuts" / "provenance.json").read_text())
    assert [each["seed"] for each in told["episodes"]] == [7, 8]


def test_options_about_experts_are_refused_without_one(led_folder, tmp_path, capsys):
    out = ("-o", tmp_path / "cuts")
    assert "no task is given" in refused(capsys, led_folder, "--episodes", "2", *out)
    assert "at least 1" in refused(capsys, "incise-v0", "--episodes", "0", *out)
