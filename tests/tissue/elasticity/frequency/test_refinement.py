"""Node weights that tighten the bound on frequencies, against eigenvalues."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.solids import LAWS, highest_frequency, law_of, solid_of
from tissue import block
from tissue.elasticity.frequency.at_rest import tighten
from tissue.mesh.star import no_visits

pytestmark = pytest.mark.kernel

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
