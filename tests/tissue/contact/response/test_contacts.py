"""Rows of the list of contacts: whose force a new contact goes on with."""

import numpy as np
import pytest

from tests.tissue.contact.lists import random_contacts
from tissue.contact.response.contacts import (
    begin_contact,
    copy_contact,
    list_touching_nodes,
    take_over,
)

pytestmark = pytest.mark.kernel

ONE, OTHER, THIRD = (1, 2, 3), (3, 4, 5), (6, 7, 8)


def contacts_of_a_node(degrees_before, faces_before, degrees, faces):
    """Return a body and contacts of its node 0: first those before, which press, then new ones.

    Args:
        degrees_before: Angle of the normal of each of those before.
        faces_before: Nodes of their faces.
        degrees: Angle of the normal of each new one.
        faces: Nodes of their faces.
    """
    body, forces = random_contacts(0)
    angles = np.radians([*degrees_before, *degrees])
    for c, nodes in enumerate([*faces_before, *faces]):
        begin_contact(forces, c, 0.0)
        forces.node[c] = [0, *nodes]
        forces.normal[c] = [np.cos(angles[c]), np.sin(angles[c]), 0.0]
    n_before = len(degrees_before)
    forces.push[:n_before] = 1.0 + np.arange(n_before)
    forces.stiffness[:n_before] = 10.0
    return body, forces, (0, n_before), (n_before, len(degrees))


def test_a_contact_goes_on_with_the_force_of_its_own_face_though_another_is_nearer_in_direction():
    body, forces, before, now = contacts_of_a_node((0, 30), (ONE, OTHER), (5, 0), (OTHER, ONE))
    take_over(forces, body, before, now)
    np.testing.assert_array_equal(forces.push[2:4], [2.0, 1.0])


def test_of_other_faces_the_nearest_in_direction_counts_and_none_beyond_45_degrees():
    body, forces, before, now = contacts_of_a_node((0, 60), (ONE, OTHER), (40, 180), (THIRD, ONE))
    take_over(forces, body, before, now)
    np.testing.assert_array_equal(forces.push[:4], [1.0, -1.0, 2.0, 0.0])


def test_a_force_has_one_heir_and_what_has_one_takes_no_other():
    body, forces, before, now = contacts_of_a_node((0,), (ONE,), (0, 5), (ONE, OTHER))
    take_over(forces, body, before, now)
    take_over(forces, body, before, now)
    np.testing.assert_array_equal(forces.push[:3], [-1.0, 1.0, 0.0])


def test_a_contact_that_is_copied_goes_on_in_its_new_row_alone():
    _, forces, _, _ = contacts_of_a_node((0,), (ONE,), (0,), (ONE,))
    copy_contact(forces, 0, 7)
    assert forces.push[7] == 1.0
    assert forces.push[0] < 0.0


@pytest.mark.parametrize("seed", range(3))
def test_each_node_in_contact_is_listed_once_with_its_share(seed):
    body, forces = random_contacts(seed)
    share = np.full(body.n_nodes, np.nan)
    list_touching_nodes(forces, share)
    nodes, n = forces.node[: forces.n_contacts], forces.n_nodes
    assert sorted(forces.touching[:n]) == list(np.unique(nodes))
    shares = np.zeros(body.n_nodes)
    np.add.at(shares, nodes, np.abs(forces.weight[: forces.n_contacts]))
    np.testing.assert_allclose(share[forces.touching[:n]], shares[forces.touching[:n]])
