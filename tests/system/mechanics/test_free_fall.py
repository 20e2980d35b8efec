"""Drag damps what goes on within a loose piece; the piece itself falls and turns freely."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import strokes
from tests.support.materials import SPRINGS
from tissue import Material, SolverSettings, Tissue, block

G = 9.81
DRAG = 20.0
"""Rate of drag [1/s]; with it a piece would fall at 0.5 m/s at most."""
LAWS = {
    "neo-Hookean": Material(viscous_damping=DRAG),
    "springs": replace(SPRINGS, viscous_damping=DRAG),
}
CUBE = block((3, 3, 3), (0.03,) * 3)


def momentum_of(tissue):
    """Return linear and angular momentum about the centre of mass, and energy of motion."""
    body = tissue.snapshot()
    m, x, v = body.masses[:, None], body.positions, body.velocities
    centre, mean = (m * x).sum(axis=0) / m.sum(), (m * v).sum(axis=0) / m.sum()
    spin = np.cross(x - centre, m * v).sum(axis=0)
    return mean * m.sum(), spin, 0.5 * float((m * (v - mean) ** 2).sum())


def loose_piece(tissue):
    return next(piece for piece in tissue.pieces() if not piece.is_held)


def set_velocities(tissue, velocity):
    """Give each node the velocity that a function returns for its place about the centre."""
    body, n = tissue._body, tissue.n_nodes
    body.velocities[:n] = velocity(body.positions[:n] - body.positions[:n].mean(axis=0))


@pytest.mark.kernel
def test_a_body_falls_along_gravity_whatever_its_direction():
    gravity = np.array([1.0, 2.0, -3.0])
    tissue = Tissue(block((1, 1, 1), (0.03,) * 3), gravity=gravity)
    tissue.step(None, 1e-4)
    expected = np.tile(1e-4 * gravity, (tissue.n_nodes, 1))
    np.testing.assert_allclose(tissue.snapshot().velocities, expected, rtol=1e-9)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize("law", LAWS)
def test_a_loose_piece_falls_at_g(law, relaxation):
    solver = SolverSettings(relaxation=relaxation)
    tissue = Tissue(CUBE, LAWS[law], fixed=CUBE.positions[:, 2] == 0.03, solver=solver)
    tissue.incise([[[-0.1, y, 0.016], [0.1, y, 0.016]] for y in (-0.01, 0.04)], (0.0, 1.0, 0.0))
    assert tissue.n_pieces() == 2
    for _ in range(100):
        tissue.step(None, 1e-3)
    before = loose_piece(tissue)
    assert before.velocity[2] == pytest.approx(-G * 0.1, rel=1e-3)  # the lips touch at first
    for _ in range(100):
        tissue.step(None, 1e-3)
    after = loose_piece(tissue)
    np.testing.assert_allclose(after.velocity - before.velocity, [0, 0, -G * 0.1], atol=1e-9)
    way = (after.centre - before.centre)[2]
    assert way == pytest.approx(0.1 * before.velocity[2] - 0.5 * G * 0.1**2, rel=1e-5)


@pytest.mark.parametrize("law", LAWS)
def test_drag_changes_neither_momentum_nor_angular_momentum_of_a_loose_body(law):
    # Verlet keeps angular momentum to rounding, Runge-Kutta to fourth order.
    solver = SolverSettings(relaxation="verlet")
    tissue = Tissue(CUBE, LAWS[law], gravity=(0.0, 0.0, 0.0), solver=solver)
    shake = np.random.default_rng(0).normal(0.0, 0.05, (tissue.n_nodes, 3))
    set_velocities(tissue, lambda r: np.cross([3.0, -2.0, 1.0], r) + shake)
    linear, angular, _ = momentum_of(tissue)
    for _ in range(200):
        tissue.step(None, 1e-3)
    linear_now, angular_now, _ = momentum_of(tissue)
    np.testing.assert_allclose(linear_now, linear, atol=1e-12 * np.linalg.norm(linear))
    np.testing.assert_allclose(angular_now, angular, atol=1e-9 * np.linalg.norm(angular))


@pytest.mark.parametrize("law", LAWS)
def test_drag_damps_how_a_loose_body_swings_in_itself(law):
    """The body is stretched and compressed in turn; energy dies away at the rate of the drag."""
    material = replace(LAWS[law], retardation_time=0.0)
    tissue = Tissue(CUBE, material, gravity=(0.0, 0.0, 0.0), solver=SolverSettings(audit=True))
    set_velocities(tissue, lambda r: 0.5 * r * [1.0, 0.0, 0.0])
    at_first = momentum_of(tissue)[2]
    for _ in range(400):
        energies = tissue.step(None, 2.5e-4).energies
    left = (energies.elastic + energies.kinetic) / at_first
    assert left == pytest.approx(np.exp(-DRAG * 0.1), rel=0.15)  # by phase
    assert abs(energies.residual + at_first) < 1e-3 * at_first  # the account begins at rest


def test_a_piece_that_the_blade_cuts_off_falls_freely_before_the_blade_has_left():
    mesh = block((4, 2, 2), (0.04, 0.02, 0.02))
    material = Material(toughness=0.5, viscous_damping=DRAG)
    tissue = Tissue(mesh, material, fixed=mesh.positions[:, 0] <= 0.02)
    poses = strokes.straight(mesh, 0.75)
    strokes.make(tissue, poses)
    assert tissue.n_pieces() == 2
    for _ in range(100):  # within this time the piece is found
        tissue.step(None, 1e-3)
    before = loose_piece(tissue)
    tissue.step(None, 1e-3)
    after = loose_piece(tissue)
    assert after.velocity[2] - before.velocity[2] == pytest.approx(-G * 1e-3, rel=1e-6)


def test_the_energy_of_a_falling_piece_is_that_of_its_height():
    for material in LAWS.values():
        tissue = Tissue(CUBE, material, solver=SolverSettings(audit=True))
        for _ in range(100):
            energies = tissue.step(None, 1e-3).energies
        assert energies.kinetic == pytest.approx(0.027 * 0.5 * (G * 0.1) ** 2, rel=1e-6)
        assert abs(energies.damping) < 1e-6 * energies.kinetic
        assert abs(energies.residual) < 1e-6 * energies.kinetic
