"""A run that was killed goes on from its last checkpoint, and ends as if it had not been."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.hands.commands import Engage, Release, Undo
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.runs.file_names import PASSING_FILES, REPLAY_FRAMES
from scalpel_sim.runs.resumption import resumption_of
from scalpel_sim.runs.run_folder import FRAMES_PER_FLUSH, Outputs
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.output.killed_runs import (
    Killed,
    at,
    expect_same,
    kill_in,
    led,
    perform_in,
    physics,
    resume_in,
)
from tissue import StateError

pytestmark = pytest.mark.end_to_end

SLAB = changed(SCENES["slab"], seconds=0.46)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    perform_in(folder, SLAB)
    return folder


@pytest.mark.parametrize("n_frames", [60, 333])
def test_a_run_that_was_killed_ends_as_one_that_was_not(n_frames, tmp_path, whole):
    kill_in(tmp_path, SLAB, n_frames)
    resume_in(tmp_path)
    expect_same(tmp_path, whole)


def test_a_run_can_be_killed_again_while_it_repeats_frames(tmp_path, whole):
    kill_in(tmp_path, SLAB, 190)
    for n_frames in (resumption_of(tmp_path).n_frames + 3, 400):
        with pytest.raises(Killed):
            resume_in(tmp_path, every_frame=at(n_frames))
    resume_in(tmp_path)
    expect_same(tmp_path, whole)


def test_no_more_than_the_rows_of_a_flush_are_lost(tmp_path):
    kill_in(tmp_path, SLAB, 333)
    assert len(read_forces(tmp_path / "forces.csv")) > 333 - FRAMES_PER_FLUSH
    assert resumption_of(tmp_path).n_frames >= 100


def test_a_run_that_goes_on_ends_with_the_warnings_of_one_that_was_not_killed(tmp_path):
    free = changed(SCENES["grid2"], fixed="none", table=0.0)  # the blade pushes it along
    expected = perform_in(tmp_path / "whole", free).warnings
    kill_in(tmp_path / "killed", free, 900)
    assert resume_in(tmp_path / "killed").warnings == expected
    assert [warning["kind"] for warning in expected] == ["unfinished_cut"]


def test_a_complete_run_leaves_no_checkpoint(whole):
    assert {path.name for path in whole.iterdir()} & set(PASSING_FILES) == set()
    with pytest.raises(UsageError, match="that run is complete"):
        resumption_of(whole)


def test_a_frame_that_differs_from_its_row_is_an_error_that_names_it(tmp_path):
    kill_in(tmp_path, SLAB, 333)
    resumption = resumption_of(tmp_path)
    other = Recording()  # as of another machine: its checksums hold
    for row in resumption.recorded.rows.copy():
        row[shared_columns().index("tip_x_m")] *= 1.0 + 1e-15
        other.append(row)
    with pytest.raises(RunError, match=r"frame \d+ is done again, and tip_x_m is"):
        perform_in(tmp_path, SLAB, None, resumption._replace(recorded=other, checkpoint=None))


def files_in(folder):
    """Return the content of each file but the replay's frames, which are cut at a checkpoint."""
    paths = [path for path in folder.iterdir() if path.name != REPLAY_FRAMES]
    return {path.name: path.read_bytes() for path in paths}


def test_a_run_with_another_scene_is_refused_and_its_folder_stays_as_it_was(tmp_path, whole):
    kill_in(tmp_path, SLAB, 333)
    (tmp_path / "final.vtu").write_text("of a run that was interrupted by a signal")
    before = files_in(tmp_path)
    scene = changed(SLAB, material=replace(SLAB.material, young_modulus=12e3))
    with pytest.raises(StateError, match=r"material.young_modulus is .* there and 12000.0 here"):
        perform_in(tmp_path, scene, None, resumption_of(tmp_path))
    assert files_in(tmp_path) == before
    resume_in(tmp_path)
    expect_same(tmp_path, whole)


def test_a_run_that_finds_no_room_to_go_on_leaves_its_folder_as_it_was(tmp_path, monkeypatch):
    kill_in(tmp_path, SLAB, 333)
    before = files_in(tmp_path)
    monkeypatch.setattr("scalpel_sim.runs.run_folder.LAST_FILES", 1 << 60)
    with pytest.raises(RunError, match=r"no room for .*; make room$"):
        resume_in(tmp_path)
    assert files_in(tmp_path) == before


def test_a_complete_run_that_lacks_a_file_makes_it_when_it_goes_on(tmp_path, monkeypatch, whole):
    def fail(outputs):
        raise RunError("drawing failed")

    with monkeypatch.context() as failing, pytest.raises(RunError, match=r"failed.*--resume"):
        failing.setattr(Outputs, "finish_plots", fail)
        perform_in(tmp_path, SLAB)
    (tmp_path / "force.png").unlink(missing_ok=True)
    resume_in(tmp_path)
    assert (tmp_path / "force.png").exists()
    expect_same(tmp_path, whole)
    assert not {path.name for path in tmp_path.iterdir()} & set(PASSING_FILES)


def test_a_folder_without_a_run_is_refused_with_the_reason(tmp_path):
    with pytest.raises(UsageError, match="it holds no run"):
        resumption_of(tmp_path)
    with pytest.raises(UsageError, match="there is no such folder"):
        resumption_of(tmp_path / "nowhere")


def test_a_run_that_was_killed_before_it_had_a_scene_is_refused_with_the_reason(
    tmp_path, monkeypatch
):
    def kill(outputs, text):
        raise Killed

    with monkeypatch.context() as killing, pytest.raises(Killed):
        killing.setattr(Outputs, "write_scene", kill)
        perform_in(tmp_path, SLAB)
    with pytest.raises(UsageError, match=r"its run ended before it wrote its scene\.toml"):
        resumption_of(tmp_path)


def test_a_run_whose_tissue_was_elsewhere_is_refused_with_the_reason(tmp_path):
    scene = changed(SLAB, mesh=lambda: SLAB.mesh())  # no table says what the body is
    kill_in(tmp_path, scene, 30)
    with pytest.raises(UsageError, match=r"its run was in another process, or .*--connect"):
        resumption_of(tmp_path)


def test_a_new_run_in_the_folder_leaves_nothing_of_the_one_before(tmp_path):
    kill_in(tmp_path, SLAB, 333)
    kill_in(tmp_path, SLAB, 60)
    assert resumption_of(tmp_path).n_frames == 0
    assert len(read_forces(tmp_path / "forces.csv")) == 50


def test_what_a_hand_did_is_done_again_from_the_last_checkpoint(tmp_path):
    led(tmp_path, 620)
    then = physics(tmp_path)
    assert len(then) > 620 - FRAMES_PER_FLUSH
    resume_in(tmp_path)
    assert np.array_equal(physics(tmp_path)[: len(then)], then, equal_nan=True)
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "complete"


def test_a_checkpoint_of_what_was_undone_is_gone(tmp_path):
    led(tmp_path, 330, (100, Release()), (110, Engage()), (320, Undo()))  # back to 110
    then, found = physics(tmp_path), resumption_of(tmp_path)
    assert found.n_frames <= len(found.recorded) == len(then)
    resume_in(tmp_path)
    assert np.array_equal(physics(tmp_path)[: len(then)], then, equal_nan=True)
