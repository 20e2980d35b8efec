"""Supports: their forces, prescribed motion, and its work."""

import itertools

import numpy as np
import pytest

from tests.support.materials import SPRINGS
from tissue import (
    BladeSegment,
    BladeSweep,
    Hierarchical,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    fixed_nodes,
)

SIZE = (0.04, 0.02, 0.02)
MESH = block((6, 3, 3), SIZE)
NO_GRAVITY = (0.0, 0.0, 0.0)
DT = 1e-3


def held(sides="left,right", *, gravity=NO_GRAVITY, material=None, **solver):
    material = material or Material(young_modulus=20e3, law="neo_hookean", viscous_damping=5.0)
    settings = SolverSettings(audit=True, **solver)
    fixed = fixed_nodes(MESH, sides)
    return Tissue(MESH, material, fixed=fixed, gravity=gravity, solver=settings)


def test_supports_bear_the_weight():
    tissue = held("left", gravity=(0.0, 0.0, -9.81))
    tissue.settle()
    weight = 9.81 * tissue.snapshot().masses.sum()
    np.testing.assert_allclose(
        tissue.support_forces().sum(axis=0), [0.0, 0.0, weight], atol=2e-3 * weight
    )


def test_support_forces_and_weight_change_the_momentum_of_a_swinging_body():
    tissue = held("left", gravity=(0.0, 0.0, -9.81))
    weight = np.array([0.0, 0.0, -9.81]) * tissue.snapshot().masses.sum()
    dt, momenta, forces = 1e-4, [], []
    for _ in range(60):
        tissue.step(None, dt)
        body = tissue.snapshot()
        momenta.append((body.masses[:, None] * body.velocities).sum(axis=0))
        drag = 5.0 * momenta[-1]
        forces.append(tissue.support_forces().sum(axis=0) + weight - drag)
    rate = np.gradient(momenta, dt, axis=0)[1:-1]
    np.testing.assert_allclose(rate, np.array(forces)[1:-1], atol=2e-3 * np.abs(rate).max())


def test_supports_move_as_far_as_their_velocity_says():
    tissue = held()
    right = fixed_nodes(MESH, "right")
    tissue.move_supports("right", (0.05, 0.0, 0.02))
    for _ in range(10):
        tissue.step(None, DT)
    tissue.move_supports(np.flatnonzero(right), (0.0, 0.0, 0.0))
    for _ in range(5):
        tissue.step(None, DT)
    moved = tissue.snapshot().positions - MESH.positions
    np.testing.assert_allclose(moved[right], np.tile([5e-4, 0.0, 2e-4], (right.sum(), 1)))
    np.testing.assert_array_equal(moved[fixed_nodes(MESH, "left")], 0.0)


def test_a_bar_that_is_pulled_slowly_resists_with_stiffness_times_strain():
    material = Material(
        young_modulus=20e3, poisson_ratio=0.0, law="neo_hookean", viscous_damping=100.0
    )
    tissue = held(material=material)
    tissue.move_supports("right", (0.008, 0.0, 0.0))
    for _ in range(50):  # 1 % in all
        tissue.step(None, DT)
    tissue.move_supports("right", (0.0, 0.0, 0.0))
    tissue.settle()
    force = 0.01 * 20e3 * SIZE[1] * SIZE[2]
    forces = tissue.support_forces()
    at_right = forces[fixed_nodes(MESH, "right")].sum(axis=0)
    assert at_right[0] == pytest.approx(force, rel=0.02)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=2e-3 * force)


@pytest.mark.parametrize(
    "solver",
    [{"relaxation": "global"}, {"relaxation": "verlet"}],
    ids=lambda solver: solver["relaxation"],
)
@pytest.mark.parametrize("law", ["neo_hookean", "springs"])
def test_the_work_of_supports_is_found_again_in_the_account(law, solver):
    ratio = 0.25 if law == "springs" else 0.45
    material = Material(
        young_modulus=20e3,
        poisson_ratio=ratio,
        law=law,
        viscous_damping=5.0,
        retardation_time=1e-3,
    )
    tissue = held(material=material, gravity=(0.0, 0.0, -9.81), **solver)
    for i in range(60):
        speed = 0.1 * np.sin(np.pi * i / 30)
        tissue.move_supports("right", (speed, 0.0, 0.5 * speed))
        energies = tissue.step(None, DT).energies
        if i == 29:
            pulled = energies
    assert pulled.work_of_supports > 1e-4 and pulled.damping > 0.01 * pulled.work_of_supports
    for found in (pulled, energies):
        assert abs(found.residual) < 5e-3 * pulled.work_of_supports


def test_lifting_a_body_takes_its_weight_times_the_height():
    tissue = held("left,right,bottom,top", gravity=(0.0, 0.0, -9.81))
    tissue.settle()
    tissue.move_supports("left,right,bottom,top", (0.0, 0.0, 0.02))
    for _ in range(500):
        energies = tissue.step(None, DT).energies
    lifted = 9.81 * tissue.snapshot().masses.sum() * 0.01
    assert energies.work_of_supports == pytest.approx(lifted, rel=0.01)
    assert energies.potential == pytest.approx(lifted, rel=0.01)


def test_supports_stop_when_the_body_settles():
    tissue = held()
    tissue.move_supports("right", (0.05, 0.0, 0.0))
    tissue.step(None, DT)
    tissue.settle()
    before = tissue.snapshot().positions
    assert tissue.step(None, DT).energies.work_of_supports == 0.0
    right = fixed_nodes(MESH, "right")
    np.testing.assert_array_equal(tissue.snapshot().positions[right], before[right])


def test_nodes_that_a_blade_puts_into_a_moving_support_move_with_it():
    tissue = held("front,back")
    tissue.move_supports("front,back", (0.0, 0.0, 0.01))
    n = tissue.n_nodes
    forward = np.array([0.0, 1.0, 0.0])
    tips = [np.array([0.0153, -0.003 + 0.0002 * i, -0.005]) for i in range(140)]
    up = np.array([0.0, 0.0, 0.04])
    poses = [BladeSegment(tip, tip + up, forward) for tip in tips]
    for t0, t1 in itertools.pairwise(poses):
        tissue.step(BladeSweep(t0, t1), DT)
    body = tissue.snapshot()
    new = np.flatnonzero(body.fixed[n:]) + n
    assert new.size > 4
    np.testing.assert_allclose(body.velocities[new], np.tile([0.0, 0.0, 0.01], (new.size, 1)))
    old = np.flatnonzero(body.fixed[:n])
    np.testing.assert_allclose(
        body.positions[old, 2] - body.rest_positions[old, 2], 139 * DT * 0.01, atol=1e-9
    )


@pytest.mark.parametrize(
    ("where", "velocity", "expected"),
    [
        ("right", (0.0, 0.0, 1.0), "no node of the region 'right' is fixed"),
        ("lfet", (0.0, 0.0, 1.0), "Did you mean 'left'"),
        (40, (0.0, 0.0, 1.0), "node 40 is not fixed"),
        (-1, (0.0, 0.0, 1.0), "no node -1"),
        (np.zeros(3, dtype=bool), (0.0, 0.0, 1.0), "mask of a region has shape"),
        ("left", (0.0, 1.0), "three finite numbers in m/s"),
        ("left", (0.0, np.nan, 1.0), "three finite numbers in m/s"),
    ],
)
def test_a_motion_that_makes_no_sense_is_refused(where, velocity, expected):
    tissue = held("left")
    with pytest.raises(ValueError, match=expected):
        tissue.move_supports(where, velocity)


def test_the_hierarchical_relaxation_refuses_to_move_supports():
    solver = SolverSettings(relaxation=Hierarchical())
    tissue = Tissue(MESH, SPRINGS, fixed=fixed_nodes(MESH, "left"), solver=solver)
    with pytest.raises(ValueError, match="'global' or 'verlet'"):
        tissue.move_supports("left", (0.0, 0.0, 0.01))


def test_supports_bear_what_keeps_a_flat_tetrahedron_from_turning_over():
    """The supports give the free node all of the momentum that it gains."""
    corners = 0.01 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.8]])
    tissue = Tissue(
        TetrahedralMesh(corners, np.array([[0, 1, 2, 3]])),
        Material(law="springs", poisson_ratio=0.25, viscous_damping=0.0, retardation_time=0.0),
        fixed=np.array([True, True, True, False]),
        positions=corners * [1.0, 1.0, 0.2],
        gravity=(0.0, 0.0, 0.0),
    )
    tissue.step(None, 1e-6)
    begin, held = tissue.snapshot().velocities[3], tissue.support_forces().sum(axis=0)
    tissue.step(None, 1e-6)
    gained = (tissue.snapshot().velocities[3] - begin) / 1e-6
    mass = tissue._body.masses[3]
    np.testing.assert_allclose(held, mass * gained, rtol=1e-3)
