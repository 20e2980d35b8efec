"""Attachments: springs from points of the tissue to a frame that is moved from outside."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tissue import (
    BladeSegment,
    BladeSweep,
    FramePath,
    Material,
    SolverSettings,
    Tissue,
    block,
    fixed_nodes,
)

DT = 1e-3
GEL = Material(
    law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, toughness=5.0, viscous_damping=40.0
)
CUBE = block((4, 4, 4), (0.04, 0.04, 0.04))
TOP = "0,0,0.0399:0.04,0.04,0.0401"
NOTHING = (0.0, 0.0, 0.0)


def cube(fixed="bottom", *, gravity=NOTHING, **solver):
    held = fixed_nodes(CUBE, fixed)
    return Tissue(CUBE, GEL, fixed=held, gravity=gravity, solver=SolverSettings(**solver))


def settled(tissue, seconds=0.6):
    for _ in range(round(seconds / DT)):
        result = tissue.step(None, DT)
    return result


def by(x, y, z):
    return np.array([x, y, z])


def turn_about(axis, angle):
    return Rotation.from_rotvec(angle * np.array(axis, dtype=float)).as_matrix()


def weight_of(tissue):
    return 9.81 * float(tissue.snapshot().masses.sum())


# Forces


def test_an_attachment_that_nothing_pulls_does_nothing():
    tissue = cube()
    grip = tissue.attach(TOP, stiffness=100.0, damping=1.0)
    before = tissue.snapshot().positions
    settled(tissue, 0.05)
    np.testing.assert_array_equal(tissue.snapshot().positions, before)
    np.testing.assert_array_equal(grip.wrench.force, 0.0)
    assert grip.n_points == 25


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_body_hangs_from_its_attachment_with_its_weight(relaxation):
    tissue = cube("none", gravity=(0, 0, -9.81), relaxation=relaxation)
    grip = tissue.attach(TOP, stiffness=200.0, damping=4.0)
    settled(tissue, 1.5)
    np.testing.assert_allclose(grip.wrench.force, [0, 0, -weight_of(tissue)], atol=1e-3)


def test_a_spring_in_series_stretches_by_its_share():
    """Tissue of stiffness c and a spring k: moved by u, the force is u k c / (k + c)."""
    forces = []
    for stiffness in (50.0, 1e5):
        tissue = cube()
        grip = tissue.attach(TOP, stiffness=stiffness, damping=1.0)
        grip.move(grip.wrench.point + by(0, 0, 5e-4))
        settled(tissue, 1.0)
        forces.append(-grip.wrench.force[2])
    of_tissue = forces[1] / 5e-4  # the second spring is rigid beside it
    assert forces[0] == pytest.approx(5e-4 / (1 / 50.0 + 1 / of_tissue), rel=0.02)


def test_linear_and_angular_momentum_change_by_the_impulse_of_the_wrench():
    tissue = cube("none")
    grip = tissue.attach("0,0,0:0.011,0.011,0.011", stiffness=300.0, damping=3.0, origin=NOTHING)
    grip.move([2e-3, 1e-3, 0.0], turn_about([0, 1, 0], 0.05))
    push, turn = np.zeros(3), np.zeros(3)
    for _ in range(20):
        tissue.step(None, DT)
        wrench = grip.wrench
        push -= DT * wrench.force
        turn -= DT * (wrench.torque + np.cross(wrench.point, wrench.force))
    body = tissue.snapshot()
    momenta = body.masses[:, None] * body.velocities
    np.testing.assert_allclose(momenta.sum(axis=0), push, rtol=1e-9, atol=1e-12)
    angular = np.cross(body.positions, momenta).sum(axis=0)
    np.testing.assert_allclose(angular, turn, rtol=1e-4, atol=1e-4 * np.abs(turn).max())


def test_the_account_of_energy_closes_with_a_frame_that_moves():
    tissue = cube(audit=True)
    grip = tissue.attach(TOP, stiffness=500.0, damping=5.0)
    for i in range(300):
        grip.move(grip.wrench.point + by(4e-5 * np.cos(i / 20), 0, 2e-5))
        result = tissue.step(None, DT)
    energies = result.energies
    assert energies.work_of_loads > 1e-4
    assert abs(energies.residual) < 5e-3 * energies.work_of_loads


def test_dampers_bring_a_body_to_the_speed_of_its_frame_at_their_own_rate():
    """v = u (1 - exp(-d t / m)) where they act on all of a body that nothing else holds."""
    tissue, speed, seconds = cube("none"), 0.01, 0.2
    body = tissue.snapshot()
    mass = float(body.masses.sum())
    damping = 1.5 * mass / seconds
    grip = tissue.attach(np.full(len(body.masses), True), stiffness=1e-6, damping=damping)
    for _ in range(round(seconds / DT)):
        grip.move(grip.wrench.point + by(0, 0, speed * DT))
        tissue.step(None, DT)
    after = tissue.snapshot()
    mean = float(after.masses @ after.velocities[:, 2]) / mass
    assert mean == pytest.approx(speed * (1.0 - np.exp(-1.5)), rel=0.02)


def test_strong_dampers_take_no_more_steps_and_stay_stable():
    steps = []
    for damping in (0.0, 1e3):
        tissue = cube()
        grip = tissue.attach(TOP, stiffness=100.0, damping=damping)
        grip.move(grip.wrench.point + by(1e-4, 0, 1e-4))
        steps.append(tissue.step(None, 0.02).n_substeps)
        settled(tissue, 0.1)
        assert np.abs(tissue.snapshot().velocities).max() < 1e-2
    assert steps[0] == steps[1]


def test_very_stiff_attachments_take_more_steps_and_stay_stable():
    soft, stiff = cube(), cube()
    soft.attach(TOP, stiffness=100.0)
    grip = stiff.attach(TOP, stiffness=1e6, damping=10.0)
    grip.move(grip.wrench.point + by(1e-3, 0, 1e-3))
    n_soft = settled(soft, 0.01).n_substeps
    assert settled(stiff, 0.3).n_substeps > 2 * n_soft
    assert np.abs(stiff.snapshot().velocities).max() < 1e-2


# Ligaments, breaking, letting go


def test_a_ligament_is_slack_up_to_its_rest_length_and_only_pulls():
    tissue = cube()
    ligament = tissue.attach([[0.02, 0.02, 0.04]], stiffness=100.0, rest_length=5e-3)
    start = ligament.wrench.point
    ligament.move(start + by(0, 0, 4.9e-3))
    settled(tissue, 0.05)
    np.testing.assert_array_equal(ligament.wrench.force, 0.0)
    ligament.move(start + by(0, 0, 8e-3))
    settled(tissue, 0.5)
    at = tissue.positions_of(ligament.points)[0]
    length = np.linalg.norm(start + by(0, 0, 8e-3) - at)
    assert -ligament.wrench.force[2] == pytest.approx(100.0 * (length - 5e-3), rel=1e-3)


def test_an_attachment_lets_go_at_its_force():
    tissue = cube()
    grip = tissue.attach(TOP, stiffness=500.0, damping=5.0, breaks_at=0.5)
    for _ in range(200):
        grip.move(grip.wrench.point + by(0, 0, 2e-5))
        tissue.step(None, DT)
        if grip.is_released:
            break
    assert grip.is_released and grip.n_points == 0
    assert np.linalg.norm(grip.wrench.force) == pytest.approx(0.5, rel=0.1)
    settled(tissue)
    np.testing.assert_allclose(tissue.support_forces().sum(axis=0), 0.0, atol=1e-3)
    with pytest.raises(ValueError, match="released before"):
        tissue.release(grip)


def test_the_account_counts_the_spring_of_an_attachment_that_lets_go_as_released():
    tissue = cube(audit=True)
    grip = tissue.attach(TOP, stiffness=500.0, damping=0.1, breaks_at=0.5)
    grip.follow(FramePath([1.0], [[0.0, 0.0, 0.02]]))
    while not grip.is_released:
        tissue.step(None, DT)
    energies = settled(tissue).energies
    # F^2 / 2k, and a little more: the springs are not stretched alike.
    assert 1.0 < energies.released / (0.5 * 0.5**2 / 500.0) < 1.1
    assert energies.held == 0.0
    assert abs(energies.residual) < 5e-3 * energies.work_of_loads


def test_what_was_released_does_no_more_work_and_feels_nothing():
    tissue = cube(audit=True)
    grip = tissue.attach(TOP, stiffness=500.0, damping=5.0)
    grip.move(grip.wrench.point + by(0, 0, 2e-3))
    at_last = settled(tissue, 0.05).energies.work_of_loads
    assert at_last > 0.0
    tissue.release(grip)
    assert settled(tissue, 0.05).energies.work_of_loads == at_last
    np.testing.assert_array_equal(grip.wrench.force, 0.0)


# Cuts


def test_each_side_of_a_cut_through_a_grip_keeps_its_points():
    tissue = cube("none", gravity=(0, 0, -9.81))
    grip = tissue.attach(TOP, stiffness=400.0, damping=8.0)
    settled(tissue, 0.5)
    ends = [
        BladeSegment(
            np.array([0.02, y, -0.03]), np.array([0.02, y, 0.07]), np.array([0.0, 1.0, 0.0])
        )
        for y in (-0.01, 0.06)
    ]
    n = 800
    for i in range(n):
        a, b = (
            BladeSegment(*((1 - t) * p + t * q for p, q in zip(*ends, strict=True)))
            for t in (i / n, (i + 1) / n)
        )
        tissue.step(BladeSweep(a, b), DT)
    settled(tissue, 1.5)
    pieces = tissue.pieces()
    assert len(pieces) == 2 and grip.n_points == 25
    np.testing.assert_allclose(grip.wrench.force[2], -weight_of(tissue), rtol=0.01)
    sides = tissue.positions_of(grip.points)[:, 0]
    assert (sides < 0.02).any() and (sides > 0.02).any()
    assert max(np.linalg.norm(piece.velocity) for piece in pieces) < 1e-2


# What is refused


@pytest.mark.parametrize(
    ("where", "numbers", "expected"),
    [
        (TOP, {"stiffness": 0.0}, "stiffness is 0.0 N/m; it must be positive"),
        (TOP, {"stiffness": np.inf}, "must be positive and at most"),
        (TOP, {"stiffness": 1.01e9}, r"stiffness is .*at most 1e\+09"),
        (TOP, {"damping": -1.0}, "damping is -1.0"),
        (TOP, {"damping": 1e30}, r"damping is 1e\+30"),
        (TOP, {"rest_length": 1e4}, r"rest_length is .*at most 1000"),
        (TOP, {"origin": [0.0, 2e3, 0.0]}, "of at most 1000"),
        (TOP, {"rest_length": np.nan}, "rest_length is nan"),
        (TOP, {"breaks_at": 0.0}, "breaks_at is 0.0 N"),
        (TOP, {"origin": [0.0, np.nan, 0.0]}, "three finite numbers"),
        ("1,1,1:2,2,2", {}, "no node"),
        ([[0.02, 0.02, 0.1]], {}, "outside the body"),
    ],
)
def test_what_makes_no_sense_is_refused(where, numbers, expected):
    with pytest.raises(ValueError, match=expected):
        cube().attach(where, **({"stiffness": 100.0} | numbers))


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        (2.0 * np.eye(3), "not orthonormal"),
        (-np.eye(3), "a reflection"),
        (np.full((3, 3), np.nan), "not finite"),
        (np.full((3, 3), 1e200), "not orthonormal"),
        (np.eye(2), "three axes as columns"),
    ],
)
def test_axes_that_are_no_rotation_are_refused_and_the_frame_stays(axes, expected):
    grip = cube().attach(TOP, stiffness=100.0)
    before = grip.way
    with pytest.raises(ValueError, match=expected):
        grip.move(NOTHING, axes)
    assert grip.way is not before and all(a is b for a, b in zip(grip.way, before, strict=True))


def test_an_origin_that_is_none_is_refused():
    grip = cube().attach(TOP, stiffness=100.0)
    with pytest.raises(ValueError, match="three finite numbers"):
        grip.move([0.0, 0.0])


def test_the_hierarchical_relaxation_knows_no_attachments():
    springs = Material(law="springs", poisson_ratio=0.25)
    tissue = Tissue(CUBE, springs, solver=SolverSettings(relaxation="hierarchical"))
    with pytest.raises(ValueError, match="not attached with relaxation='hierarchical'"):
        tissue.attach(TOP, stiffness=100.0)


# Frames that are led along a path


def test_a_frame_on_a_path_is_where_one_is_that_is_moved_by_hand():
    """2 mm up in 50 ms, back in 100 ms, then it stays."""
    led, moved = cube(), cube()
    grips = [each.attach(TOP, stiffness=500.0, damping=5.0) for each in (led, moved)]
    start = grips[0].wrench.point
    grips[0].follow(FramePath([0.05, 0.15], [[0, 0, 2e-3], [0, 0, 0]]))
    for i in range(1, 200):
        height = np.interp(1e-3 * i, [0.0, 0.05, 0.15], [0.0, 2e-3, 0.0])
        grips[1].move(start + by(0, 0, height))
        led.step(None, DT)
        moved.step(None, DT)
        np.testing.assert_allclose(grips[0].wrench.force, grips[1].wrench.force, atol=1e-9)
        if i == 50:
            assert grips[0].wrench.force[2] < -0.05


def test_a_path_lets_go_when_it_says_so():
    tissue = cube()
    grip = tissue.attach(TOP, stiffness=500.0, damping=5.0)
    grip.follow(FramePath([0.01], [[0, 0, 1e-3]], release_at=0.02))
    assert settled(tissue, 0.02) and grip.n_points == 25 and tissue.attachments == (grip,)
    assert grip.wrench.force[2] < 0.0
    tissue.step(None, DT)
    assert grip.n_points == 0 and tissue.attachments == ()
    np.testing.assert_array_equal(grip.wrench.force, 0.0)


@pytest.mark.parametrize(
    ("times", "ways", "release_at", "expected"),
    [
        ([0.1], [[0, 0, 0], [0, 0, 1]], 1.0, "1 times for 2 displacements"),
        ([0.2, 0.1], [[0, 0, 0], [0, 0, 1]], 1.0, "begin above 0 and increase"),
        ([0.0], [[0, 0, 0]], 1.0, "begin above 0 and increase"),
        ([0.1], [[0, 0, np.nan]], 1.0, "not finite"),
        ([0.1], [[0, 0, 0]], -1.0, "release_at is -1.0 s"),
    ],
)
def test_a_path_that_makes_no_sense_is_refused(times, ways, release_at, expected):
    with pytest.raises(ValueError, match=expected):
        FramePath(times, ways, release_at=release_at)
