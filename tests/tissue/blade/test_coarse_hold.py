"""A tetrahedron that was cut goes on holding its anchor, until the anchor has slipped out of it."""

import numpy as np
import pytest

from tests.tissue.kernels_of import line_blade
from tissue import Material, block
from tissue.blade.coarse_hold import OVERHANG, fade_coarse_hold, move_coarse_hold
from tissue.blade.edge import Edge
from tissue.blade.edge_anchors import (
    anchor_position,
    holding_node,
    holding_weight,
    n_holding_nodes,
    new_anchors,
)
from tissue.blade.return_mapping import relocate, set_anchor
from tissue.core.vec3 import Vec3
from tissue.mesh.body import build_body
from tissue.mesh.star import no_visits

pytestmark = pytest.mark.kernel

BLOCK = block((2, 2, 2), (0.02, 0.02, 0.02))
MIDDLE = np.array([0.4, 0.2, 0.2, 0.2])
"""Weights of the anchor in its tetrahedron: nearer to its first node than to the second."""


EDGE = Edge(*(Vec3(0.01, 0.01, 0.0), Vec3(0.01, 0.01, 0.01), Vec3(0.0, 1.0, 0.0)) * 2)


class HeldAnchor:
    """An anchor in tetrahedron 0 of a deformed block."""

    def __init__(self):
        self.body = build_body(BLOCK, None, None)
        rng = np.random.default_rng(1)
        self.body.positions[:] = self.body.rest + 1e-3 * rng.standard_normal(self.body.rest.shape)
        self.anchors = new_anchors(2, 0.01, 1e4)
        self.blade = line_blade(self.anchors, Material())
        self.visits = no_visits(len(BLOCK.positions), len(BLOCK.tetrahedra))
        self.nodes = self.body.tetrahedra[0].copy()
        set_anchor(self.anchors, self.body, 0, 0, Vec3(*(MIDDLE @ self.body.rest[self.nodes])))

    def refine(self):
        """Divide the first edge of the tetrahedron at its middle; return the new node."""
        new = next(i for i in range(self.body.n_nodes) if i not in self.nodes)
        for points in (self.body.rest, self.body.positions):
            points[new] = points[self.nodes[:2]].mean(axis=0)
        self.body.tetrahedra[0, 1] = new  # the part on the side of the first node
        relocate(self.blade, self.body, self.visits, EDGE, 0.0)
        return new

    def slip_to(self, weights):
        """Move the anchor to these weights in the tetrahedron as it was."""
        p = Vec3(*(np.array(weights) @ self.body.rest[self.nodes]))
        move_coarse_hold(self.anchors.coarse, self.body, 0, p)
        fade_coarse_hold(self.anchors.coarse, 0)

    @property
    def position(self):
        return np.array(anchor_position(self.anchors, self.body, self.body.positions, 0))


@pytest.fixture
def held():
    return HeldAnchor()


def test_refining_the_mesh_does_not_move_an_anchor(held):
    before = held.position
    held.refine()
    np.testing.assert_allclose(held.position, before, rtol=1e-12)


def test_an_anchor_does_not_follow_a_node_that_was_just_inserted(held):
    new = held.refine()
    before = held.position
    held.body.positions[new] += 1e-3
    np.testing.assert_array_equal(held.position, before)


def test_the_weights_of_the_nodes_that_hold_an_anchor_add_up_to_its_position(held):
    held.refine()
    held.slip_to([0.9, -0.1, 0.1, 0.1])
    n = n_holding_nodes(held.anchors, 0)
    nodes = [holding_node(held.anchors, held.body, 0, i) for i in range(n)]
    weights = np.array([holding_weight(held.anchors, 0, i) for i in range(n)])
    assert n == 8
    assert weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(weights @ held.body.positions[nodes], held.position, rtol=1e-12)


@pytest.mark.parametrize("outside", [0.0, 0.25, 0.5, 1.0])
def test_the_hold_fades_as_the_anchor_slips_out_of_the_tetrahedron(held, outside):
    held.refine()
    held.slip_to([1.0 + outside * OVERHANG, -outside * OVERHANG, 0.0, 0.0])
    assert held.anchors.coarse.share[0] == pytest.approx(1.0 - outside)


def test_a_hold_that_has_faded_does_not_come_back(held):
    held.refine()
    held.slip_to([1.2, -0.2, 0.0, 0.0])
    share = held.anchors.coarse.share[0]
    held.slip_to(MIDDLE)
    assert held.anchors.coarse.share[0] == share


def test_an_anchor_whose_tetrahedron_stays_is_held_by_four_nodes(held):
    relocate(held.blade, held.body, held.visits, EDGE, 0.0)
    assert n_holding_nodes(held.anchors, 0) == 4
