"""Bodies whose labels differ in drag: what each node loses, and that pieces fall freely."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block

LEAST, MOST = 5.0, 25.0
NO_GRAVITY = (0.0, 0.0, 0.0)
SOFT = Material(young_modulus=500e3, retardation_time=0.0, viscous_damping=LEAST)
MATERIALS = {0: SOFT, 1: SOFT.changed(viscous_damping=MOST, density=2000.0)}


def halves(axis: int) -> TetrahedralMesh:
    """Return a bar along x whose label is 1 beyond its middle along an axis."""
    size = np.array([0.06, 0.02, 0.02])
    mesh = block((6, 2, 2), size)
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    return mesh._replace(labels=(middles[:, axis] > 0.5 * size[axis]).astype(np.int64))


def decay_of(tissue: Tissue, mesh: TetrahedralMesh) -> float:
    """Return the rate at which a bar that is bent and let go loses its energy [1/s]."""
    tissue._body.velocities[: tissue.n_nodes, 2] = 0.2 * (mesh.positions[:, 0] / 0.06) ** 2
    tissue._body.velocities[: tissue.n_nodes][tissue._body.fixed[: tissue.n_nodes]] = 0.0
    energies = []
    for _ in range(150):
        energies.append(tissue.step(None, strokes.DT).energies)
    first, last = (each.kinetic + each.elastic for each in (energies[0], energies[-1]))
    return float(-np.log(last / first) / (strokes.DT * (len(energies) - 1)))


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_bar_of_two_halves_dies_away_by_the_mean_of_both_by_mass(relaxation):
    """Both halves move alike, side by side, and the bar swings at several times these rates."""
    mesh = halves(1)
    rates = []
    for materials in (
        {0: SOFT, 1: SOFT.changed(viscous_damping=MOST)},
        SOFT.changed(viscous_damping=0.5 * (LEAST + MOST)),
    ):
        solver = SolverSettings(audit=True, relaxation=relaxation)
        fixed = mesh.positions[:, 0] == 0.0
        tissue = Tissue(mesh, materials, fixed=fixed, gravity=NO_GRAVITY, solver=solver)
        rates.append(decay_of(tissue, mesh))
    assert rates[0] == pytest.approx(rates[1], rel=0.01)
    assert rates[0] == pytest.approx(0.5 * (LEAST + MOST), rel=0.1)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_loose_piece_falls_and_turns_freely(relaxation):
    mesh = halves(0)
    solver = SolverSettings(relaxation=relaxation, mass_scaling=None)
    tissue = Tissue(mesh, MATERIALS, solver=solver)
    body, n = tissue._body, tissue.n_nodes
    random, x = np.random.default_rng(0), mesh.positions
    body.velocities[:n] = np.cross([1.0, 2.0, 0.5], x) + random.normal(size=x.shape) * 0.02
    before = momenta(tissue)
    for _ in range(100):
        tissue.step(None, strokes.DT)
    after = momenta(tissue)
    fall = body.masses[:n].sum() * -9.81 * 0.1
    assert after[0] - before[0] == pytest.approx([0.0, 0.0, fall], abs=2e-3 * abs(fall))
    # About a fixed point gravity turns it; about its centre nothing does.
    assert after[1] == pytest.approx(before[1], abs=2e-3 * np.abs(before[1]).max())


def test_nodes_that_move_one_at_a_time_are_dragged_each_by_its_own_label():
    mesh, dt = halves(0), 1e-3
    law = {"law": "springs", "poisson_ratio": 0.25}
    materials = {label: each.changed(**law) for label, each in MATERIALS.items()}
    solver = SolverSettings(relaxation="hierarchical", mass_scaling=None)
    tissue = Tissue(mesh, materials, gravity=NO_GRAVITY, solver=solver)
    tissue._body.velocities[: tissue.n_nodes, 0] = 1.0
    tissue.step(None, dt)
    left, x = tissue.snapshot().velocities[:, 0], mesh.positions[:, 0]
    # Springs between the halves give some of the difference back within the step.
    for half, rate in ((x < 0.02, LEAST), (x > 0.04, MOST)):
        assert left[half].mean() == pytest.approx(1.0 - rate * dt, abs=0.1 * MOST * dt)


def momenta(tissue: Tissue) -> tuple[np.ndarray, np.ndarray]:
    """Return momentum and angular momentum about the centre [N s, N m s]."""
    now = tissue.snapshot()
    p = now.masses @ now.velocities
    centre = now.masses @ now.positions / now.masses.sum()
    arms = now.positions - centre
    return p, (now.masses[:, None] * np.cross(arms, now.velocities)).sum(axis=0)


def test_each_node_has_the_mean_of_its_tetrahedra_by_mass():
    mesh = bodies.jittered(3, 5)
    tissue = Tissue(mesh._replace(labels=np.arange(len(mesh.tetrahedra)) % 2), MATERIALS)
    tissue.incise([[(0.012, y, -0.01), (0.028, y, 0.05)] for y in (-0.01, 0.05)], (0.0, 1.0, 0.0))
    body = tissue.snapshot()
    corners = body.rest_positions[body.tetrahedra]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    is_one = tissue.labels() == 1
    mass = volume * np.where(is_one, 2000.0, 1000.0)
    total, drag = np.zeros(tissue.n_nodes), np.zeros(tissue.n_nodes)
    for k in range(4):
        np.add.at(total, body.tetrahedra[:, k], mass)
        np.add.at(drag, body.tetrahedra[:, k], mass * np.where(is_one, MOST, LEAST))
    found = MOST * tissue._body.drag[: tissue.n_nodes]
    np.testing.assert_allclose(found, drag / total, rtol=1e-12)
