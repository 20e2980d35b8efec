"""Contacts of two blocks are those that a test of all pairs finds, and go on as they were."""

import math

import numpy as np
import pytest

from tests.support.overlaps import joined
from tissue import block
from tissue.contact.narrow.node_face import over_faces, points_of_tests
from tissue.contact.response.contacts import SAME_DIRECTION
from tissue.contact.self_contact import SelfContact
from tissue.core.jit import kernel
from tissue.core.simd import room_for_points, store_lanes
from tissue.core.vec3 import cross, dot, scale, sub, vec3
from tissue.mesh.body import build_body

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


@pytest.mark.kernel
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


def measure(x, nodes, out):
    """Write height and weights of eight nodes over a face each."""
    over = over_faces(points_of_tests(x, nodes, 0))
    for k, lanes in enumerate((over.height, over.weights.x, over.weights.y, over.weights.z)):
        store_lanes(out, 8 * k, lanes)


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(3))
def test_height_and_weights_over_eight_faces_are_to_the_bit_those_of_scalars(seed):
    random, x, out = np.random.default_rng(seed), room_for_points(20), np.zeros(32)
    x[:] = random.normal(size=(20, 3))
    nodes = np.array([random.choice(20, 4, replace=False) for _ in range(8)])
    kernel(measure)(x, nodes, out)
    for k, of_test in enumerate(nodes):
        node, corner, b, c = (vec3(x, i) for i in of_test)
        ab, ac, ap = sub(b, corner), sub(c, corner), sub(node, corner)
        area = cross(ab, ac)
        square = dot(area, area)
        wb, wc = dot(cross(ap, ac), area) / square, dot(cross(ab, ap), area) / square
        height = dot(ap, scale(1.0 / math.sqrt(square), area))
        assert out[k::8].tolist() == [height, 1.0 - wb - wc, wb, wc]


@pytest.mark.kernel
def test_nodes_near_the_floor_have_one_contact_with_it():
    body, _ = overlapping(-1e-2)
    contact = searched(body, floor=-4e-4)
    forces, rows = contact.forces, rows_of(contact)
    low = np.flatnonzero(body.positions[: body.n_nodes, 2] < 1e-4)
    np.testing.assert_array_equal(np.sort(forces.node[rows, 0]), low)
    np.testing.assert_array_equal(forces.height[rows], -4e-4)


@pytest.mark.kernel
def test_blocks_that_are_far_apart_have_no_contact():
    body, _ = overlapping(-2e-3)
    assert not searched(body).is_touching


CARRIED = ("node", "weight", "normal", "stiffness", "offset", "anchor", "push")


def search_again(contact, body):
    """Search in another time step."""
    with np.errstate(all="ignore"):  # rows that fill eight are empty
        contact.begin()
        contact.prepare(body, np.zeros(len(body.rest)), HIGHEST, np.inf, 1e-3)


@pytest.mark.kernel
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


@pytest.mark.kernel
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


@pytest.mark.kernel
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


def inside(body, t):
    """Return the nodes with barycentric weights above 0.02 in a tetrahedron that is not theirs."""
    corners = body.positions[body.tetrahedra[t]]
    matrix = np.vstack([corners.T, np.ones(4)])
    x = np.vstack([body.positions[: body.n_nodes].T, np.ones(body.n_nodes)])
    weights = np.linalg.solve(matrix, x)
    found = np.flatnonzero(weights.min(axis=0) > 0.02)
    return set(map(int, found)) - set(map(int, body.tetrahedra[t]))


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(3))
def test_nodes_in_tetrahedra_of_another_part_are_found(seed):
    body, _ = overlapping(0.4 * SIZE, seed)
    contact = searched(body, n=1)
    wanted = set().union(*(inside(body, t) for t in range(body.n_tetrahedra)))
    has_contact = set(map(int, contact.forces.node[rows_of(contact), 0]))
    contact = searched(body, n=4)
    pairs = contact.search.pairs
    found = set(map(int, np.flatnonzero(pairs.is_penetrating)))
    assert found == wanted - has_contact
    assert found
