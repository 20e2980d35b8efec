"""Other engines beside ours: the same body for each, and a reason for each that did not run."""

import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from scalpel_sim.bench import peer_benchmark
from scalpel_sim.bench.blocks import held_nodes, jittered_block, measured_edges
from scalpel_sim.bench.engine import block_material
from scalpel_sim.bench.peer_benchmark import body_file, measure_peers
from scalpel_sim.bench.peer_cases import OURS, OURS_SPRINGS, PEERS
from scalpel_sim.bench.peer_process import NotInstalledError, PeerError, PeerProcess
from tissue import Tissue

PYTHON = Path(sys.executable)


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    return body_file(tmp_path_factory.mktemp("peers"), jittered_block(576))


def test_every_engine_gets_the_masses_and_springs_of_ours(body):
    mesh = jittered_block(576)
    with np.load(body) as given:
        ours = Tissue(mesh, block_material("springs"))
        assert given["masses"] == pytest.approx(ours.snapshot().masses)
        springs = ours._model.elasticity.arrays.springs
        row = slice(springs.first[100], springs.first[100] + springs.count[100])
        theirs = {frozenset(e): k for e, k in zip(given["edges"].tolist(), given["stiffness"],
                                                  strict=True)}  # fmt: skip
        for neighbour, stiffness in zip(
            springs.neighbour[row], springs.stiffness[row], strict=True
        ):
            assert theirs[frozenset((100, int(neighbour)))] == pytest.approx(stiffness)
        assert (given["held"] == np.flatnonzero(held_nodes(mesh))).all()


def test_edges_have_the_volume_around_them_and_nodes_a_quarter_of_it():
    edges = measured_edges(jittered_block(576))
    volume = 0.04 * 0.04 * 0.06
    assert edges.node_volumes.sum() == pytest.approx(volume)
    assert edges.volumes.sum() == pytest.approx(6 * volume)  # each tetrahedron has six edges
    assert len(edges.nodes) == 878


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


def test_output_that_an_engine_prints_is_not_taken_for_an_answer(body, tmp_path):
    (tmp_path / "mujoco.py").write_text('print("welcome")\nraise ImportError("another MuJoCo")\n')
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nPYTHONPATH={tmp_path} exec {sys.executable} "$@"\n')
    python.chmod(0o755)
    with pytest.raises(NotInstalledError, match="another MuJoCo"):
        PeerProcess("mujoco_flex", "Euler:damped", body, python, 0)


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
    chosen = {theirs: PEERS[theirs], "MuJoCo flex, made up": PEERS[theirs]._replace(
        case="none:damped")}  # fmt: skip
    monkeypatch.setattr(peer_benchmark, "PEERS", chosen)
    found = measure_peers(2, sizes=(576,))
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


def test_an_engine_that_is_not_installed_is_named_with_what_installs_it(monkeypatch):
    name = "Newton springs"
    monkeypatch.setattr(peer_benchmark, "OURS", {})
    monkeypatch.setattr(peer_benchmark, "PEERS", {name: PEERS[name]._replace(adapter="absent")})
    found = measure_peers(1, sizes=(576,))
    assert found.measurements == []
    (skipped,) = found.skipped
    assert skipped.reason.startswith("Newton is not installed here: pip install newton")
    assert "--python" in skipped.reason
