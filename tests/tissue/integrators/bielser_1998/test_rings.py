"""The ring of a node is its distance in edges from the focus."""

import functools

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found_nodes, rings_around
from tissue.integrators.bielser_1998.rings import (
    UNREACHED,
    add_focus,
    begin_search,
    new_rings,
    ring_of,
    search,
)

pytestmark = pytest.mark.kernel

N_NODES = 4**3


@functools.cache
def network():
    return block(3, held=False)


def test_the_network_has_four_nodes_along_each_side():
    assert len(network().body.rest) == N_NODES


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
