"""Forces of tetrahedra against a slow reference, the energy and theory."""

import numpy as np
import pytest

from tests.support import bodies, naive_solid
from tests.tissue.cutting.test_stellar_subdivision import split_all
from tests.tissue.kernels_of import cut_of
from tests.tissue.solids import (
    LAWS,
    YOUNG_MODULUS,
    SolidBody,
    law_of,
    moved,
    solid_of,
)
from tissue import TetrahedralMesh, block
from tissue.core.jit import is_compiling

pytestmark = pytest.mark.kernel

MESHES = {
    "one tetrahedron": bodies.unit_tetrahedron(),
    "two": bodies.two_tetrahedra(),
    "grid": block((2, 1, 1), (0.2, 0.1, 0.1)),
    "jittered": bodies.jittered(2, 3),
}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


@pytest.fixture(params=LAWS)
def law(request):
    return LAWS[request.param]


def size(mesh):
    return float(np.ptp(mesh.positions))


def test_forces_and_energy_are_those_of_deformation_gradients_and_stresses(mesh, law):
    solid, x = solid_of(mesh, law), moved(mesh)
    expected = naive_solid.forces(mesh, x, law)
    np.testing.assert_allclose(solid.forces(x), expected, atol=1e-13 * np.abs(expected).max())
    assert solid.energy(x) == pytest.approx(naive_solid.energy(mesh, x, law), rel=1e-12)


def test_at_rest_there_is_no_force_and_no_energy(mesh, law):
    solid = solid_of(mesh, law)
    assert np.abs(solid.forces(mesh.positions)).max() < 1e-13 * YOUNG_MODULUS * size(mesh) ** 2
    assert abs(solid.energy(mesh.positions)) < 1e-13 * YOUNG_MODULUS * size(mesh) ** 3


def test_force_is_the_downhill_gradient_of_energy(mesh, law):
    solid, x = solid_of(mesh, law), moved(mesh)
    forces = solid.forces(x)
    step = 1e-6 * size(mesh)
    for node, axis in [(0, 0), (1, 1), (3, 2)]:
        here = np.zeros_like(x)
        here[node, axis] = step
        slope = (solid.energy(x + here) - solid.energy(x - here)) / (2.0 * step)
        assert forces[node, axis] == pytest.approx(-slope, rel=1e-6, abs=1e-6 * np.ptp(forces))


@pytest.mark.parametrize("averaged", [False, True])
def test_22_inner_nodes_are_in_equilibrium_under_an_affine_map(averaged):
    """Patch test: if the boundary is moved by an affine map, so are the inner nodes."""
    mesh = bodies.jittered_grid(3, 1, size=1.0)
    inner = ((mesh.positions > 1e-9) & (mesh.positions < 1.0 - 1e-9)).all(axis=1)
    map_ = np.eye(3) + 0.1 * np.random.default_rng(2).normal(size=(3, 3))
    affine = mesh.positions @ map_.T
    shifted = affine + np.where(inner[:, None], moved(mesh, 0.01) - mesh.positions, 0.0)
    solid = solid_of(mesh, law_of(0.3, averaged), ~inner)
    equilibrium = _equilibrium(solid, shifted, inner)
    np.testing.assert_allclose(equilibrium, affine, atol=1e-10)


def _equilibrium(solid: SolidBody, x, inner, pull=0.0, n_steps=8):
    """Return the equilibrium of the inner nodes by Newton's method with finite differences."""
    x, places = x.copy(), np.argwhere(np.repeat(inner[:, None], 3, axis=1))
    for _ in range(n_steps):
        stiffness = np.empty((len(places), len(places)))
        for column, (node, axis) in enumerate(places):
            step = np.zeros_like(x)
            step[node, axis] = 1e-6
            slope = (solid.forces(x + step) - solid.forces(x - step)) / 2e-6
            stiffness[:, column] = slope[tuple(places.T)]
        x[tuple(places.T)] -= np.linalg.solve(stiffness, (solid.forces(x) + pull)[tuple(places.T)])
    return x


@pytest.mark.parametrize("averaged", [False, True])
@pytest.mark.parametrize("poisson_ratio", [0.0, 0.25, 0.45])
def test_22_the_stress_in_a_rod_is_youngs_modulus_times_strain(poisson_ratio, averaged):
    mesh = bodies.jittered_grid(3, 1, size=1.0)
    strain = 1e-7
    narrowing = -poisson_ratio * strain
    x = mesh.positions * (1.0 + np.array([strain, narrowing, narrowing]))
    forces = solid_of(mesh, law_of(poisson_ratio, averaged)).forces(x)
    pulled = mesh.positions[:, 0] > 1.0 - 1e-9
    assert -forces[pulled, 0].sum() == pytest.approx(YOUNG_MODULUS * strain, rel=1e-6)
    on_free_sides = ~pulled & (mesh.positions[:, 0] > 1e-9)
    assert np.abs(forces[on_free_sides]).max() < 1e-6 * YOUNG_MODULUS * strain


SPLITS = [(int(1e6 * a), bool(b > 0.5), 0.2 + 0.6 * c, 0.2 + 0.6 * d)
          for a, b, c, d in np.random.default_rng(7).random((100, 4))]  # fmt: skip
"""A hundred stellar splits without a cut: which tetrahedron, whether a face, and where."""


def subdivided(mesh: TetrahedralMesh, x):
    """Return a mesh and its positions after `SPLITS`."""
    cut = cut_of(mesh)
    cut.body.positions[: len(x)] = x
    split_all(cut, SPLITS)
    n = cut.body.n_nodes
    tetrahedra = cut.body.tetrahedra[: cut.body.n_tetrahedra]
    return TetrahedralMesh(cut.body.rest[:n], tetrahedra), cut.body.positions[:n].copy()


def test_26_splits_without_a_cut_keep_the_energy():
    mesh = block((3, 3, 3), (1.0, 1.0, 1.0))
    x, law = moved(mesh, 0.03), law_of(0.45, averaged=False)
    finer, finer_x = subdivided(mesh, x)
    assert len(finer.tetrahedra) > len(mesh.tetrahedra) + 200
    before = solid_of(mesh, law).energy(x)
    assert solid_of(finer, law).energy(finer_x) == pytest.approx(before, rel=1e-12)


@pytest.mark.skipif(not is_compiling(), reason="thousands of forces: compiled only")
@pytest.mark.parametrize("averaged", [False, True])
def test_26_a_slab_sags_as_far_after_splits(averaged):
    """The paper's block between two plates under gravity; splits only make it softer."""
    mesh = block((4, 6, 4), (1.0, 1.5, 1.0))
    finer, _ = subdivided(mesh, mesh.positions)
    before, after = (_sag(which, law_of(0.45, averaged)) for which in (mesh, finer))
    assert before < after < 1.02 * before


def _sag(mesh, law):
    """Return the sag of the centre of mass of a slab [m]."""
    held = bodies.sides(mesh)
    solid = solid_of(mesh, law, held)
    masses = solid.body.masses[: len(held)]
    pull = np.outer(masses, [0.0, 0.0, -1.0])
    x = _equilibrium(solid, mesh.positions, ~held, pull, n_steps=4)
    return float(masses @ (mesh.positions - x)[:, 2] / masses.sum())
