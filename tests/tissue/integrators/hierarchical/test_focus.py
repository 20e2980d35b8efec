"""Rings are centred on the tip of the blade; all anchored nodes are in ring 0."""

import functools

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found_nodes
from tests.tissue.kernels_of import line_blade
from tissue.blade.edge_anchors import ANCHORED, new_anchors
from tissue.integrators.hierarchical.focus import find_held, find_rings
from tissue.integrators.hierarchical.node_rings import (
    UNREACHED,
    add_focus,
    begin_search,
    new_rings,
    ring_of,
    search,
)

pytestmark = pytest.mark.kernel

TIP, HEEL = 0, -1
"""Tetrahedra in opposite corners of the body."""


@functools.cache
def network():
    return block(5)


def corners_of(tetrahedron):
    """Return the nodes of a tetrahedron."""
    return network().body.tetrahedra[tetrahedron].tolist()


def held_by(*tetrahedra):
    body = network().body
    anchors = new_anchors(len(tetrahedra) + 1, 0.01, 40e3)
    anchors.state[1:] = ANCHORED  # the sample at the tip is outside the tissue
    anchors.tetrahedron[1:] = np.array(tetrahedra) % len(body.tetrahedra)
    held = new_rings(len(body.rest))
    find_held(held, body, line_blade(anchors))
    return held


def rings_of(held, last_ring):
    n_nodes = len(network().body.rest)
    rings = new_rings(n_nodes)
    find_rings(rings, held, network().springs, last_ring, np.zeros(n_nodes, np.int64))
    return rings


def test_the_first_anchor_from_the_tip_is_the_focus():
    assert found_nodes(held_by(TIP, HEEL)) == [*corners_of(TIP), *corners_of(HEEL)]


def test_rings_are_counted_from_the_tip_and_anchored_nodes_are_in_ring_0():
    rings = rings_of(held_by(TIP, HEEL), 2)
    expected = new_rings(len(network().body.rest))
    begin_search(expected)
    for node in corners_of(TIP):
        add_focus(expected, node)
    search(expected, network().springs, 2)
    for node in found_nodes(expected):
        assert ring_of(rings, node) == ring_of(expected, node)
    assert {ring_of(rings, node) for node in corners_of(HEEL)} == {0}


def test_neighbours_of_distant_anchored_nodes_are_in_the_last_ring():
    rings = rings_of(held_by(TIP, HEEL), 2)
    springs, far = network().springs, corners_of(HEEL)[0]
    first = springs.first[far]
    beside = springs.neighbour[first : first + springs.count[far]].tolist()
    assert {ring_of(rings, node) for node in beside} == {0, 2}


def test_the_order_is_ring_by_ring_and_each_node_once():
    rings = rings_of(held_by(TIP, 30, HEEL), 3)
    order = found_nodes(rings)
    assert len(set(order)) == len(order)
    assert (np.diff(rings.ring[order]) >= 0).all()


def test_the_focus_stays_when_no_anchor_is_left():
    held = held_by(TIP)
    before = found_nodes(held)
    find_held(held, network().body, line_blade(new_anchors(2, 0.01, 40e3)))
    assert found_nodes(held) == before
    assert ring_of(held, corners_of(HEEL)[0]) == UNREACHED
