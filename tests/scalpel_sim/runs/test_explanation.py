"""A frame of a run is explained: what acted adds up, its row is as it was, no file changes."""

import hashlib
import json

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_RUN_FAILED, EXIT_WRONG_USE
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.explanation import OF_BLADE, explanation_of, frame_to_explain
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.output.killed_runs import kill_in, perform_in
from tissue import BladeShape

FRAME = 625
"""Frame that is explained, in which the edge cuts and the faces press."""

AT = 1e-3 * (FRAME - 1)

SCENE = changed(SCENES["grid2"], seconds=0.7, stretch=0.0, blade=BladeShape(thickness=0.001))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole")
    perform_in(path, SCENE)
    return path


@pytest.fixture(scope="module")
def found(folder):
    return explanation_of(frame_to_explain(folder, AT), lambda simulation: None)


def sums_of(folder):
    return {
        path.name: (path.stat().st_mtime_ns, hashlib.sha256(path.read_bytes()).hexdigest())
        for path in folder.iterdir()
    }


def json_of(folder, capsys, at=AT):
    assert command_line(["explain", str(folder), "--at", str(at), "--json"]) == EXIT_OK
    return json.loads(capsys.readouterr().out)


def test_the_forces_of_the_blade_add_up_to_the_wrench_at_the_end_of_the_frame(found):
    forces = found.of_kinds(*OF_BLADE)
    assert {each.kind for each in forces} >= {"edge", "face"}
    total = np.sum([each.force for each in forces], axis=0)
    assert np.linalg.norm(total) > 0.1
    assert total == pytest.approx(-found.at_end, rel=1e-12, abs=1e-12)
    assert np.sum(found.parts, axis=0) == pytest.approx(found.at_end, rel=1e-12, abs=1e-12)


def test_the_frame_is_the_row_that_was_recorded(found, folder):
    recorded = read_forces(folder / "forces.csv")
    assert found.frame == FRAME
    assert found.time == recorded.column("time_s")[FRAME - 1]
    assert (found.felt.force == recorded.vector("force")[FRAME - 1]).all()
    assert (found.raw.force == recorded.vector("tissue_force")[FRAME - 1]).all()


def test_states_go_with_the_forces_and_their_limits(found):
    edge = [each for each in found.of_kinds("edge") if each.state != "retracted"]
    assert any(each.state.startswith("slips") for each in edge)
    for each in edge:
        assert each.depth > 0.0
        assert np.linalg.norm(each.force) <= 1.5 * each.limit
    for each in found.of_kinds("face"):
        assert each.depth > 0.0
        assert each.state == "slides" or each.friction <= each.limit * (1.0 + 1e-9)


def test_the_command_prints_all_as_json_and_changes_no_file(folder, found, capsys):
    before = sums_of(folder)
    printed = json_of(folder, capsys)
    assert sums_of(folder) == before
    assert printed["frame"] == FRAME
    assert printed["felt"]["force_n"] == found.felt.force.tolist()
    assert len(printed["forces"]) == len(found.forces)
    assert "at the edge" in printed["sentence"]


def test_tables_show_the_largest_forces_of_a_kind_and_the_sum_of_the_others(folder, capsys):
    assert command_line(["explain", str(folder), "--at", str(AT)]) == EXIT_OK
    out = capsys.readouterr().out
    assert f"frame {FRAME} of grid2, from {AT:g} s" in out
    for words in ("Anchors of the edge", "Faces of the blade", "Supports", "more, together"):
        assert words in out


def test_a_run_that_was_killed_is_explained_from_its_checkpoint(tmp_path, found, capsys):
    kill_in(tmp_path, SCENE, 690)
    before = sums_of(tmp_path)
    printed = json_of(tmp_path, capsys)
    assert sums_of(tmp_path) == before
    assert printed["resumed_from_frame"] > 0
    assert printed["felt"]["force_n"] == found.felt.force.tolist()


def test_a_row_that_is_not_what_it_was_is_an_error(folder, tmp_path, capsys):
    for name in ("scene.toml", "forces.csv"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    lines = (tmp_path / "forces.csv").read_text().splitlines()
    numbers = lines[3].split(",")
    numbers[1] = "0.5"
    lines[3] = ",".join(numbers)
    (tmp_path / "forces.csv").write_text("\n".join(lines) + "\n")
    assert command_line(["explain", str(tmp_path), "--at", "0.01", "--quiet"]) == EXIT_RUN_FAILED
    assert "frame 3 is done again, and tip_x_m is" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("names", "at", "message"),
    [
        ((), 0.0, "it has no forces.csv"),
        (("forces.csv", "initial.vtu"), 0.0, "in another process (--connect)"),
        (("forces.csv", "scene.toml"), 7.0, "--at is 7 s, and the frames in"),
        (("forces.csv", "scene.toml"), -1.0, "give one of these times"),
    ],
)
def test_what_is_no_frame_of_a_run_is_refused(names, at, message, folder, tmp_path, capsys):
    for name in names:
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    assert command_line(["explain", str(tmp_path), f"--at={at}"]) == EXIT_WRONG_USE
    assert message in capsys.readouterr().err


def test_a_folder_that_is_not_there_is_refused(tmp_path, capsys):
    assert command_line(["explain", str(tmp_path / "none"), "--at", "0"]) == EXIT_WRONG_USE
    assert "there is no such folder" in capsys.readouterr().err
