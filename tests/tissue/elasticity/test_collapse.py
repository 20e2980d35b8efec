"""Springs do not tell a tetrahedron from its mirror image; what keeps it from turning over does."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from tests.support.soundness import volumes
from tests.tissue.kernels_of import dense_modes, springs_of
from tissue import FloatArray, Material, SolverSettings, TetrahedralMesh, Tissue, block
from tissue.elasticity.collapse import (
    J_LIMIT,
    J_LISTED,
    Collapsing,
    add_collapse_forces,
    clear_collapse_forces,
    collapse_energy,
    find_collapsing,
    no_collapse,
    renew_collapsing,
)
from tissue.mesh.body import Body, build_body

SPRINGS = Material(law="springs", poisson_ratio=0.25, young_modulus=1e4, density=1e3)
SIZE = 0.01
CORNERS = SIZE * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.8]])
ONE = TetrahedralMesh(CORNERS, np.array([[0, 1, 2, 3]]))
TWO = TetrahedralMesh(
    np.vstack([CORNERS, SIZE * np.array([[0.9, 0.9, 0.7]])]), np.array([[0, 1, 2, 3], [1, 4, 2, 3]])
)

MOVED = 1e3, SIZE, 1.0
"""Speed of the fastest node [m/s], node size [m], and a time [s], in which all may be flat."""


def flat(mesh: TetrahedralMesh, positions: FloatArray, fixed=None) -> tuple[Collapsing, Body]:
    """Return what is flat in a body whose nodes are at `positions` [m]."""
    body = build_body(mesh, positions, fixed)
    springs = springs_of(body, SPRINGS.young_modulus)
    n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
    collapsing = no_collapse(n_nodes, n_tetrahedra, is_needed=True)
    highest = float(springs.frequency_squared[: body.n_nodes].max())
    renew_collapsing(collapsing, body, np.arange(body.n_tetrahedra), body.n_tetrahedra, highest)
    find_collapsing(collapsing, body, springs.frequency_squared, highest, 0.0, SIZE, 1e-3)
    return collapsing, body


def forces(collapsing, body) -> FloatArray:
    found = np.zeros((len(body.rest), 3))
    add_collapse_forces(collapsing, body, body.positions, found)
    return found[: body.n_nodes]


def squeezed(mesh: TetrahedralMesh, j: float) -> FloatArray:
    """Return positions with the heights scaled by `j`."""
    return mesh.positions * [1.0, 1.0, j]


@pytest.mark.kernel
@pytest.mark.parametrize("j", [1.0, 0.6, J_LISTED, 0.31])
def test_above_the_limit_there_is_no_force_and_no_energy(j):
    collapsing, body = flat(TWO, squeezed(TWO, j))
    assert not forces(collapsing, body).any()
    assert collapse_energy(collapsing, body) == 0.0


@pytest.mark.kernel
@pytest.mark.parametrize(("j", "n"), [(0.51, 0), (0.49, 2), (0.2, 2), (-1.0, 2)])
def test_what_is_near_the_limit_or_below_it_is_listed(j, n):
    collapsing, _ = flat(TWO, squeezed(TWO, j))
    assert collapsing.n == n
    assert (collapsing.stiffness > 0.0).sum() == n


@pytest.mark.kernel
def test_the_energy_of_a_tetrahedron_is_that_of_its_volume():
    collapsing, body = flat(ONE, squeezed(ONE, -0.2))
    volume = np.linalg.det(CORNERS[1:] - CORNERS[0]) / 6.0
    stiffness = SPRINGS.young_modulus * volume
    assert collapsing.stiffness[0] == pytest.approx(stiffness)
    expected = 0.5 * stiffness * (J_LIMIT + 0.2) ** 2
    assert collapse_energy(collapsing, body) == pytest.approx(expected)


displaced = st.integers(0, 2**32 - 1).map(
    lambda seed: squeezed(TWO, 0.1) + 0.2 * SIZE * np.random.default_rng(seed).normal(size=(5, 3))
)


@pytest.mark.kernel
@settings(max_examples=30, deadline=None)
@given(displaced)
def test_forces_are_the_slope_of_the_energy_and_balance(positions):
    collapsing, body = flat(TWO, positions)
    found, h = forces(collapsing, body), 1e-7 * SIZE
    scale = max(np.abs(found).max(), 1e-9)
    for node in range(body.n_nodes):
        for axis in range(3):
            energies = []
            for step in (h, -h):
                body.positions[node, axis] = positions[node, axis] + step
                energies.append(collapse_energy(collapsing, body))
            body.positions[node, axis] = positions[node, axis]
            slope = (energies[0] - energies[1]) / (2.0 * h)
            assert found[node, axis] == pytest.approx(-slope, abs=1e-5 * scale)
    assert np.abs(found.sum(axis=0)).max() <= 1e-12 * scale
    torque = np.cross(positions, found).sum(axis=0)
    assert np.abs(torque).max() <= 1e-12 * scale * SIZE * 10.0


@pytest.mark.kernel
@settings(max_examples=30, deadline=None)
@given(displaced, st.sampled_from([None, np.array([True, False, False, False, False])]))
def test_no_mode_is_faster_than_the_bound(positions, fixed):
    """Springs at rest and the second derivatives of the energy together."""
    collapsing, body = flat(TWO, positions, fixed)
    if collapsing.n == 0:
        assert collapsing.highest == 0.0
        return
    n, h = body.n_nodes, 1e-6 * SIZE
    stiffness = np.zeros((3 * n, 3 * n))
    for i in range(3 * n):
        body.positions.reshape(-1)[i] += h
        above = forces(collapsing, body).ravel()
        body.positions.reshape(-1)[i] -= 2.0 * h
        stiffness[i] = (forces(collapsing, body).ravel() - above) / (2.0 * h)
        body.positions.reshape(-1)[i] += h
    free = np.repeat(~body.fixed[:n], 3)
    weights = 1.0 / np.sqrt(np.repeat(body.masses[:n], 3)[free])
    modes = weights[:, None] * stiffness[np.ix_(free, free)] * weights
    springs = dense_modes(body, springs_of(body, SPRINGS.young_modulus))
    fastest = np.linalg.eigvalsh(0.5 * (modes + modes.T) + springs).max()
    listed = np.unique(body.tetrahedra[collapsing.listed[: collapsing.n]])
    if len(listed) == n:
        assert fastest <= collapsing.highest * (1.0 + 1e-4)


@pytest.mark.kernel
def test_forces_are_cleared():
    collapsing, body = flat(TWO, squeezed(TWO, 0.0))
    external = np.zeros((len(body.rest), 3))
    add_collapse_forces(collapsing, body, body.positions, external)
    assert external.any()
    clear_collapse_forces(collapsing, body, external)
    assert not external.any()


@pytest.mark.kernel
def test_a_tetrahedron_keeps_its_stiffness_while_it_is_listed_and_a_new_shape_gets_another():
    collapsing, body = flat(TWO, squeezed(TWO, 0.2))
    before = collapsing.stiffness.copy()
    frequencies = np.ones(len(body.rest))
    find_collapsing(collapsing, body, frequencies, 1e-3, *MOVED)
    assert np.array_equal(collapsing.stiffness, before)
    renew_collapsing(collapsing, body, np.array([1]), 1, 1e-3)
    assert collapsing.stiffness[0] == before[0]
    assert 0.0 < collapsing.stiffness[1] < before[1]
    assert collapsing.n == 2
    body.positions[:] = body.rest
    find_collapsing(collapsing, body, frequencies, 1e-3, *MOVED)
    assert collapsing.n == 0
    assert not collapsing.stiffness.any()


@pytest.mark.kernel
def test_what_is_found_flat_late_gets_no_energy_and_its_limit_goes_back_with_it():
    collapsing, body = flat(ONE, CORNERS)
    frequencies = np.ones(len(body.rest))
    for j in (-0.5, 0.1):
        body.positions[:4] = squeezed(ONE, j)
        find_collapsing(collapsing, body, frequencies, 1e9, *MOVED)
        assert collapsing.n == 1
        assert collapse_energy(collapsing, body) == pytest.approx(0.0, abs=1e-18)
    body.positions[:4] = squeezed(ONE, -0.5)
    expected = 0.5 * collapsing.stiffness[0] * (0.1 + 0.5) ** 2
    assert collapse_energy(collapsing, body) == pytest.approx(expected)


@pytest.mark.kernel
def test_what_moves_fast_towards_the_limit_is_listed_before_it_is_there():
    collapsing, body = flat(ONE, CORNERS)
    body.velocities[3, 2] = -10.0 * 0.8 * SIZE  # J falls by 10 a second
    fastest = 8.0 * SIZE
    for seconds, n in ((0.01, 0), (0.03, 1)):
        find_collapsing(collapsing, body, np.ones(len(body.rest)), 1e9, fastest, SIZE, seconds)
        assert collapsing.n == n


@pytest.mark.kernel
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000))
def test_what_is_to_resist_is_listed_though_not_all_is_looked_at_each_time(seed):
    mesh, random, dt = block((2, 2, 2), (0.02, 0.02, 0.02)), np.random.default_rng(seed), 1e-3
    collapsing, body = flat(mesh, mesh.positions)
    velocities = random.normal(0.0, 1.0, mesh.positions.shape)
    body.velocities[: body.n_nodes] = velocities
    fastest = np.linalg.norm(velocities, axis=1).max()
    for _ in range(8):
        find_collapsing(collapsing, body, np.ones(len(body.rest)), 1e9, fastest, SIZE, dt)
        body.positions[: body.n_nodes] += dt * velocities
        j = volumes(body.positions, mesh.tetrahedra) / volumes(mesh.positions, mesh.tetrahedra)
        assert set(np.flatnonzero(j < J_LIMIT)) <= set(collapsing.listed[: collapsing.n])


def inverted(tissue: Tissue) -> int:
    body = tissue.snapshot()
    return int((volumes(body.positions, body.tetrahedra) < 0.0).sum())


def tissue_of(mesh: TetrahedralMesh, positions: FloatArray, fixed, relaxation: str) -> Tissue:
    """Return a tissue of springs whose nodes are at `positions` [m], without gravity."""
    return Tissue(
        mesh,
        SPRINGS,
        fixed=fixed,
        positions=positions,
        gravity=(0.0, 0.0, 0.0),
        solver=SolverSettings(relaxation=relaxation, audit=True),
    )


@pytest.mark.parametrize(
    ("relaxation", "error"),
    [("global", 0.01), ("verlet", 0.05)],  # of fourth and of second order, at 9 m/s
)
@pytest.mark.parametrize("seed", range(2))
def test_a_block_recovers_from_random_positions_and_its_account_closes(relaxation, error, seed):
    mesh = block((3, 3, 3), (0.03, 0.03, 0.03))
    fixed = mesh.positions[:, 0] <= mesh.positions[:, 0].min() + 1e-9
    moved = mesh.positions.copy()
    moved[~fixed] += np.random.default_rng(seed).normal(0.0, 0.008, moved[~fixed].shape)
    tissue = tissue_of(mesh, moved, fixed, relaxation)
    assert inverted(tissue) > 10
    for _ in range(3000):
        energies = tissue.step(None, 1e-3).energies
    assert inverted(tissue) == 0
    assert abs(energies.residual) <= error * energies.damping


def test_the_paper_s_relaxation_is_as_it_was():
    tissue = Tissue(ONE, SPRINGS, solver=SolverSettings(relaxation="hierarchical"))
    assert tissue._model.elasticity.arrays.collapsing.is_needed == 0
