"""A run is done again as it was, and what is taken of it is what it was."""

import json
import shutil
from itertools import pairwise

import numpy as np
import pytest

from scalpel_sim import Camera, prepare
from scalpel_sim.datasets.hand_poses import poses_of_hands
from scalpel_sim.datasets.recorded_runs import recorded_run
from scalpel_sim.datasets.repeated_run import RepeatedRun
from scalpel_sim.datasets.taking import DatasetRequest, expect_alike
from scalpel_sim.errors import Interrupted, RunError, UsageError
from scalpel_sim.learning import Episode
from scalpel_sim.scene.observe_table import CameraTable
from scalpel_sim.strokes.grasp_motion import grasp_from_csv
from scalpel_sim.strokes.stroke import from_csv
from tests.scalpel_sim.datasets.recorded_demonstrations import (
    led_folder,
    script_folder,
    slab_task,
)

__all__ = ["led_folder", "script_folder", "slab_task"]

N_FRAMES = 20
"""Frames of a control step of 20 ms."""

NO_IMAGES = DatasetRequest(cameras=())


def taken(folder, request=NO_IMAGES):
    """Return a run that was done again, and its control steps."""
    repeated = RepeatedRun(recorded_run(folder), request)
    return repeated, list(repeated.transitions())


@pytest.fixture(scope="module")
def scripted(script_folder):
    return taken(script_folder)


@pytest.fixture(scope="module")
def led(led_folder):
    return taken(led_folder)


def test_the_hands_are_where_the_files_of_what_they_did_have_them(led, led_folder):
    _, steps = led
    stroke = from_csv(led_folder / "stroke.csv")
    motion = grasp_from_csv(led_folder / "grasper_left.csv", "left")
    for i in range(1, len(steps)):
        t = 1e-3 * (N_FRAMES * i - 1)  # of the last frame that was done
        numbers, edge = steps[i].before.hands, stroke.pose(t)
        assert numbers[0] == pytest.approx(1e-3 * N_FRAMES * i)
        assert numbers[1:4] == pytest.approx((edge.tip + edge.heel) / 2.0, abs=1e-9)
        assert numbers[15] == pytest.approx(motion.opening(t), abs=1e-9)
    assert np.ptp([step.before.hands[3] for step in steps]) > 5e-3
    assert np.ptp([step.before.hands[15] for step in steps]) > 3e-3


def test_what_is_observed_is_what_forces_csv_has(scripted, script_folder):
    _, steps = scripted
    rows, frame = (
        recorded_run(script_folder).rows(),
        prepare(recorded_run(script_folder).scene).frame,
    )
    forces, tips = rows.vector("force"), frame.points_to_tissue(rows.vector("tip"))
    assert len(steps) == len(rows) // N_FRAMES
    for i, step in enumerate(steps):
        seen, end = step.after.observations, N_FRAMES * (i + 1)
        mean = forces[end - N_FRAMES : end].mean(axis=0)
        felt = np.linalg.norm(seen["wrench"][:3])
        assert felt == pytest.approx(np.linalg.norm(mean), rel=1e-3, abs=1e-6)  # it hardly turns
        assert seen["blade"][:3] == pytest.approx(tips[end - 1], abs=1e-7)
    assert max(np.linalg.norm(step.after.observations["wrench"][:3]) for step in steps) > 0.1


def test_a_step_begins_as_the_one_before_it_ended(scripted):
    _, steps = scripted
    assert all(later.before is earlier.after for earlier, later in pairwise(steps))
    assert [step.is_done for step in steps] == [False] * (len(steps) - 1) + [True]


def test_actions_of_a_demonstration_done_as_a_policy_does_them_do_it_again(scripted, slab_task):
    _, steps = scripted
    episode = Episode(slab_task)
    episode.reset(np.random.default_rng(0))
    for step in steps:
        hands = [n for pose in poses_of_hands(episode.simulation).values() for n in pose.numbers]
        places = np.r_[0:3, 7:10]
        assert np.array(hands)[places] == pytest.approx(step.before.hands[1:][places], abs=1e-6)
        if episode.act(step.action).terminated:
            break
    assert episode.is_success
    assert any(step.is_success for step in steps)


def test_rewards_add_up_to_what_was_achieved(scripted):
    repeated, steps = scripted
    told = repeated.provenance()
    terms, pays = told["score"], repeated.run.scene.task.reward
    achieved = pays.covered * terms["covered"] + pays.off_plan * terms["off_plan"] + pays.success
    assert told["success"] is True
    assert sum(step.reward for step in steps) == pytest.approx(achieved)


def test_images_are_those_of_their_instants(script_folder, renderer):
    rows = [CameraTable(name="endoscope", size=(32, 24)), CameraTable(name="overview")]
    _, steps = taken(script_folder, DatasetRequest(cameras=rows, fps=5))
    simulation = prepare(recorded_run(script_folder).scene)
    with Camera(simulation, "endoscope", width=32, height=24) as camera:
        other = camera.another("overview", width=128, height=128)
        for step in steps:
            assert np.array_equal(step.before.images["endoscope"], camera.rgb())
            assert np.array_equal(step.before.images["overview"], other.rgb())
            for _ in range(200):
                simulation.step()
    assert not np.array_equal(
        steps[0].before.images["endoscope"], steps[-1].after.images["endoscope"]
    )


def test_a_rate_is_whole_frames(script_folder):
    _, steps = taken(script_folder, NO_IMAGES._replace(fps=20))
    assert steps[1].before.hands[0] == pytest.approx(0.05)
    with pytest.raises(UsageError, match=r"--fps is 30.*whole number.*10, 20, 25"):
        taken(script_folder, NO_IMAGES._replace(fps=30))


def test_a_demonstration_says_where_it_comes_from(led, led_folder):
    repeated, steps = led
    told = repeated.provenance()
    assert (told["led_by"], told["steps"]) == ("a hand", len(steps))
    assert set(told["sha256"]) == {"scene.toml", "stroke.csv", "grasper_left.csv"}
    assert told["scene_file"] == (led_folder / "scene.toml").read_text()
    assert told["success"] is False
    assert json.dumps(told, allow_nan=False)


def test_a_run_that_is_not_what_it_was_is_refused(script_folder, tmp_path):
    folder = tmp_path / "changed"
    shutil.copytree(script_folder, folder)
    lines = (folder / "forces.csv").read_text().splitlines(keepends=True)
    cells = lines[500].split(",")
    cells[1] = repr(float(np.nextafter(float(cells[1]), 1.0)))
    (folder / "forces.csv").write_text("".join([*lines[:500], ",".join(cells), *lines[501:]]))
    with pytest.raises(RunError, match="frame 500 is done again, and tip_x_m is"):
        taken(folder)


def test_a_run_of_another_version_is_refused_with_the_command_that_helps(script_folder, tmp_path):
    folder = tmp_path / "old"
    shutil.copytree(script_folder, folder)
    summary = json.loads((folder / "summary.json").read_text())
    summary["versions"]["scalpel_sim"] = "0.0.1"
    (folder / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(UsageError, match=r"version 0\.0\.1 .*scalpel-sim run .*scene\.toml --out"):
        recorded_run(folder)


def test_a_folder_without_a_run_is_refused(tmp_path, script_folder):
    with pytest.raises(UsageError, match="no such folder"):
        recorded_run(tmp_path / "none")
    with pytest.raises(UsageError, match=r"no forces\.csv"):
        recorded_run(tmp_path)
    shutil.copy(script_folder / "forces.csv", tmp_path)
    with pytest.raises(UsageError, match=r"no scene\.toml.*--connect"):
        recorded_run(tmp_path)


def test_a_run_ends_between_two_control_steps(script_folder):
    reasons = iter([None, None, "interrupted by SIGINT"])
    repeated = RepeatedRun(
        recorded_run(script_folder), NO_IMAGES, stop_reason=lambda: next(reasons)
    )
    steps = repeated.transitions()
    assert len([next(steps), next(steps)]) == 2
    with pytest.raises(Interrupted, match="SIGINT"):
        next(steps)


def test_runs_that_differ_are_no_one_dataset(script_folder, led_folder):
    runs = [recorded_run(folder) for folder in (script_folder, led_folder)]
    expect_alike([RepeatedRun(run, NO_IMAGES) for run in runs])
    others = [RepeatedRun(runs[0], NO_IMAGES), RepeatedRun(runs[1], NO_IMAGES._replace(fps=10))]
    with pytest.raises(UsageError, match="other control steps a second"):
        expect_alike(others)
