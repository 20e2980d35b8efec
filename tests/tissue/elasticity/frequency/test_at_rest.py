"""The bound on the frequencies of a solid against eigenvalues, on cut meshes."""

import functools

import numpy as np
import pytest

from tests.support import bodies, incisions
from tests.tissue.solids import LAWS, SolidBody, highest_frequency, lame, law_of, moved, solid_of
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block
from tissue.core.jit import is_compiling
from tissue.laws.energy_density import volume_term

pytestmark = pytest.mark.kernel

KINDS = list(incisions.KINDS)

LOOSEST_BOUND = 1.6
"""Largest ratio of the bound to the highest frequency; 1.1 to 1.45 were measured."""

LOOSEST_TIGHT_BOUND = 1.3
"""Largest ratio where the weights of nodes were searched for."""

needs_speed = pytest.mark.skipif(not is_compiling(), reason="forty cuts: compiled only")


@functools.cache
def cut_tissue(seed: int) -> Tissue:
    """Return a small body of averaged neo-Hookean tetrahedra after two random incisions."""
    mesh = block((4, 3, 3), (0.04, 0.03, 0.03)) if seed % 2 else bodies.jittered(3, seed)
    material = Material(law="neo_hookean", poisson_ratio=0.45)
    tissue = Tissue(mesh, material, solver=SolverSettings(mass_scaling=None))
    for i in range(2):
        tissue.incise(*incisions.incision(mesh, KINDS[(seed + 3 * i) % len(KINDS)], seed + i))
    return tissue


def cut_mesh(seed: int) -> TetrahedralMesh:
    """Return the rest shape of `cut_tissue(seed)`."""
    snapshot = cut_tissue(seed).snapshot()
    return TetrahedralMesh(snapshot.rest_positions, snapshot.tetrahedra)


def updated_solid(tissue: Tissue) -> SolidBody:
    """Return the solid as the tissue updated it after the cuts."""
    return SolidBody(tissue._body, tissue._model.elasticity.arrays.solid)


@needs_speed
@pytest.mark.parametrize("seed", range(20))
def test_8_the_bound_updated_after_cuts_is_slightly_above_the_highest_frequency(seed):
    tissue = cut_tissue(seed)
    solid = updated_solid(tissue)
    ratio = solid.frequency() / highest_frequency(solid)
    assert 1.0 <= ratio <= LOOSEST_TIGHT_BOUND
    assert solid.frequency() <= np.sqrt(tissue._model.elasticity.frequency_squared)


@needs_speed
@pytest.mark.parametrize("seed", range(20))
def test_8_the_bound_after_cuts_is_closer_than_with_the_weights_of_the_masses(seed):
    solid = updated_solid(cut_tissue(seed))
    loose = solid_of(cut_mesh(seed), solid.solid.law)
    highest = highest_frequency(solid)
    assert highest == pytest.approx(highest_frequency(loose), rel=1e-6)
    assert highest <= solid.frequency() < loose.frequency()


@needs_speed
@pytest.mark.parametrize("seed", range(20))
def test_8_the_bound_holds_without_averaged_volumes(seed):
    solid = solid_of(cut_mesh(seed), law_of(0.45, averaged=False))
    assert 1.0 <= solid.frequency() / highest_frequency(solid) <= LOOSEST_BOUND


@needs_speed
@pytest.mark.parametrize("seed", range(6))
def test_the_solid_updated_after_cuts_has_the_forces_of_the_cut_mesh(seed):
    mesh, updated = cut_mesh(seed), updated_solid(cut_tissue(seed))
    x = moved(mesh, 0.01)
    from_scratch = solid_of(mesh, updated.solid.law)
    np.testing.assert_array_equal(updated.forces(x), from_scratch.forces(x))
    assert updated.energy(x) == from_scratch.energy(x)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.25, 0.49])
@pytest.mark.parametrize("averaged", [False, True])
def test_8_the_bound_holds_at_any_poisson_s_ratio(poisson_ratio, averaged):
    solid = solid_of(bodies.jittered(2, 3), law_of(poisson_ratio, averaged))
    assert 1.0 <= solid.frequency() / highest_frequency(solid) <= LOOSEST_BOUND


@pytest.mark.parametrize("averaged", [False, True])
def test_8_the_bound_holds_for_the_volume_term_of_springs(averaged):
    mu, lam = lame(0.45)
    solid = solid_of(bodies.jittered(2, 3), volume_term(lam - mu, averaged=averaged))
    assert 1.0 <= solid.frequency() / highest_frequency(solid) <= LOOSEST_BOUND


def test_the_bound_holds_with_fixed_nodes_and_is_no_higher():
    mesh = bodies.jittered(2, 3)
    held, loose = (solid_of(mesh, law_of(0.45), f) for f in (bodies.sides(mesh), None))
    assert highest_frequency(held) <= held.frequency() <= loose.frequency()
    assert (held.solid.frequency_squared[bodies.sides(mesh)] == 0.0).all()


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_body_of_half_the_size_has_twice_the_frequency(law):
    mesh = bodies.jittered(2, 3)
    half = mesh._replace(positions=0.5 * mesh.positions)
    expected = 2.0 * solid_of(mesh, law).frequency()
    assert solid_of(half, law).frequency() == pytest.approx(expected, rel=1e-9)
