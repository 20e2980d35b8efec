"""Other engines beside ours: the same body for everyone, and honest about who did not run."""

import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from scalpel_sim.bench import peers
from scalpel_sim.bench.blocks import block_mesh, edges_of, held
from scalpel_sim.bench.peer_process import Failed, NotInstalled, PeerProcess
from tissue import Tissue

HERE = Path(sys.executable)


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    return peers._body_file(tmp_path_factory.mktemp("peers"), 576)


def test_everyone_gets_the_masses_and_springs_that_our_engine_has(body):
    mesh = block_mesh(576)
    with np.load(body) as given:
        ours = Tissue(mesh, peers.material("springs"))
        assert given["masses"] == pytest.approx(ours.snapshot().masses)
        springs = ours._elasticity.arrays.springs
        row = slice(springs.first[100], springs.first[100] + springs.count[100])
        theirs = {frozenset(e): k for e, k in zip(given["edges"].tolist(), given["stiffness"],
                                                  strict=True)}  # fmt: skip
        for neighbour, stiffness in zip(
            springs.neighbour[row], springs.stiffness[row], strict=True
        ):
            assert theirs[frozenset((100, int(neighbour)))] == pytest.approx(stiffness)
        assert (given["held"] == np.flatnonzero(held(mesh))).all()


def test_edges_have_the_volume_around_them_and_nodes_a_quarter_of_it():
    edges = edges_of(block_mesh(576))
    volume = 0.04 * 0.04 * 0.06
    assert edges.node_volumes.sum() == pytest.approx(volume)
    assert edges.volumes.sum() == pytest.approx(6 * volume)  # each tetrahedron has six edges
    assert len(edges.nodes) == 878


@pytest.mark.parametrize(
    ("script", "case"),
    [("ours.py", "springs:runge_kutta:damped"), ("mujoco_flex.py", "Euler:damped")],
)
def test_an_engine_in_its_own_process_steps_and_moves_under_gravity(script, case, body):
    process = PeerProcess(script, case, body, HERE, 0)
    try:
        turn = process.turn(0.02)
    finally:
        process.close()
    assert len(turn.seconds) >= 3 and (turn.seconds > 0.0).all()
    assert 1e-6 < turn.moved < 0.01  # metres: it sags, and did not explode


def test_an_engine_that_is_not_there_and_one_that_cannot_are_told_apart(body, tmp_path):
    bare = tmp_path / "python"
    bare.write_text('#!/bin/sh\necho "ModuleNotFoundError: No module named newton" >&2\nexit 1\n')
    bare.chmod(0o755)
    with pytest.raises(NotInstalled, match="newton"):
        PeerProcess("newton_semi_implicit.py", "springs:damped", body, bare, 0)
    with pytest.raises(Failed, match="implicit"):
        PeerProcess("mujoco_flex.py", "implicit:damped", body, HERE, 0)


def test_ratios_are_taken_in_each_round_and_what_is_missing_is_said(capsys, monkeypatch):
    ours, theirs = peers.OURS_SPRINGS, "MuJoCo flex, Euler"
    monkeypatch.setattr(peers, "OURS", {ours: peers.OURS[ours]})
    chosen = {theirs: peers.PEERS[theirs], "MuJoCo flex, made up": peers.PEERS[theirs]._replace(
        case="none:damped")}  # fmt: skip
    monkeypatch.setattr(peers, "PEERS", chosen)
    found = peers.measure(2, sizes=(576,))
    of = {(figure.case, figure.quantity): figure for figure in found.figures}
    ratio = of[theirs, f"times as long as {ours}"]
    assert ratio.n == 2 and ratio.lowest <= ratio.median <= ratio.highest
    assert ratio.median == pytest.approx(
        of[theirs, "time"].median / of[ours, "time"].median, rel=0.5
    )
    (skipped,) = found.skipped
    assert skipped.case == "MuJoCo flex, made up" and "none" in skipped.reason
    found.show(Console(width=200))
    out = capsys.readouterr().out
    assert "what differs" in out and "not measured: MuJoCo flex, made up" in out and "ms" in out
