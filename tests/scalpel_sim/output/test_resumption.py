"""A run that was killed goes on from its last checkpoint, and ends as if it had not been."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.hands.commands import Engage, Undo
from scalpel_sim.hands.live_hand import LiveHand
from scalpel_sim.output.checkpoints import CHECKPOINT_FILES, Checkpoints
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.recording import WALL_TIMES, read_forces
from scalpel_sim.output.resumption import resumption_of
from scalpel_sim.output.run_folder import (
    FRAMES_PER_FLUSH,
    PASSING_FILES,
    REPLAY_FRAMES,
    Outputs,
)
from scalpel_sim.run import perform
from scalpel_sim.scene_parts.scene import changed
from scalpel_sim.scenes import read_scene
from scalpel_sim.state.checkpoint import read_checkpoint
from tests.scalpel_sim.hands.led_runs import controls_of, through_the_body
from tissue import StateError

SLAB = changed(SCENES["slab"], seconds=0.46)
EVERY = 0.1
"""Simulated time between two checkpoints [s]."""

WALL = ("wall_seconds", "real_time_factor", "frame_rate_median", "frame_rate_p99", "share")
"""Figures of a summary that differ from run to run."""


class Killed(BaseException):
    """What ends a run at once, as a kill does."""


def at(n_frames):
    """Return a callback that ends a run after so many frames."""

    def kill(simulation):
        if len(simulation.recording) == n_frames:
            raise Killed

    return kill


def perform_in(folder, scene, simulation=None, resumption=None, **others):
    """Do a run in a folder."""
    simulation = prepare(scene) if simulation is None else simulation
    with Plotter() as plotter:
        columns = simulation.recording.columns
        outputs = Outputs(folder, plotter, columns, checkpoint_seconds=EVERY, resumption=resumption)
        settings = {"scene": scene.name}
        seconds = scene.seconds
        return perform(
            simulation, outputs, scene=scene, settings=settings, seconds=seconds, **others
        )


def kill_in(folder, scene, n_frames, **others):
    """Do a run that is killed after so many frames."""
    with pytest.raises(Killed):
        perform_in(folder, scene, every_frame=at(n_frames), **others)


def resume_in(folder, **others):
    """Go on with a run in a folder."""
    return perform_in(
        folder, read_scene(folder / "scene.toml"), None, resumption_of(folder), **others
    )


def frames_of(path):
    """Return how many frames the run of a checkpoint had done."""
    return read_checkpoint(path).head.n_frames


def physics(folder):
    """Return the columns of `forces.csv` but wall times."""
    recording = read_forces(folder / "forces.csv")
    return recording.rows[:, [name not in WALL_TIMES for name in recording.columns]]


def figures(folder):
    """Return the figures of `summary.json` but wall times."""
    summary = json.loads((folder / "summary.json").read_text())
    return {key: value for key, value in summary.items() if key not in WALL}


def expect_same(folder, whole):
    """Compare the files of two runs."""
    assert np.array_equal(physics(folder), physics(whole), equal_nan=True)
    assert figures(folder) == figures(whole)
    for name in ("initial.vtu", "final.vtu", "scene.toml", "replay.html"):
        assert (folder / name).read_bytes() == (whole / name).read_bytes(), name


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


def test_a_complete_run_leaves_no_checkpoint(whole):
    assert {path.name for path in whole.iterdir()} & set(PASSING_FILES) == set()
    with pytest.raises(UsageError, match="that run is complete"):
        resumption_of(whole)


def test_a_damaged_checkpoint_is_left_out_and_the_one_before_is_taken(tmp_path, caplog):
    kill_in(tmp_path, SLAB, 450)
    with Checkpoints(tmp_path) as checkpoints:
        last, before = (each.head.n_frames for each in checkpoints.read())
    newest = next(p for p in map(tmp_path.joinpath, CHECKPOINT_FILES) if frames_of(p) == last)
    data = bytearray(newest.read_bytes())
    data[len(data) // 2] ^= 1
    newest.write_bytes(data)
    assert resumption_of(tmp_path).n_frames == before < last
    assert f"{newest.name}: it is no checkpoint of this version, or a part is" in caplog.text


@pytest.mark.parametrize("name", ["forces.csv", "replay.part"])
def test_a_run_goes_on_where_another_of_its_files_is_shorter_than_it_was(name, tmp_path, whole):
    kill_in(tmp_path, SLAB, 333)
    path = tmp_path / name
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    resume_in(tmp_path)
    expect_same(tmp_path, whole)


def test_a_frame_that_differs_from_its_row_is_an_error_that_names_it(tmp_path):
    kill_in(tmp_path, SLAB, 333)
    forces = tmp_path / "forces.csv"
    lines, n = forces.read_text().splitlines(keepends=True), 50
    for name in CHECKPOINT_FILES:  # so that all frames are done again
        (tmp_path / name).unlink()
    time, x, rest = lines[n].split(",", 2)
    lines[n] = f"{time},{float(x) * (1.0 + 1e-15)!r},{rest}"
    forces.write_text("".join(lines))
    with pytest.raises(RunError, match=r"frame \d+ is done again, and tip_x_m is"):
        resume_in(tmp_path)


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
    monkeypatch.setattr("scalpel_sim.output.run_folder.LAST_FILES", 1 << 60)
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


def test_a_table_that_was_damaged_is_refused_by_its_row(tmp_path):
    kill_in(tmp_path, SLAB, 333)
    forces = tmp_path / "forces.csv"
    forces.write_text(forces.read_text().replace("\n", "\nword,", 40))
    with pytest.raises(UsageError, match=r"forces.csv was changed or damaged \(.*'word'"):
        resumption_of(tmp_path)


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"it holds no run, or one without a scene\.toml"):
        resumption_of(tmp_path)
    with pytest.raises(UsageError, match="there is no such folder"):
        resumption_of(tmp_path / "nowhere")


def test_a_new_run_in_the_folder_leaves_nothing_of_the_one_before(tmp_path):
    kill_in(tmp_path, SLAB, 333)
    kill_in(tmp_path, SLAB, 60)
    assert resumption_of(tmp_path).n_frames == 0
    assert len(read_forces(tmp_path / "forces.csv")) == 50


def led(folder, n_frames, *commands):
    """Do a run that a hand leads, and that is killed; what it does is drawn from a seed."""
    scene = SCENES["grid2"]
    simulation = prepare(scene, is_led=True)
    hand = LiveHand(simulation, seconds=10.0, clock=lambda: 0.0)
    controls = controls_of(simulation, hand)
    lead, kill = through_the_body(hand), at(n_frames)

    def after_frame(now):
        lead(now)
        for n, command in commands:
            if n == len(now.recording):
                controls.commands.append(command)
        kill(now)

    with pytest.raises(Killed):
        perform_in(folder, scene, simulation, every_frame=after_frame, controls=controls)


def test_what_a_hand_did_is_done_again_from_the_last_checkpoint(tmp_path):
    led(tmp_path, 620)
    then = physics(tmp_path)
    assert len(then) >= 600
    resume_in(tmp_path)
    assert np.array_equal(physics(tmp_path)[: len(then)], then, equal_nan=True)
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "complete"


def test_a_checkpoint_of_what_was_undone_is_gone(tmp_path):
    led(tmp_path, 330, (100, Engage()), (320, Undo()))
    found = resumption_of(tmp_path)
    assert found.n_frames <= len(found.recorded)
