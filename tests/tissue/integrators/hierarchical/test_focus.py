"""Rings are centred on the tip of the blade; all anchored nodes are in ring 0."""

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found_nodes
from tests.tissue.kernels_of import line_blade
from tissue.blade.anchors import ANCHORED, new_anchors
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

NETWORK = block(5)
BODY, SPRINGS = NETWORK.body, NETWORK.springs
N_NODES = len(BODY.rest)
TIP, HEEL = 0, len(BODY.tetrahedra) - 1
"""Tetrahedra in opposite corners of the body."""


def held_by(*tetrahedra):
    anchors = new_anchors(len(tetrahedra) + 1, 0.01, 40e3)
    anchors.state[1:] = ANCHORED  # the sample at the tip is outside the tissue
    anchors.tetrahedron[1:] = tetrahedra
    held = new_rings(N_NODES)
    find_held(held, BODY, line_blade(anchors))
    return held


def rings_of(held, last_ring):
    rings = new_rings(N_NODES)
    find_rings(rings, held, SPRINGS, last_ring, np.zeros(N_NODES, np.int64))
    return rings


def test_the_first_anchor_from_the_tip_is_the_focus():
    corners = [BODY.tetrahedra[t].tolist() for t in (TIP, HEEL)]
    assert found_nodes(held_by(TIP, HEEL)) == [*corners[0], *corners[1]]


def test_rings_are_counted_from_the_tip_and_anchored_nodes_are_in_ring_0():
    rings = rings_of(held_by(TIP, HEEL), 2)
    expected = new_rings(N_NODES)
    begin_search(expected)
    for node in BODY.tetrahedra[TIP]:
        add_focus(expected, node)
    search(expected, SPRINGS, 2)
    for node in found_nodes(expected):
        assert ring_of(rings, node) == ring_of(expected, node)
    assert {ring_of(rings, node) for node in BODY.tetrahedra[HEEL]} == {0}


def test_neighbours_of_distant_anchored_nodes_are_in_the_last_ring():
    rings = rings_of(held_by(TIP, HEEL), 2)
    far = int(BODY.tetrahedra[HEEL, 0])
    first = SPRINGS.first[far]
    beside = SPRINGS.neighbour[first : first + SPRINGS.count[far]].tolist()
    assert {ring_of(rings, node) for node in beside} == {0, 2}


def test_the_order_is_ring_by_ring_and_each_node_once():
    rings = rings_of(held_by(TIP, 30, HEEL), 3)
    order = found_nodes(rings)
    assert len(set(order)) == len(order)
    assert (np.diff(rings.ring[order]) >= 0).all()


def test_the_focus_stays_when_no_anchor_is_left():
    held = held_by(TIP)
    before = found_nodes(held)
    find_held(held, BODY, line_blade(new_anchors(2, 0.01, 40e3)))
    assert found_nodes(held) == before
    assert ring_of(held, int(BODY.tetrahedra[HEEL, 0])) == UNREACHED
