"""Rigid cores: sets of tetrahedra that move as one rigid body inside the tissue."""

import os

import numpy as np
import pytest

from tissue import Material, SolverSettings, Tissue, TissueState, block, fixed_nodes
from tissue.elasticity.stiffness_matrix import stiffness_matrix

SIZE = 0.03
MESH = block((5, 5, 5), (SIZE, SIZE, SIZE))
MIDDLE = np.full(3, 0.5 * SIZE)
INSIDE = (np.abs(MESH.positions - MIDDLE) < 0.2 * SIZE).all(axis=1)
"""The nodes of the cell in the middle."""
CORNER = (MESH.positions < 0.3 * SIZE).all(axis=1)
"""Those of the cell at a corner, on the skin."""
GEL = Material(young_modulus=3e3, law="neo_hookean", viscous_damping=0.0, retardation_time=0.0)
DAMPED = Material(young_modulus=3e3, law="neo_hookean", viscous_damping=10.0)
STONE = 3000.0
WEIGHTLESS = (0.0, 0.0, 0.0)
SPIN = np.array([6.0, -4.0, 8.0])
needs_two_cores = pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core")


def with_core(
    material=GEL, *, spins=False, where=INSIDE, gravity=WEIGHTLESS, held="none", **solver
):
    """Return a block with a stone inside; it turns about its middle where it `spins`."""
    settings = SolverSettings(audit=True, **solver)
    fixed = fixed_nodes(MESH, held)
    tissue = Tissue(MESH, material, fixed=fixed, gravity=gravity, solver=settings)
    if spins:
        velocities = tissue._body.velocities[: tissue.n_nodes]
        velocities[:] = np.cross(SPIN, MESH.positions - MIDDLE)
    tissue.make_rigid(where, density=STONE)
    return tissue


def distances(tissue):
    """Return the distances of all nodes of the core from each other [m]."""
    at = tissue.snapshot().positions[INSIDE]
    return np.linalg.norm(at[:, None] - at[None], axis=2)


def momenta(tissue):
    """Return the momentum, and the angular momentum about the centre of mass."""
    body = tissue.snapshot()
    masses = body.masses[:, None]
    centre = (masses * body.positions).sum(axis=0) / masses.sum()
    each = masses * body.velocities
    return each.sum(axis=0), np.cross(body.positions - centre, each).sum(axis=0)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_core_keeps_its_shape_in_a_body_that_spins_and_swings(relaxation):
    tissue = with_core(spins=True, relaxation=relaxation)
    load = tissue.push(np.array([0]), (0.01, 0.02, 0.0))
    before = distances(tissue)
    for i in range(1000):
        if i == 50:
            tissue.release(load)
        tissue.step(None, 1e-3)
    np.testing.assert_allclose(distances(tissue), before, rtol=1e-12, atol=1e-12 * SIZE)
    (core,) = tissue.cores
    at = core.centre + (MESH.positions[INSIDE] - MIDDLE) @ core.rotation.T
    np.testing.assert_allclose(tissue.snapshot().positions[INSIDE], at, atol=1e-12 * SIZE)


def test_a_push_beside_the_middle_in_free_fall_gives_its_impulse_and_no_more():
    """Position Verlet conserves both momenta to rounding, so that nothing hides in its order."""
    fall, force = np.array([0.0, 0.0, -9.81]), np.array([0.01, 0.02, 0.0])
    tissue = with_core(spins=True, gravity=fall, relaxation="verlet")
    mass = tissue.snapshot().masses.sum()
    load = tissue.push(np.array([0]), force)
    for _ in range(50):
        tissue.step(None, 1e-3)
    tissue.release(load)
    _, turning = momenta(tissue)
    for _ in range(200):
        tissue.step(None, 1e-3)
    linear, angular = momenta(tissue)
    np.testing.assert_allclose(linear, 0.25 * mass * fall + 0.05 * force, rtol=1e-11, atol=1e-14)
    np.testing.assert_allclose(angular, turning, rtol=1e-11)


def test_a_core_that_spins_freely_turns_by_euler_s_equations():
    """A body that is one core, longer than wide: both integrators conserve what a top does."""
    mesh = block((3, 2, 1), (0.03, 0.02, 0.005))
    spin = np.array([20.0, 1.0, 5.0])
    ends = []
    for relaxation in ("global", "verlet"):
        settings = SolverSettings(audit=True, relaxation=relaxation)
        tissue = Tissue(mesh, GEL, gravity=WEIGHTLESS, solver=settings)
        centre = _centre(tissue)
        velocities = np.cross(spin, mesh.positions - centre)
        tissue._body.velocities[: tissue.n_nodes] = velocities
        # Of all nodes: a user's core has tissue around it, which would brake the spin.
        tissue._model.cores.add_tetrahedra(tissue._body, np.arange(len(mesh.tetrahedra)), 0.0)
        energy, (_, before) = _kinetic(tissue), momenta(tissue)
        for _ in range(300):
            tissue.step(None, 1e-3)
        _, after = momenta(tissue)
        # 4th order: (20 /s x 1 ms)^5 a step, 300 steps; position Verlet to rounding.
        loss = 2e-6 if relaxation == "global" else 1e-12
        np.testing.assert_allclose(after, before, atol=loss * np.abs(before).max())
        assert _kinetic(tissue) == pytest.approx(energy, rel=1e-5)
        np.testing.assert_allclose(tissue.cores[0].centre, centre, atol=1e-14)
        ends.append(tissue.cores[0].rotation)
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-4)  # Verlet is of second order


def _centre(tissue):
    body = tissue.snapshot()
    return (body.masses[:, None] * body.positions).sum(axis=0) / body.masses.sum()


def _kinetic(tissue):
    body = tissue.snapshot()
    return 0.5 * float((body.masses[:, None] * body.velocities**2).sum())


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_the_account_of_energy_closes(relaxation):
    tissue = with_core(DAMPED, gravity=(0.0, 0.0, -9.81), held="top", relaxation=relaxation)
    for _ in range(300):
        result = tissue.step(None, 1e-3)
    energies = result.energies
    assert energies.elastic > 1e-5
    # Position Verlet is of second order, and without a core as far off.
    assert abs(energies.residual) < (3e-3 if relaxation == "verlet" else 1e-4) * energies.elastic


def test_supports_bear_the_weight_of_the_stone():
    tissue = with_core(DAMPED, gravity=(0.0, 0.0, -9.81), held="top")
    tissue.settle()
    volume = (0.2 * SIZE) ** 3
    weight = 9.81 * (DAMPED.density * (SIZE**3 - volume) + STONE * volume)
    held = tissue.support_forces().sum(axis=0)
    np.testing.assert_allclose(held, [0.0, 0.0, weight], atol=1e-3 * weight)


def test_a_stone_hangs_where_ever_stiffer_tetrahedra_would():
    """A twin: the matrix of the body at small strain, with far stiffer tetrahedra in the core."""
    stiff = Material(young_modulus=1e5, poisson_ratio=0.3, law="neo_hookean", viscous_damping=10.0)
    tissue = with_core(stiff, gravity=(0.0, 0.0, -9.81), held="top")
    tissue.settle()
    sag = (tissue.snapshot().positions - MESH.positions)[INSIDE]
    errors = []
    for factor in (1.0, 10.0, 1000.0):
        moved = linear_sag(tissue, stiff, factor)[INSIDE]
        errors.append(float(np.linalg.norm(sag - moved) / np.linalg.norm(moved)))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 5e-3  # strains of some thousandths are not infinitely small


def linear_sag(tissue, material, factor):
    """Return the displacements by which the body sags [m], with a core stiffer by that factor."""
    body, n = tissue.snapshot(), len(MESH.positions)
    stiffness = stiffness_matrix(MESH, material, element="averaged").toarray()
    stiffness = stiffness.reshape(n, 3, n, 3)
    for corners in body.tetrahedra[INSIDE[body.tetrahedra].all(axis=1)]:
        matrix = np.c_[np.ones(4), MESH.positions[corners]]
        slopes, volume = np.linalg.inv(matrix)[1:], abs(np.linalg.det(matrix)) / 6.0
        shared = np.einsum("ia,ib->ab", slopes, slopes)
        shear = np.einsum("ab,ij->aibj", shared, np.eye(3))
        shear += np.einsum("ja,ib->aibj", slopes, slopes)
        more = material.mu * shear + material.lam * np.einsum("ia,jb->aibj", slopes, slopes)
        stiffness[np.ix_(corners, range(3), corners, range(3))] += factor * volume * more
    weight = np.zeros((n, 3))
    weight[:, 2] = -9.81 * body.masses
    free = np.repeat(~body.fixed, 3)
    moved = np.zeros(3 * n)
    matrix = stiffness.reshape(3 * n, 3 * n)[np.ix_(free, free)]
    moved[free] = np.linalg.solve(matrix, weight.ravel()[free])
    return moved.reshape(n, 3)


@needs_two_cores
@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_threads_and_a_loaded_state_give_the_same_bits(relaxation):
    ends = []
    for threads in (1, 2):
        tissue = with_core(DAMPED, spins=True, relaxation=relaxation, threads=threads)
        for _ in range(30):
            tissue.step(None, 1e-3)
        state = tissue.save_state().to_bytes()
        for _ in range(30):
            tissue.step(None, 1e-3)
        ends.append(tissue.snapshot())
    other = Tissue(MESH, DAMPED, gravity=WEIGHTLESS, solver=tissue.solver)
    other.load_state(TissueState.from_bytes(state))
    assert len(other.cores) == 1
    for _ in range(30):
        other.step(None, 1e-3)
    ends.append(other.snapshot())
    for again in ends[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(ends[0], again, strict=True))


@pytest.mark.parametrize(
    ("arguments", "keys", "why"),
    [
        ({"where": MESH.positions[:, 0] < 0.1 * SIZE}, {}, "no tetrahedron has all its nodes"),
        ({"held": "sphere:0.015,0.015,0.015,0.006"}, {}, "is fixed, and cannot be in a core"),
        ({"where": CORNER}, {}, "is on the skin, and a core is inside the tissue"),
        ({}, {"where": INSIDE}, "is in another core"),
        ({}, {"where": INSIDE, "density": 500.0}, "at least as dense as the tissue, 1000 kg/m3"),
    ],
)
def test_regions_that_make_no_core_are_refused(arguments, keys, why):
    with pytest.raises(ValueError, match=why):
        tissue = with_core(**arguments)
        tissue.make_rigid(**keys)


def test_the_paper_s_relaxation_has_no_cores():
    solver = SolverSettings(relaxation="hierarchical")
    springs = Material(law="springs", poisson_ratio=0.25)
    with pytest.raises(ValueError, match="cores do not move with relaxation='hierarchical'"):
        Tissue(MESH, springs, solver=solver).make_rigid(INSIDE)
