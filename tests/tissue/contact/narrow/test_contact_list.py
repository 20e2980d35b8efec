"""The list has one contact for each direction of a node, and goes on with what it had."""

import numpy as np
import pytest

from tests.tissue.contact.test_self_contact import HIGHEST, overlapping, rows_of, searched
from tissue.contact.response.contacts import SAME_DIRECTION

pytestmark = pytest.mark.kernel

CARRIED = ("node", "weight", "normal", "stiffness", "offset", "anchor", "push")


def search_again(contact, body):
    """Search in another time step."""
    with np.errstate(all="ignore"):  # rows that fill eight are empty
        contact.begin()
        contact.prepare(body, np.zeros(len(body.rest)), HIGHEST, np.inf, 1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_no_two_contacts_of_a_node_are_in_one_direction(seed):
    body, is_upper = overlapping(-1e-4, seed)
    random, most = np.random.default_rng(seed), 0
    body.positions[: len(is_upper)] += random.normal(scale=1e-3, size=(len(is_upper), 3))
    contact = searched(body)
    forces, search = contact.forces, contact.search
    for node in search.pairs.nodes[: search.pairs.n_nodes]:
        normals = forces.normal[search.contact[node] :][: search.n_contacts[node]]
        assert len(normals) <= 3
        cosines = normals @ normals.T - np.eye(len(normals))
        assert (cosines <= SAME_DIRECTION).all()
        most = max(most, len(normals))
    assert most > 0


def test_contacts_of_nodes_that_do_not_move_go_on_as_they_are_in_another_list():
    body, _ = overlapping(-1e-4)
    contact = searched(body)
    forces, n = contact.forces, contact.forces.n_contacts
    before = {name: getattr(forces, name)[rows_of(contact)].copy() for name in CARRIED}
    contact.search.is_listing_due, first = 1, forces.first
    search_again(contact, body)
    assert (forces.n_contacts, forces.first == first) == (n, False)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(forces, name)[rows_of(contact)], values, name)


def test_what_pressed_and_is_no_longer_found_fades_and_what_did_not_ends():
    body, is_upper = overlapping(-1e-4)
    contact = searched(body)
    forces, n = contact.forces, contact.forces.n_contacts
    forces.push[rows_of(contact)] = 0.0
    pressing = rows_of(contact).start + 1
    forces.push[pressing], node = 1e-2, forces.node[pressing, 0]
    body.positions[: len(is_upper)][is_upper] += [0.0, 0.0, 5e-3]
    search_again(contact, body)
    assert n > 1
    assert (forces.n_contacts, forces.n_fading) == (1, 1)
    assert forces.node[rows_of(contact), 0] == [node]
