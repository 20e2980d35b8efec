"""Supports that are led along a field: moved, turned and stretched."""

import numpy as np
import pytest

from tissue import (
    BladeSegment,
    BladeSweep,
    Material,
    SolverSettings,
    SupportPath,
    Tissue,
    TissueState,
    block,
    fixed_nodes,
)

SIZE = (0.03, 0.02, 0.02)
MESH = block((4, 3, 3), SIZE)
GEL = Material(young_modulus=3e3, law="neo_hookean", viscous_damping=10.0)
HELD = fixed_nodes(MESH, "left,right")
RIGHT = fixed_nodes(MESH, "right")
MIDDLE = np.array([0.03, 0.01, 0.01])
NO_GRAVITY = (0.0, 0.0, 0.0)


def held(relaxation="global", **more):
    solver = SolverSettings(audit=True, relaxation=relaxation)
    return Tissue(MESH, GEL, fixed=HELD, gravity=NO_GRAVITY, solver=solver, **more)


def turned(angle, at):
    """Return places turned about the x axis through the middle of the right side."""
    c, s = np.cos(angle), np.sin(angle)
    return MIDDLE + (at - MIDDLE) @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


TWIST = SupportPath([0.05], rotations=[[2.0, 0.0, 0.0]], about=MIDDLE)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_turn_is_exact_at_the_end_of_each_step_however_long(relaxation):
    tissue = held(relaxation)
    tissue.lead_supports("right", TWIST)
    seconds = 0.0
    for dt in (1e-3, 7e-3, 12e-3, 5e-3, 25e-3, 10e-3):
        tissue.step(None, dt)
        seconds += dt
        at = turned(40.0 * min(seconds, 0.05), MESH.positions[RIGHT])
        np.testing.assert_allclose(tissue.snapshot().positions[RIGHT], at, atol=1e-15)


def test_the_work_of_a_twist_is_torque_times_angle_and_the_account_is_whole():
    tissue, work = held(), 0.0
    tissue.lead_supports("right", TWIST)

    def torque():
        forces = tissue.support_forces()[RIGHT]
        arms = tissue.snapshot().positions[RIGHT] - MIDDLE
        return np.cross(arms, forces)[:, 0].sum()

    before = torque()
    for _ in range(50):
        energies = tissue.step(None, 1e-3).energies
        after = torque()
        work, before = work + 0.04 * 0.5 * (before + after), after
    assert energies.work_of_supports > 1e-5
    # Chords of 0.04 rad, and the trapezoidal rule over the swing of the body.
    assert energies.work_of_supports == pytest.approx(work, rel=1e-2)
    assert abs(energies.residual) < 1e-4 * energies.work_of_supports


def test_a_stretch_that_is_undone_gives_its_energy_back():
    slow = SupportPath([1.0, 2.0], stretches=[[1.0, 1.5, 0.8], [1.0, 1.0, 1.0]], about=MIDDLE)
    tissue = held()
    tissue.lead_supports("left,right", slow)
    for _ in range(1000):
        tissue.step(None, 1e-3)
    at = MIDDLE + (MESH.positions - MIDDLE) * [1.0, 1.5, 0.8]
    np.testing.assert_allclose(tissue.snapshot().positions[HELD], at[HELD], atol=1e-14)
    stored = tissue.step(None, 0.0).energies.elastic
    for _ in range(1000):
        result = tissue.step(None, 1e-3)
    np.testing.assert_allclose(tissue.snapshot().positions[HELD], MESH.positions[HELD], atol=1e-14)
    assert result.energies.work_of_supports < 0.05 * stored
    tissue.step(None, 0.1)
    assert not tissue.snapshot().velocities[HELD].any()


def sweep(i):
    y = [-2e-3 + 5e-4 * k for k in (i, i + 1)]
    poses = [np.array([[0.029, at, 0.012], [0.031, at, 0.03], [0.0, 1.0, 0.0]]) for at in y]
    return BladeSweep(*(BladeSegment(*pose) for pose in poses))


def test_nodes_that_a_cut_makes_are_led_with_those_around_them():
    tissue = held()
    tissue.lead_supports("right", SupportPath([0.1], [[0.01, 0.0, 0.0]], [[0.5, 0.0, 0.0]]))
    for i in range(60):
        tissue.step(sweep(i), 1e-3)
    body = tissue.snapshot()
    new = np.flatnonzero(body.fixed[len(HELD) :]) + len(HELD)
    assert len(new) > 3
    angle = 0.3
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    expected = body.rest_positions[new] @ turn + [0.006, 0.0, 0.0]
    np.testing.assert_allclose(body.positions[new], expected, atol=1e-6)


def test_a_state_goes_on_along_the_path_with_the_same_bits():
    one, other = held(), held()
    one.lead_supports("right", TWIST)
    for _ in range(20):
        one.step(None, 1e-3)
    state = one.save_state()
    other.load_state(TissueState.from_bytes(state.to_bytes()))
    results = []
    for tissue in (one, other, one):
        if len(results) == 2:
            one.load_state(state)
        for _ in range(40):
            tissue.step(None, 1e-3)
        results.append(tissue.snapshot())
    for again in results[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(results[0], again, strict=True))
    np.testing.assert_allclose(
        results[0].positions[RIGHT], turned(2.0, MESH.positions[RIGHT]), atol=1e-15
    )


def test_a_velocity_ends_the_path_of_the_nodes_that_it_moves():
    tissue = held()
    tissue.lead_supports("left,right", SupportPath([1.0], [[1.0, 0.0, 0.0]]))
    tissue.move_supports("right", (0.0, 0.0, 0.0))
    tissue.step(None, 1e-3)
    moved = tissue.snapshot().positions - MESH.positions
    np.testing.assert_allclose(moved[HELD & ~RIGHT, 0], 1e-3, rtol=1e-12)
    assert not moved[RIGHT].any()


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (([],), "one or more"),
        (([0.0],), "begin above 0"),
        (([1.0], [[0.0, 0.0]]), r"displacements have shape \(1, 2\)"),
        (([1.0], None, None, [[1.0, 0.0, 1.0]]), "a stretch is not above 0"),
    ],
)
def test_paths_that_lead_nowhere_are_refused(arguments, why):
    with pytest.raises(ValueError, match=why):
        SupportPath(*arguments)


def test_nodes_that_are_free_cannot_be_led():
    with pytest.raises(ValueError, match="no node of the region 'top' is fixed"):
        Tissue(MESH, GEL).lead_supports("top", TWIST)
