"""Frames of many Runge-Kutta steps get a warning, and those of too many are refused."""

import re

from scalpel_sim.cli.app import command_line
from scalpel_sim.output.run_folder import FORCES, SUMMARY

STIFF = ["--young", "1e10", "--toughness", "2e7"]


def run(folder, *options):
    """Do two frames of a run in a folder; return its exit code."""
    return command_line(["run", "grid2", "--seconds", "0.002", *options, "--out", str(folder)])


def test_a_body_that_makes_a_run_slow_gets_a_warning(tmp_path, capsys):
    assert run(tmp_path, *STIFF) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"a frame takes [\d,]+ Runge-Kutta steps.*--young", said)


def test_a_body_whose_frames_no_signal_could_end_is_refused_and_earlier_files_stay(
    tmp_path, monkeypatch, capsys
):
    assert run(tmp_path) == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert {FORCES, SUMMARY} < set(before)
    monkeypatch.setattr("scalpel_sim.cli.steps_of_frames.MOST_SUBSTEPS", 300)
    assert run(tmp_path, *STIFF) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"error: a frame takes [\d,]+ .*; at most 300 are done.*--young", said)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
