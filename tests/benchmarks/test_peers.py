"""Other engines and ours: the same body for each, and a reason for each that did not run."""

import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from benchmarks.engine import held_nodes, jittered_block
from benchmarks.peers import benchmark as peer_benchmark
from benchmarks.peers.benchmark import OURS, OURS_SPRINGS, PEERS, peers
from benchmarks.peers.process import NotInstalledError, PeerError, PeerProcess, body_file

PYTHON = Path(sys.executable)


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    return body_file(tmp_path_factory.mktemp("peers"), jittered_block(576))


def test_every_engine_gets_masses_and_springs_that_add_up(body):
    mesh = jittered_block(576)
    volume = 0.04 * 0.04 * 0.06
    with np.load(body) as given:
        assert given["masses"].sum() == pytest.approx(1e3 * volume)
        assert (given["held"] == np.flatnonzero(held_nodes(mesh))).all()
        assert len(given["edges"]) == len(given["stiffness"]) == 878
        lengths = np.linalg.norm(np.diff(mesh.positions[given["edges"]], axis=1)[:, 0], axis=1)
        # By van Gelder's formula: each tetrahedron has six edges.
        assert (given["stiffness"] * lengths**2).sum() == pytest.approx(3e3 * 6 * volume)


@pytest.mark.parametrize(
    ("adapter", "case"),
    [("ours", "springs:runge_kutta:damped"), ("mujoco_flex", "Euler:damped")],
)
def test_an_engine_in_its_own_process_steps_and_moves_under_gravity(adapter, case, body):
    process = PeerProcess(adapter, case, body, PYTHON, 0)
    try:
        turn = process.turn(0.02)
    finally:
        process.close()
    assert len(turn.seconds) >= 3 and (turn.seconds > 0.0).all()
    assert 1e-6 < turn.moved < 0.01  # metres: it sags, and did not explode


def test_a_missing_engine_and_one_without_the_case_raise_different_errors(body, tmp_path):
    bare = tmp_path / "python"
    bare.write_text('#!/bin/sh\necho "ModuleNotFoundError: No module named newton" >&2\nexit 1\n')
    bare.chmod(0o755)
    with pytest.raises(NotInstalledError, match="newton"):
        PeerProcess("newton_semi_implicit", "springs:damped", body, bare, 0)
    with pytest.raises(PeerError, match="implicit"):
        PeerProcess("mujoco_flex", "implicit:damped", body, PYTHON, 0)


def test_ratios_are_taken_in_each_round_and_missing_cases_are_reported(capsys, monkeypatch):
    ours, theirs = OURS_SPRINGS, "MuJoCo flex, Euler"
    monkeypatch.setattr(peer_benchmark, "OURS", {ours: OURS[ours]})
    made_up = msgspec.structs.replace(PEERS[theirs], case="none:damped")
    chosen = {theirs: PEERS[theirs], "MuJoCo flex, made up": made_up}
    monkeypatch.setattr(peer_benchmark, "PEERS", chosen)
    found = peers(runs=2, sizes=(576,))
    by_case = {(each.case, each.quantity): each for each in found.measurements}
    ratio = by_case[theirs, f"times as long as {ours}"]
    assert ratio.n == 2 and ratio.lowest <= ratio.median <= ratio.highest
    assert ratio.median == pytest.approx(
        by_case[theirs, "time"].median / by_case[ours, "time"].median, rel=0.5
    )
    (skipped,) = found.skipped
    assert skipped.case == "MuJoCo flex, made up" and "none" in skipped.reason
    found.show(Console(width=200))
    out = capsys.readouterr().out
    assert "what differs" in out and "not measured: MuJoCo flex, made up" in out and "ms" in out


def test_an_engine_that_is_not_installed_is_named_with_what_installs_it(monkeypatch, tmp_path):
    name = "Newton springs"
    (tmp_path / "newton.py").write_text('raise ImportError("no newton")\n')
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(peer_benchmark, "OURS", {})
    monkeypatch.setattr(peer_benchmark, "PEERS", {name: PEERS[name]})
    found = peers(runs=1, sizes=(576,))
    assert found.measurements == []
    (skipped,) = found.skipped
    assert skipped.reason.startswith("Newton is not installed here: pip install newton")
    assert "--python" in skipped.reason
