"""Frames of many Runge-Kutta steps get a warning, and those of too many are refused."""

import re
from types import SimpleNamespace

import pytest

from bridge import InProcessLink
from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.run_setup import check_steps_of_frames
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.file_names import FORCES, SUMMARY
from tissue import Material, Tissue, block

STIFF = ["--young", "1e10", "--toughness", "2e7"]


def run(folder, *options):
    """Do two frames of a run in a folder; return its exit code."""
    return command_line(["run", "grid2", "--seconds", "0.002", *options, "--out", str(folder)])


def test_a_body_that_makes_a_run_slow_gets_a_warning(tmp_path, capsys):
    assert run(tmp_path, *STIFF) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"a frame takes [\d,]+ Runge-Kutta steps.*--young", said)


@pytest.mark.parametrize(
    ("quantities", "reason", "remedy"),
    [
        ({"retardation_time": 1e3}, "damping is strong", "retardation_time"),
        ({"viscous_damping": 1e9}, "damping is strong", "viscous_damping"),
        ({"density": 1e-6}, "elements are small, stiff or light", "--density"),
    ],
)
def test_the_reason_that_is_named_is_the_one_that_is_there(quantities, reason, remedy):
    tissue = Tissue(block((2, 2, 2), (0.04, 0.04, 0.04)), Material(**quantities))
    frames = SimpleNamespace(dt=1e-3, link=InProcessLink(tissue))
    with pytest.raises(UsageError, match=f"the tissue's {reason}; at most .*{remedy}"):
        check_steps_of_frames(frames)


def test_a_body_whose_frames_no_signal_could_end_is_refused_and_earlier_files_stay(
    tmp_path, monkeypatch, capsys
):
    assert run(tmp_path) == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert {FORCES, SUMMARY} < set(before)
    monkeypatch.setattr("scalpel_sim.cli.run_setup.MOST_SUBSTEPS", 300)
    assert run(tmp_path, *STIFF) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"error: a frame takes [\d,]+ .*; at most 300 are done.*--young", said)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
