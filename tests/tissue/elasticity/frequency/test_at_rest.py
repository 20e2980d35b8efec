"""The bound on the frequencies of a solid against eigenvalues, on cut meshes."""

import functools

import numpy as np
import pytest

from tests.support import bodies, incisions
from tests.tissue.solids import LAWS, SolidBody, highest_frequency, lame, law_of, solid_of
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block
from tissue.core.jit import is_compiling
from tissue.elasticity.frequency.weights import tighten
from tissue.laws.energy_density import volume_term
from tissue.mesh.star import no_visits

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


SMALL_NODE = 31
"""A node inside `bodies.jittered(3, ...)` that the tests move close to a face."""


def with_a_sliver():
    """Return a mesh with a node close to the face opposite: one mode has a high frequency."""
    mesh = bodies.jittered(3, 1)
    around = mesh.tetrahedra[(mesh.tetrahedra == SMALL_NODE).any(axis=1)][0]
    others = mesh.positions[around[around != SMALL_NODE]].mean(axis=0)
    x = mesh.positions.copy()
    x[SMALL_NODE] += 0.6 * (others - x[SMALL_NODE])
    return mesh._replace(positions=x)


def tightened(solid, allowed=0.0):
    """Tighten the bounds; return the nodes whose bound may have changed."""
    n = solid.body.n_nodes
    solid.solid.listed[:n] = np.arange(n)
    visits = no_visits(len(solid.body.rest), len(solid.body.tetrahedra))
    n = tighten(solid.solid, solid.body, visits, n, allowed)
    return solid.solid.listed[:n]


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_8_tightening_at_least_halves_the_error_of_the_bound(law):
    solid = solid_of(with_a_sliver(), law)
    before, highest = solid.frequency(), highest_frequency(solid)
    tightened(solid)
    assert 0.0 <= solid.frequency() - highest <= 0.5 * (before - highest)


def test_the_bound_of_a_regular_mesh_does_not_rise():
    solid = solid_of(block((3, 3, 3), (0.03, 0.03, 0.03)), law_of(0.45))
    before = solid.frequency()
    tightened(solid)
    assert highest_frequency(solid) <= solid.frequency() <= before


def test_bounds_below_the_allowed_one_are_not_changed():
    solid = solid_of(with_a_sliver(), law_of(0.45))
    weights, bounds = solid.solid.weight.copy(), solid.solid.frequency_squared.copy()
    tightened(solid, allowed=bounds.max())
    np.testing.assert_array_equal(solid.solid.weight, weights)
    np.testing.assert_array_equal(solid.solid.frequency_squared, bounds)


def test_only_the_listed_nodes_have_another_bound():
    solid = solid_of(with_a_sliver(), law_of(0.45))
    before = solid.solid.frequency_squared.copy()
    listed = tightened(solid, allowed=0.8 * before.max())
    changed = np.flatnonzero(solid.solid.frequency_squared != before)
    assert 0 < len(changed) <= len(listed) == len(np.unique(listed))
    assert np.isin(changed, listed).all()


def test_fixed_nodes_have_no_weight():
    mesh = with_a_sliver()
    solid = solid_of(mesh, law_of(0.45), bodies.sides(mesh))
    tightened(solid)
    held = np.flatnonzero(bodies.sides(mesh))
    assert (solid.solid.weight[held] == 0.0).all()
    assert highest_frequency(solid) <= solid.frequency()
