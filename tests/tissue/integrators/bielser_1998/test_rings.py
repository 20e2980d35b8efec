"""The ring of a node is its distance in edges from the tip; held nodes are in ring 0."""

import functools

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found_nodes, rings_around
from tests.tissue.kernels_of import line_blade
from tissue.blade.edge_anchors import ANCHORED, new_anchors
from tissue.integrators.bielser_1998.rings import (
    UNREACHED,
    add_focus,
    begin_search,
    find_held,
    find_rings,
    new_rings,
    ring_of,
    search,
)

pytestmark = pytest.mark.kernel

N_NODES = 4**3


@functools.cache
def network():
    return block(3, held=False)


def edges_apart(start: int) -> list[int]:
    """Return the distance of every node from `start` in edges, by matrix powers."""
    springs = network().springs
    joined = np.eye(N_NODES, dtype=bool)
    for i in range(N_NODES):
        first = springs.first[i]
        joined[i, springs.neighbour[first : first + springs.count[i]]] = True
    reached, distance = np.eye(N_NODES, dtype=bool)[start], np.full(N_NODES, -1)
    for ring in range(N_NODES):
        distance[reached & (distance < 0)] = ring
        reached = joined[reached].any(axis=0)
    return distance.tolist()


@pytest.mark.parametrize("start", [0, 21, N_NODES - 1])
def test_the_ring_of_a_node_is_its_distance_in_edges(start):
    rings = rings_around(network(), start, N_NODES)
    assert [ring_of(rings, i) for i in range(N_NODES)] == edges_apart(start)


def test_nodes_come_ring_by_ring_and_each_once():
    rings = rings_around(network(), 21, N_NODES)
    order = found_nodes(rings)
    assert sorted(order) == list(range(N_NODES))
    assert (np.diff(rings.ring[order]) >= 0).all()


def test_a_search_ends_at_its_last_ring():
    rings = rings_around(network(), 21, 1)
    assert {ring_of(rings, i) for i in found_nodes(rings)} == {0, 1}
    expected = [i for i, ring in enumerate(edges_apart(21)) if ring <= 1]
    assert sorted(found_nodes(rings)) == expected
    assert ring_of(rings, edges_apart(21).index(2)) == UNREACHED


def test_a_new_search_discards_the_last():
    rings = rings_around(network(), 0, 1)
    begin_search(rings)
    add_focus(rings, N_NODES - 1)
    add_focus(rings, N_NODES - 1)
    assert found_nodes(rings) == [N_NODES - 1]
    assert ring_of(rings, 0) == UNREACHED


def test_a_search_without_a_focus_finds_nothing():
    rings = new_rings(N_NODES)
    begin_search(rings)
    search(rings, network().springs, 5)
    assert rings.n_found == 0


TIP, HEEL = 0, -1
"""Tetrahedra in opposite corners of the body."""


@functools.cache
def held_network():
    return block(5)


def corners_of(tetrahedron):
    """Return the nodes of a tetrahedron."""
    return held_network().body.tetrahedra[tetrahedron].tolist()


def held_by(*tetrahedra):
    body = held_network().body
    anchors = new_anchors(len(tetrahedra) + 1, 0.01, 40e3)
    anchors.state[1:] = ANCHORED  # the sample at the tip is outside the tissue
    anchors.tetrahedron[1:] = np.array(tetrahedra) % len(body.tetrahedra)
    held = new_rings(len(body.rest))
    find_held(held, body, line_blade(anchors))
    return held


def rings_of(held, last_ring):
    n_nodes = len(held_network().body.rest)
    rings = new_rings(n_nodes)
    find_rings(rings, held, held_network().springs, last_ring, np.zeros(n_nodes, np.int64))
    return rings


def test_the_first_anchor_from_the_tip_is_the_focus():
    assert found_nodes(held_by(TIP, HEEL)) == [*corners_of(TIP), *corners_of(HEEL)]


def test_rings_are_counted_from_the_tip_and_anchored_nodes_are_in_ring_0():
    rings = rings_of(held_by(TIP, HEEL), 2)
    expected = new_rings(len(held_network().body.rest))
    begin_search(expected)
    for node in corners_of(TIP):
        add_focus(expected, node)
    search(expected, held_network().springs, 2)
    for node in found_nodes(expected):
        assert ring_of(rings, node) == ring_of(expected, node)
    assert {ring_of(rings, node) for node in corners_of(HEEL)} == {0}


def test_neighbours_of_distant_anchored_nodes_are_in_the_last_ring():
    rings = rings_of(held_by(TIP, HEEL), 2)
    springs, far = held_network().springs, corners_of(HEEL)[0]
    first = springs.first[far]
    neighbours = springs.neighbour[first : first + springs.count[far]].tolist()
    assert {ring_of(rings, node) for node in neighbours} == {0, 2}


def test_the_focus_stays_when_no_anchor_is_left():
    held = held_by(TIP)
    before = found_nodes(held)
    find_held(held, held_network().body, line_blade(new_anchors(2, 0.01, 40e3)))
    assert found_nodes(held) == before
    assert ring_of(held, corners_of(HEEL)[0]) == UNREACHED
