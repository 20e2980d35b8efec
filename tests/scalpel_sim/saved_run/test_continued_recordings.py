"""A recording goes back and on with its run, and changes nothing of it."""

import re

import numpy as np
import pytest

from scalpel_sim import SCENES, RunRecorder, SavedRun, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.run_setup import perform_resumed
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.runs.checkpoints import read_journal
from scalpel_sim.runs.file_names import JOURNAL
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.output.killed_runs import AGAIN, kill_in, perform_in, physics, resume_in

GRID = changed(SCENES["grid2"], seconds=0.6)


def steps_of(path):
    with SavedRun(path) as run:
        return [run.step(i) for i in range(len(run))], run.rows, run.columns


def expect_same_steps(one, other):
    assert [step.time for step in one] == [step.time for step in other]
    for a, b in zip(one, other, strict=True):
        assert a.wrench.numbers == b.wrench.numbers
        arrays = [(*s.snapshot, *s.deformation, *s.surface[:4], s.cut_age) for s in (a, b)]
        for x, y in zip(*arrays, strict=True):
            assert np.array_equal(x, y, equal_nan=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    perform_in(folder, GRID, record=folder / "run.vtkhdf")
    return folder


def test_a_run_is_the_same_to_the_bit_whether_it_is_recorded_or_not(whole, tmp_path):
    perform_in(tmp_path, GRID)
    assert np.array_equal(physics(tmp_path), physics(whole), equal_nan=True)
    assert (tmp_path / "final.vtu").read_bytes() == (whole / "final.vtu").read_bytes()


def test_the_rows_of_a_recording_are_those_of_its_run(whole):
    _, rows, columns = steps_of(whole / "run.vtkhdf")
    place = columns.index("force_x_n")
    assert len(rows) == 600 and np.abs(rows[:, place : place + 3]).max() > 0.0
    lines = (whole / "forces.csv").read_text().splitlines()
    assert tuple(lines[0].split(",")) == columns
    assert [list(map(float, line.split(",")))[:10] for line in lines[1:]] == rows[:, :10].tolist()


@pytest.mark.parametrize("n_frames", [60, 573])
def test_a_recording_of_a_run_that_was_killed_goes_on_with_it(n_frames, whole, tmp_path):
    path = tmp_path / "run.vtkhdf"
    kill_in(tmp_path, GRID, n_frames, record=path)
    plan, _ = read_journal(tmp_path / JOURNAL)
    assert plan.record == str(path)
    assert len(steps_of(path)[0]) == 1 + n_frames // 40
    resume_in(tmp_path, record=path)
    expect_same_steps(steps_of(path)[0], steps_of(whole / "run.vtkhdf")[0])
    assert len(steps_of(path)[1]) == 600


def test_the_command_line_knows_which_recording_to_continue(whole, tmp_path):
    path = tmp_path / "run.vtkhdf"
    kill_in(tmp_path, GRID, 333, record=path)
    perform_resumed(tmp_path, AGAIN)
    expect_same_steps(steps_of(path)[0], steps_of(whole / "run.vtkhdf")[0])


@pytest.mark.parametrize(
    ("name", "said"),
    [("run.h5", "must end in .vtkhdf"), ("nowhere/run.vtkhdf", "there is no folder")],
)
def test_a_file_that_cannot_be_recorded_to_is_refused_before_the_run(name, said, tmp_path, capsys):
    words = ["run", "grid2", "--out", str(tmp_path / "out"), "--record", str(tmp_path / name)]
    assert command_line(words) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_recording_that_is_lost_begins_anew_where_its_run_continues(tmp_path, caplog):
    path = tmp_path / "run.vtkhdf"
    kill_in(tmp_path, GRID, 173, record=path)
    path.write_text("lost")
    resume_in(tmp_path, record=path)
    begin = re.search(r"cannot be continued .*; it begins anew at (0\.\d+) s", caplog.text)
    steps, _, _ = steps_of(path)
    assert [steps[0].time, steps[-1].time] == pytest.approx([float(begin[1]), 0.6])


def test_a_run_that_nobody_begins_leaves_no_recording(tmp_path):
    def give_up():
        raise RunError("nobody came")

    with pytest.raises(RunError, match="nobody came"):
        perform_in(tmp_path, GRID, record=tmp_path / "run.vtkhdf", before_frames=give_up)
    assert not list(tmp_path.glob("*run.vtkhdf*"))


def test_a_recording_goes_back_with_its_simulation(whole, tmp_path):
    path, simulation = tmp_path / "run.vtkhdf", prepare(GRID)
    n_nodes = simulation.link.describe().n_nodes
    with RunRecorder(simulation, path, seconds=0.1):  # less than comes: it finds room
        simulation.run(0.59)
        assert simulation.link.describe().n_nodes > n_nodes
        simulation.reset()
        simulation.run(0.5)
        state = simulation.save_state()
        simulation.run(0.57)
        simulation.load_state(state)
        simulation.run(0.6)
    expect_same_steps(steps_of(path)[0], steps_of(whole / "run.vtkhdf")[0])


def test_the_name_of_a_recording_says_what_it_is(tmp_path):
    with pytest.raises(UsageError, match=r"must end in \.vtkhdf"):
        RunRecorder(prepare(GRID), tmp_path / "run.h5")
