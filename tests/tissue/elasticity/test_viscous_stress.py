"""Viscous forces of tetrahedra: those of the stiffness at rest, and sound at any strain."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import bodies, incisions, naive_solid
from tests.tissue.solids import LAWS, evaluate_viscous, moved, solid_of
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block
from tissue.elasticity.stiffness_matrix import stiffness_matrix
from tissue.laws.energy_density import averaged_shear

MESH = bodies.jittered(2, seed=3)
ROUNDING = {False: 1e-12, True: 2e-5}
"""Largest relative error of forces in doubles, and in singles: of slivers that are pressed flat it
is a hundred times that of a number."""
ELEMENTS = ["plain", "averaged"]
STIFFENING = [{"law": "exponential", "stiffening": 5.0}, {"law": "yeoh", "yeoh_second": 2.0}]


def noise(seed=1, size=len(MESH.positions)):
    """Return random velocities [m/s]."""
    return np.random.default_rng(seed).normal(size=(size, 3))


def law_of(material, element):
    """Return the law of the tetrahedra of a material."""
    law = material.law.density(material.moduli)
    return averaged_shear(law) if element == "averaged" else law


def matrix(solid, positions):
    """Return the matrix that makes viscous forces of velocities, shape (3 n, 3 n) [N/m]."""
    unit = np.eye(positions.size).reshape(-1, *positions.shape)
    return -np.array([solid.viscous_forces(positions, u).ravel() for u in unit]).T


@pytest.mark.kernel
@pytest.mark.parametrize("is_single", [False, True], ids=["double", "single"])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_forces_are_those_of_the_slow_version(law, is_single):
    solid = solid_of(MESH, law, is_single=is_single)
    for share in (0.0, 0.1, 0.5):
        x = moved(MESH, share)
        expected = naive_solid.viscous_forces(MESH, x, noise(), law)
        largest = np.abs(expected).max()
        found = solid.viscous_forces(x, noise())
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING[is_single] * largest)


@pytest.mark.kernel
@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("material", STIFFENING, ids=lambda x: x["law"])
def test_at_rest_they_are_the_stiffness_times_velocities(material, element):
    material = Material(**material, poisson_ratio=0.45)
    solid, x = solid_of(MESH, law_of(material, element)), MESH.positions
    expected = -stiffness_matrix(MESH, material, element=element) @ noise().ravel()
    found = solid.viscous_forces(x, noise()).ravel()
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.kernel
@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("nu", [0.0, 0.25, 0.45, 0.49])
def test_at_rest_a_neo_hookean_body_resists_strain_as_it_is_stiff(nu, element):
    """Where strain is the same everywhere, it does not matter which share is averaged."""
    material = Material(law="neo_hookean", poisson_ratio=nu)
    solid, x = solid_of(MESH, law_of(material, element)), MESH.positions
    stiffness = stiffness_matrix(MESH, material, element=element)
    for gradient in np.random.default_rng(2).normal(size=(5, 3, 3)):
        v = x @ gradient.T
        power = -(v * solid.viscous_forces(x, v)).sum()
        assert power == pytest.approx(v.ravel() @ (stiffness @ v.ravel()), rel=1e-12)


@pytest.mark.kernel
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_neither_translation_nor_rotation_of_a_strained_body_is_resisted(law):
    solid, x = solid_of(MESH, law), moved(MESH, 0.3)
    usual = np.abs(solid.viscous_forces(x, noise())).max()
    for v in (np.ones_like(x), np.cross([1.0, -2.0, 3.0], x) / np.ptp(x)):
        assert np.abs(solid.viscous_forces(x, v)).max() < 1e-12 * usual


@pytest.mark.kernel
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_forces_have_neither_sum_nor_moment(law):
    x = moved(MESH, 0.3)
    forces = solid_of(MESH, law).viscous_forces(x, noise())
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).sum()
    assert np.abs(np.cross(x, forces).sum(axis=0)).max() < 1e-12 * np.abs(np.cross(x, forces)).sum()


@pytest.mark.kernel
@settings(max_examples=20, deadline=None)
@given(st.sampled_from(sorted(LAWS)), st.integers(0, 1000), st.sampled_from([0.01, 0.1, 1.0, 10.0]))
def test_no_motion_of_any_body_gains_energy_by_them(name, seed, share):
    """Among them bodies whose tetrahedra are turned inside out, and pressed flat."""
    x, v = moved(MESH, share, seed), noise(seed + 1)
    x[:, 2] *= 0.0 if seed % 5 == 0 else 1.0
    v = v if seed % 2 == 0 else v - v.mean(axis=0)
    forces = solid_of(MESH, LAWS[name]).viscous_forces(x, v)
    assert (forces * v).sum() <= 1e-12 * np.abs(forces * v).sum()


@pytest.mark.kernel
@pytest.mark.parametrize("name", ["averaged", "exponential", "averaged shear", "averaged yeoh"])
def test_they_are_symmetric(name):
    damping = matrix(solid_of(MESH, LAWS[name]), moved(MESH, 0.2))
    np.testing.assert_allclose(damping, damping.T, rtol=0.0, atol=1e-12 * np.abs(damping).max())


def stretches(mesh, seed):
    """Return positions of a mesh that is stretched to 0.4 to 2.5 of its length, and shaken."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    length = np.exp(rng.uniform(-0.9, 0.9, size=3))
    strain = turn @ np.diag(length) @ turn.T
    return mesh.positions @ strain.T + 0.05 * rng.uniform() * np.ptp(mesh.positions) * noise(
        seed, len(mesh.positions)
    )


@pytest.mark.kernel
@pytest.mark.parametrize("nu", [0.0, 0.45, 0.49])
@pytest.mark.parametrize("element", ELEMENTS)
def test_no_strain_makes_a_motion_die_away_faster_than_the_bound_at_rest(element, nu):
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    solid = solid_of(mesh, law_of(Material(law="neo_hookean", poisson_ratio=nu), element))
    roots = np.sqrt(np.repeat(solid.body.masses[: len(mesh.positions)], 3))
    for seed in range(6):
        x = stretches(mesh, seed) if seed > 0 else mesh.positions
        rates = np.linalg.eigvalsh(matrix(solid, x) / roots / roots[:, None])
        assert rates[-1] <= solid.frequency() ** 2
        assert rates[0] >= -1e-12 * rates[-1]


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("precision", ["double", "single"])
def test_after_cuts_they_are_those_of_the_new_mesh(element, precision):
    mesh, material = block((4, 4, 2), (0.04, 0.04, 0.02)), Material(poisson_ratio=0.45)
    tissue = Tissue(mesh, material, solver=SolverSettings(element=element, precision=precision))
    for seed, kind in enumerate(incisions.KINDS):
        tissue.incise(*incisions.incision(mesh, kind, seed))
    after, elastic = tissue.snapshot(), tissue._model.elasticity.arrays
    cut = TetrahedralMesh(after.rest_positions, after.tetrahedra)
    n, body = tissue.n_nodes, tissue._body
    assert n > len(mesh.positions)
    body.positions[:n], body.velocities[:n] = moved(cut, 0.02), noise(size=n)
    expected = naive_solid.viscous_forces(cut, body.positions[:n], noise(size=n), elastic.solid.law)
    found = np.zeros((n, 3))
    evaluate_viscous(elastic.viscosity, elastic.solid, body, body.positions, found)
    largest = np.abs(expected).max()
    np.testing.assert_allclose(
        found, expected, rtol=0.0, atol=ROUNDING[precision == "single"] * largest
    )
