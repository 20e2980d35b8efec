"""Contacts of two blocks are those that a test of all pairs finds, and keep momentum and torque."""

import numpy as np
import pytest

from tests.support.overlaps import joined
from tissue import block
from tissue.contact.response.forces import add_contact_forces
from tissue.contact.self_contact import SelfContact
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

SIZE = 0.01
"""Size of a node [m]."""

HIGHEST = 1e7
"""Bound on w^2 of the body [1/s2]."""


def overlapping(deep, seed=0):
    """Return two blocks of which the upper is turned, and `deep` in the lower one [m].

    Returns:
        The body, and which nodes are of the upper block.
    """
    lower, upper = block((2, 2, 1), (0.02, 0.02, 0.01)), block((1, 1, 1), (0.01, 0.01, 0.01))
    body = build_body(joined(lower, upper, (0.004, 0.006, 0.0102)), None, None)
    is_upper = np.arange(body.n_nodes) >= len(lower.positions)
    body.masses[:] = 1e-3
    body.positions[is_upper, 2] -= 0.0002 + deep
    body.positions[is_upper, :2] += np.random.default_rng(seed).uniform(-1e-3, 1e-3, 2)
    return body, is_upper


def searched(body, floor=None, n=1):
    """Return the contact of a body after `n` searches for steps of a millisecond."""
    contact = SelfContact(body, SIZE, 0.3, floor, HIGHEST)
    with np.errstate(all="ignore"):  # rows that fill eight are empty
        for _ in range(n):
            contact.begin()
            contact.prepare(body, np.zeros(len(body.rest)), HIGHEST, np.inf, 1e-3)
    return contact


def rows_of(contact):
    forces = contact.forces
    return slice(forces.first, forces.first + forces.n_contacts)


@pytest.mark.parametrize("seed", range(3))
def test_each_node_within_reach_over_a_face_has_one_contact_with_weights_of_its_foot(seed):
    body, is_upper = overlapping(-2e-4, seed)
    contact = searched(body)
    forces, rows = contact.forces, rows_of(contact)
    is_node = forces.weight[rows, 0] == 1.0
    nodes, weight = forces.node[rows][is_node], forces.weight[rows][is_node]
    bottom = np.flatnonzero(is_upper & (body.positions[: len(is_upper), 2] < 0.0105))
    assert sorted(node for node in nodes[:, 0] if is_upper[node]) == sorted(bottom)
    np.testing.assert_allclose(weight.sum(axis=1), 0.0, atol=1e-12)
    for (node, *corners), w in zip(nodes, weight, strict=True):
        foot = -w[1:] @ body.positions[corners]
        assert abs(foot[2] - body.positions[node, 2]) == pytest.approx(2e-4)
        np.testing.assert_allclose(foot[:2], body.positions[node, :2], atol=1e-9)
    is_below = ~is_upper[nodes[:, 0]]  # a node is pushed out of the block that it is not of
    towards = np.where(is_below, -1.0, 1.0) * forces.normal[rows][is_node][:, 2]
    assert (towards > 0.9).all()


@pytest.mark.parametrize("seed", range(4))
def test_forces_of_contacts_have_neither_sum_nor_torque(seed):
    body, is_upper = overlapping(-1e-4, seed)
    contact = searched(body)
    random, n = np.random.default_rng(seed), body.n_nodes
    body.positions[:n][is_upper] -= [0.0, 0.0, 4e-4]
    body.positions[:n] += random.normal(scale=1e-4, size=(n, 3))
    body.velocities[:n] = random.normal(scale=0.05, size=(n, 3))
    external = np.zeros_like(body.positions)
    add_contact_forces(contact.forces, body.positions, body.velocities, 1e-3, external)
    size = np.abs(external).sum()
    assert size > 0.0
    np.testing.assert_allclose(external.sum(axis=0), 0.0, atol=1e-12 * size)
    torque = np.cross(body.positions, external).sum(axis=0)
    np.testing.assert_allclose(torque, 0.0, atol=1e-10 * size * SIZE)


def test_nodes_near_the_floor_have_one_contact_with_it():
    body, _ = overlapping(-1e-2)
    contact = searched(body, floor=-4e-4)
    forces, rows = contact.forces, rows_of(contact)
    low = np.flatnonzero(body.positions[: body.n_nodes, 2] < 1e-4)
    np.testing.assert_array_equal(np.sort(forces.node[rows, 0]), low)
    np.testing.assert_array_equal(forces.height[rows], -4e-4)


def test_blocks_that_are_far_apart_have_no_contact():
    body, _ = overlapping(-2e-3)
    assert not searched(body).is_touching
