"""What impulses keep: momentum, and that no energy is made."""

import numpy as np
import pytest

from tissue import block
from tissue.contact.constraints import (
    KEPT,
    add_contact,
    bear,
    begin_sweeps,
    begin_with_last,
    gap,
    is_due,
    keep,
    new_contacts,
    note_move,
    push_apart,
    stop_approach,
)
from tissue.core.vec3 import Vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

UP = Vec3(0.0, 0.0, 1.0)
STEP = 1e-3


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
        weights = Weights(1.0, *(-x for x in w))
        add_contact(
            contacts, body, (a, b, c, d), weights, Vec3(*normal.tolist()), 0.0, body.positions
        )
    return body, contacts


def kinetic(body):
    return 0.5 * float(body.masses @ (body.velocities**2).sum(axis=1))


def momentum(body):
    return (body.masses[:, None] * body.velocities).sum(axis=0)


@pytest.mark.parametrize("coefficient", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("seed", range(5))
def test_impulses_keep_momentum_and_only_take_energy(seed, coefficient):
    body, contacts = bodies_of(seed)
    energy, before = kinetic(body), momentum(body)
    centre = body.masses @ body.positions
    push_apart(contacts, body, body.positions.copy(), coefficient, 0.0)
    np.testing.assert_allclose(body.masses @ body.positions, centre, rtol=1e-12)
    stop_approach(contacts, body, coefficient, STEP, 0.0)
    np.testing.assert_allclose(momentum(body), before, atol=1e-12 * np.abs(before).max())
    assert kinetic(body) < energy
    assert contacts.impulse.min() >= 0.0
    assert (
        np.linalg.norm(contacts.friction, axis=1) <= coefficient * contacts.impulse * (1 + 1e-12)
    ).all()


def one_on_floor(velocity, depth=0.0, n_contacts=1, before=0.0, recovery=0.0):
    """Return a body whose node 0 is on the floor, or in it."""
    body = build_body(block((1, 1, 1)), None, None)
    body.masses[:] = 0.5
    start = body.positions.copy()
    start[0, 2] = -before
    body.positions[0, 2] = -depth
    body.velocities[0] = velocity
    contacts = new_contacts(len(body.rest), n_contacts, recovery)
    contacts.seconds[0] = STEP
    add_contact(contacts, body, (0, 0, 0, 0), Weights(1.0, 0.0, 0.0, 0.0), UP, 0.0, start)
    return body, contacts


def test_a_node_that_hits_the_floor_stops_and_slides_on_as_coulomb_says():
    body, contacts = one_on_floor([1.0, 0.0, -2.0])
    stop_approach(contacts, body, 0.3, STEP, 0.0)
    assert body.velocities[0].tolist() == pytest.approx([1.0 - 0.3 * 2.0, 0.0, 0.0])
    assert contacts.impulse[0] == pytest.approx(0.5 * 2.0)


def test_within_the_cone_friction_stops_it():
    body, contacts = one_on_floor([0.5, 0.0, -2.0])
    stop_approach(contacts, body, 0.3, STEP, 0.0)
    assert np.abs(body.velocities[0]).max() < 1e-15


def test_a_node_that_leaves_is_not_held():
    body, contacts = one_on_floor([1.0, 0.0, 2.0])
    stop_approach(contacts, body, 0.3, STEP, 0.0)
    assert body.velocities[0].tolist() == [1.0, 0.0, 2.0]
    assert contacts.impulse[0] == 0.0


def test_a_node_in_the_floor_is_put_on_it():
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=1e-4)
    push_apart(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(0.0, abs=1e-18)


def test_of_what_was_in_the_floor_before_the_step_a_little_is_undone():
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=3e-4, before=2e-4, recovery=0.5e-4 / STEP)
    push_apart(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(-1.5e-4, abs=1e-18)


@pytest.mark.parametrize("n_steps", [1, 4])
def test_an_overlap_is_undone_at_the_same_speed_in_steps_of_any_length(n_steps):
    """Where a step undid as much however short, nodes that are pinched were thrown to and fro."""
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=3e-4, before=3e-4, recovery=0.1)
    body.positions[0, 2] = -3e-4
    for _ in range(n_steps):
        contacts.shift[0], contacts.seconds[0] = 0.0, STEP / n_steps
        bear(contacts, 0, body.positions)
        push_apart(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(-3e-4 + 0.1 * STEP)


def fall(body, g=9.81):
    """Let node 0 fall freely for a step, from where it is and as it moves."""
    body.positions[0, 2] += STEP * body.velocities[0, 2] - 0.5 * STEP**2 * g
    body.velocities[0, 2] -= STEP * g


def test_what_rests_needs_no_more_than_what_it_took_in_the_step_before():
    """Not in the second step: it is not known yet whether the first was an impact."""
    body, contacts = one_on_floor([0.0, 0.0, 0.0])
    for step in range(4):
        start = body.positions.copy()
        fall(body)
        if step > 0:
            keep(contacts, 0, 0, 1.0)
            begin_with_last(contacts, body, 0)
        bear(contacts, 0, start)
        is_right = abs(gap(contacts, body.positions, 0)) < 1e-15
        assert is_right == (step > 1)
        assert (abs(body.velocities[0, 2]) < 1e-12) == is_right
        push_apart(contacts, body, start, 0.3, 0.0)
        stop_approach(contacts, body, 0.3, STEP, 0.0)
    assert contacts.impulse[0] == pytest.approx(0.5 * 9.81 * STEP)


def test_a_step_that_is_twice_as_long_begins_with_twice_the_impulse():
    _, contacts = one_on_floor([0.0, 0.0, -1.0])
    contacts.impulse[0], contacts.last_impulse[0], contacts.shift[0] = 2.0, 2.0, 1e-4
    contacts.seconds[0] = 2.0 * STEP
    keep(contacts, 0, 0, 2.0)
    assert contacts.impulse[0] == 4.0
    assert contacts.shift[0] == pytest.approx(4e-4)


def test_sides_that_cannot_be_parted_take_no_more_in_each_step():
    """What a contact begins with is bounded by its impulse; without one, by a share of the last."""
    _, contacts = one_on_floor([0.0, 0.0, 0.0])
    contacts.seconds[0] = STEP
    contacts.shift[0] = 1.0
    keep(contacts, 0, 0, 1.0)
    assert contacts.shift[0] == KEPT < 1.0 and contacts.impulse[0] == 0.0


def test_fixed_nodes_take_any_impulse():
    body, contacts = bodies_of(n_fixed=13)
    x, v = body.positions.copy(), body.velocities.copy()
    push_apart(contacts, body, x.copy(), 0.3, 0.0)
    stop_approach(contacts, body, 0.3, STEP, 0.0)
    np.testing.assert_array_equal(body.positions[:13], x[:13])
    np.testing.assert_array_equal(body.velocities[:13], v[:13])
    assert (body.velocities[13:] != v[13:]).any()


def test_a_contact_between_the_same_nodes_is_added_once():
    body, contacts = bodies_of()
    n = contacts.count[0]
    known = [tuple(row) for row in contacts.node[:n].tolist()]
    for nodes in known:
        add_contact(contacts, body, nodes, Weights(1.0, -0.2, -0.3, -0.5), UP, 0.0, body.positions)
    assert contacts.count[0] == n == len(set(known))


def test_a_contact_is_passed_over_until_another_moves_its_nodes():
    """One is of node 0 alone, the other of nodes 0 to 3."""
    body, contacts = one_on_floor([0.0, 0.0, -1.0], n_contacts=2)
    add_contact(
        contacts, body, (0, 1, 2, 3), Weights(1.0, -0.2, -0.3, -0.5), UP, 0.0, body.positions
    )
    begin_sweeps(contacts)
    for k, has_moved, due in [(0, True, [False, True]), (1, False, [False, False])]:
        note_move(contacts, k, has_moved)
        assert [is_due(contacts, 0), is_due(contacts, 1)] == due
    note_move(contacts, 1, True)
    assert is_due(contacts, 0) and not is_due(contacts, 1)
