"""Contact impulses conserve momentum and create no energy."""

import numpy as np
import pytest

from tests.tissue.contact.on_floor import STEP, UP, one_on_floor
from tissue import block
from tissue.contact.constraints import Manifold, gap, new_contacts
from tissue.contact.solver import (
    add_contact,
    begin_iterations,
    is_due,
    note_correction,
    solve_positions,
    solve_velocities,
)
from tissue.core.vec3 import Vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

ACROSS = Manifold(Weights(1.0, -0.2, -0.3, -0.5), UP)


def bodies_of(seed=0, n_contacts=12, n_fixed=0):
    """Return nodes with random masses and velocities, and random contacts that overlap a little."""
    random = np.random.default_rng(seed)
    body = build_body(block((2, 2, 2)), None, None)
    n = len(body.rest)
    body.masses[:] = random.uniform(1e-4, 1e-3, n)
    body.velocities[:] = random.normal(size=(n, 3))
    body.fixed[:n_fixed] = True
    contacts = new_contacts(n, n_contacts, 1.0)
    for _ in range(n_contacts):
        a, b, c, d = random.choice(n, 4, replace=False).tolist()
        w = random.dirichlet([1.0, 1.0, 1.0]).tolist()
        normal = random.normal(size=3)
        normal /= np.linalg.norm(normal)
        manifold = Manifold(Weights(1.0, *(-x for x in w)), Vec3(*normal.tolist()))
        add_contact(contacts, body, (a, b, c, d), manifold, 0.0, body.positions)
    return body, contacts


def kinetic(body):
    return 0.5 * float(body.masses @ (body.velocities**2).sum(axis=1))


def momentum(body):
    return (body.masses[:, None] * body.velocities).sum(axis=0)


@pytest.mark.parametrize("coefficient", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("seed", range(5))
def test_impulses_conserve_momentum_and_only_dissipate_energy(seed, coefficient):
    body, contacts = bodies_of(seed)
    energy, before = kinetic(body), momentum(body)
    centre = body.masses @ body.positions
    solve_positions(contacts, body, body.positions.copy(), coefficient, 0.0)
    np.testing.assert_allclose(body.masses @ body.positions, centre, rtol=1e-12)
    solve_velocities(contacts, body, coefficient, STEP, 0.0)
    np.testing.assert_allclose(momentum(body), before, atol=1e-12 * np.abs(before).max())
    assert kinetic(body) < energy
    assert contacts.impulse.min() >= 0.0
    assert (
        np.linalg.norm(contacts.friction, axis=1) <= coefficient * contacts.impulse * (1 + 1e-12)
    ).all()


def test_a_node_that_hits_the_floor_stops_and_slides_on_as_coulomb_says():
    body, contacts = one_on_floor([1.0, 0.0, -2.0])
    solve_velocities(contacts, body, 0.3, STEP, 0.0)
    assert body.velocities[0].tolist() == pytest.approx([1.0 - 0.3 * 2.0, 0.0, 0.0])
    assert contacts.impulse[0] == pytest.approx(0.5 * 2.0)


def test_friction_within_the_cone_stops_sliding():
    body, contacts = one_on_floor([0.5, 0.0, -2.0])
    solve_velocities(contacts, body, 0.3, STEP, 0.0)
    assert np.abs(body.velocities[0]).max() < 1e-15


def test_a_node_that_leaves_the_floor_gets_no_impulse():
    body, contacts = one_on_floor([1.0, 0.0, 2.0])
    solve_velocities(contacts, body, 0.3, STEP, 0.0)
    assert body.velocities[0].tolist() == [1.0, 0.0, 2.0]
    assert contacts.impulse[0] == 0.0


def test_a_node_inside_the_floor_is_moved_on_to_it():
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=1e-4)
    solve_positions(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(0.0, abs=1e-18)


def test_no_impulse_moves_a_fixed_node():
    body, contacts = bodies_of(n_fixed=13)
    x, v = body.positions.copy(), body.velocities.copy()
    solve_positions(contacts, body, x.copy(), 0.3, 0.0)
    solve_velocities(contacts, body, 0.3, STEP, 0.0)
    np.testing.assert_array_equal(body.positions[:13], x[:13])
    np.testing.assert_array_equal(body.velocities[:13], v[:13])
    assert (body.velocities[13:] != v[13:]).any()


def test_a_contact_between_the_same_nodes_is_added_once():
    body, contacts = bodies_of()
    n = contacts.n_contacts
    known = [tuple(row) for row in contacts.node[:n].tolist()]
    for nodes in known:
        add_contact(contacts, body, nodes, ACROSS, 0.0, body.positions)
    assert contacts.n_contacts == n == len(set(known))


def test_a_contact_is_skipped_until_another_moves_its_nodes():
    """One contact has node 0 alone, the other nodes 0 to 3."""
    body, contacts = one_on_floor([0.0, 0.0, -1.0], n_contacts=2)
    add_contact(contacts, body, (0, 1, 2, 3), ACROSS, 0.0, body.positions)
    begin_iterations(contacts)
    for k, has_moved, due in [(0, True, [False, True]), (1, False, [False, False])]:
        note_correction(contacts, k, has_moved)
        assert [is_due(contacts, 0), is_due(contacts, 1)] == due
    note_correction(contacts, 1, True)
    assert is_due(contacts, 0) and not is_due(contacts, 1)
