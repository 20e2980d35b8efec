"""Contacts as springs: what one side gets the other gives, and friction obeys Coulomb."""

import numpy as np
import pytest

from tests.tissue.contact.lists import FRICTION, random_contacts, stiffened
from tests.tissue.contact.response.test_torque_balance import EDGES, FACE, deep_pair
from tissue.contact.response.contacts import (
    clear_contact_forces,
    list_touching_nodes,
    new_penalty_forces,
)
from tissue.contact.response.forces import add_contact_forces, end_contact_substep

pytestmark = pytest.mark.kernel

STEP = 1e-4
"""Time between two evaluations [s]."""


def one_on_floor(depth=1e-4, velocity=(0.0, 0.0, 0.0), stiffness=100.0):
    """Return a body whose node 0 is that deep in the floor, and the contact of that node."""
    body, _ = random_contacts(0)
    forces = new_penalty_forces(1, FRICTION, 1e-4)
    forces.n_contacts = 1
    forces.weight[0, 0] = 1.0
    forces.normal[0] = [0.0, 0.0, 1.0]
    forces.stiffness[0] = stiffness
    forces.largest_depth[0] = 1.0
    body.positions[0, 2] = -depth
    body.velocities[0] = velocity
    return body, forces


def forces_of(body, forces, seconds=1e-3):
    external = np.zeros_like(body.positions)
    add_contact_forces(forces, body.positions, body.velocities, seconds, external)
    return external


@pytest.mark.parametrize("seed", range(5))
def test_the_two_sides_of_a_contact_get_equal_and_opposite_forces(seed):
    body, forces, _ = stiffened(seed)
    is_floor = forces.node[:20, 0] == forces.node[:20, 1]
    forces.stiffness[:20][is_floor] = 0.0
    forces.offset[:20] = 1e-4
    external = forces_of(body, forces)
    assert np.abs(external).max() > 0.0
    assert np.abs(external.sum(axis=0)).max() < 1e-12 * np.abs(external).sum()


def test_a_contact_that_is_open_adds_no_force_and_one_that_parts_does_not_pull():
    for depth, velocity in ((-1e-6, (0.0, 0.0, 0.0)), (1e-4, (0.0, 0.0, 5.0))):
        body, forces = one_on_floor(depth, velocity)
        assert not forces_of(body, forces).any()


@pytest.mark.parametrize("share", [0.5, 0.99, 2.0, 50.0])
def test_friction_is_a_spring_up_to_coulombs_limit_and_no_more(share):
    body, forces = one_on_floor()
    pressure = 100.0 * 1e-4
    stretch = share * FRICTION * pressure / 100.0
    forces.anchor[0] = body.positions[0] * [1.0, 1.0, 0.0] - [stretch, 0.0, 0.0]
    external = forces_of(body, forces)
    assert external[0, 2] == pytest.approx(pressure)
    assert external[0, 0] == pytest.approx(-min(share, 1.0) * FRICTION * pressure)


def test_the_anchor_of_what_slides_follows_until_the_spring_bears_coulombs_limit():
    body, forces = one_on_floor()
    forces.anchor[0] = body.positions[0] * [1.0, 1.0, 0.0] - [0.01, 0.0, 0.0]
    end_contact_substep(forces, body.positions, body.velocities, np.zeros_like(body.positions))
    assert body.positions[0, 0] - forces.anchor[0, 0] == pytest.approx(FRICTION * 1e-4)
    assert forces.n_pressing == 1
    assert forces.push[0] == pytest.approx(1e-2)
    assert forces.stored == pytest.approx(0.5 * 100.0 * 1e-8 * (1.0 + FRICTION**2))


def test_impulse_of_the_floor_and_work_are_counted_by_the_weight_of_the_evaluation():
    body, forces = one_on_floor(velocity=(0.0, 0.0, -0.5))
    external = forces_of(body, forces, 2e-3)
    np.testing.assert_allclose(forces.floor_impulse, 2e-3 * external[0])
    impulse = 2e-3 * external[0, 2]
    body.velocities[0, 2] = -0.1
    end_contact_substep(forces, body.positions, body.velocities, external)
    assert forces.work == pytest.approx(-0.3 * impulse)
    assert forces.pressure_impulse == 0.0


def test_forces_are_cleared_at_the_nodes_of_contacts_and_nowhere_else():
    body, forces = one_on_floor()
    list_touching_nodes(forces, np.zeros(body.n_nodes))
    assert list(forces.touching[: forces.n_nodes]) == [0]
    external = np.ones_like(body.positions)
    clear_contact_forces(forces, external)
    assert (external == 1.0).all(), "no forces have been added"
    add_contact_forces(forces, body.positions, body.velocities, 1e-3, external)
    clear_contact_forces(forces, external)
    assert not external[0].any()
    assert (external[1:] == 1.0).all()


def held_after(pair, velocities, n):
    """Move the nodes for `n` steps; return what the contact holds then, and all it did in work [J].

    Args:
        pair: The contact.
        velocities: Takes the positions; returns the velocities [m/s].
        n: How many steps.
    """
    for _ in range(n):
        middle = pair.x + 0.5 * STEP * velocities(pair.x)
        after = pair.x + STEP * velocities(middle)
        pair.x[:], pair.v[:] = middle, velocities(middle)
        pair.evaluate(STEP)
        pair.x[:] = after
        end_contact_substep(pair.forces, pair.x, pair.v, pair.external)
    return pair.forces.stored, pair.forces.work


def pressed(weights, seed):
    """Return a contact that is pressed by 0.4 mm, and what it holds [J]."""
    pair = deep_pair(weights, seed)
    forces = pair.forces
    along = (forces.weight[0] @ pair.x) @ forces.normal[0]
    forces.offset[0] = along + 4e-4
    end_contact_substep(forces, pair.x, pair.v, pair.external)
    return pair, forces.stored


@pytest.mark.parametrize("weights", [FACE, EDGES])
@pytest.mark.parametrize("seed", range(10))
def test_sides_that_turn_as_one_body_get_nothing_and_leave_the_spring_no_more_than_it_held(
    weights, seed
):
    for sign in (-1.0, 1.0):
        pair, before = pressed(weights, seed)
        axis = sign * np.random.default_rng(seed).normal(size=3)
        stored, work = held_after(pair, lambda x, axis=axis: np.cross(axis, x), 1000)
        assert abs(work) < 1e-5 * before
        assert stored < (1.0 + 1e-6) * before


@pytest.mark.parametrize("weights", [FACE, EDGES])
@pytest.mark.parametrize("seed", range(20))
def test_forces_do_no_more_work_than_the_spring_gives_up_however_the_nodes_move(weights, seed):
    pair, before = pressed(weights, seed)
    moving = 0.05 * np.random.default_rng(seed).normal(size=(4, 3))
    stored, work = held_after(pair, lambda x: moving, 200)
    assert work <= before - stored + 0.01 * before
