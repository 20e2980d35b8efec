"""Other engines and ours: the same body for each, and a reason for each that did not run."""

import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from benchmarks.engine import FRAME_DT, held_nodes, jittered_block
from benchmarks.peers import benchmark as peer_benchmark
from benchmarks.peers import motion
from benchmarks.peers.benchmark import (
    MOST_OFF,
    OURS,
    OURS_SPRINGS,
    PEERS,
    PeerRun,
    best_of,
    peers,
)
from benchmarks.peers.motion import converged_sag, error_of
from benchmarks.peers.process import (
    NotInstalledError,
    PeerError,
    PeerProcess,
    PeerTurn,
    body_file,
)
from benchmarks.peers.serving import SWING_INSTANTS, read_body

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
    ("adapter", "case", "law", "most"),
    [
        ("ours", "springs:runge_kutta:undamped", "springs", 1e-3),
        ("ours", "neo_hookean:verlet:undamped:plain", "neo_hookean", 0.02),
        ("mujoco_flex", "Euler:undamped", "st_venant_kirchhoff", 0.05),
    ],
)
def test_an_engine_in_its_own_process_swings_as_the_converged_motion(
    adapter, case, law, most, body
):
    process = PeerProcess(adapter, case, FRAME_DT, body, PYTHON, 0)
    try:
        turn = process.turn(0.02)
    finally:
        process.close()
    assert len(turn.seconds) >= 3 and (turn.seconds > 0.0).all()
    assert 1e-6 < turn.moved < 0.01  # metres: it sags, and did not explode
    assert len(process.sag) == SWING_INSTANTS
    assert error_of(process.sag, converged_sag(read_body(str(body)), law)) < most


@pytest.mark.parametrize("law", ["springs", "neo_hookean", "st_venant_kirchhoff", "corotational"])
def test_the_converged_motion_is_that_of_half_the_step(law, body, monkeypatch):
    block = read_body(str(body))
    sag = converged_sag(block, law)
    monkeypatch.setattr(motion, "_FINE_DT", 0.5 * motion._FINE_DT)
    assert error_of(sag, converged_sag(block, law)) < 1e-3


def test_all_laws_of_tetrahedra_sag_alike_where_strains_are_small(body):
    light = read_body(str(body))._replace(gravity=1e-3)
    linear = converged_sag(light, "corotational")
    for law in ("neo_hookean", "st_venant_kirchhoff"):
        assert error_of(converged_sag(light, law), linear) < 1e-4


def test_the_best_case_is_the_fastest_one_that_swings_as_it_should():
    def run(name, milliseconds, off, case="MuJoCo flex, Euler"):
        turn = PeerTurn(np.array([1e-3 * milliseconds]), 0.0)
        return PeerRun(name, PEERS[case], "1", 576, off, [turn])

    slow, fast = run("slow", 3.0, 0.0), run("fast", 2.0, MOST_OFF)
    wrong, springs = run("wrong", 1.0, 1.1 * MOST_OFF), run("springs", 9.0, 0.0, "Newton springs")
    long_step = run("long step", 3.0, 0.0, "MuJoCo flex, Euler, undamped, 2 ms")
    assert best_of([slow, fast, wrong, springs]) == [fast, springs]
    assert best_of([slow, fast, long_step, wrong]) == [long_step]  # 1.5 ms for each millisecond


def test_a_missing_engine_and_one_without_the_case_raise_different_errors(body, tmp_path):
    bare = tmp_path / "python"
    bare.write_text('#!/bin/sh\necho "ModuleNotFoundError: No module named newton" >&2\nexit 1\n')
    bare.chmod(0o755)
    with pytest.raises(NotInstalledError, match="newton"):
        PeerProcess("newton_particles", "semi_implicit:springs:damped", FRAME_DT, body, bare, 0)
    with pytest.raises(PeerError, match="implicit"):
        PeerProcess("mujoco_flex", "implicit:damped", FRAME_DT, body, PYTHON, 0)


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
    assert "each at its best" in out


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
