"""Pairs sleep while they cannot have met, and no longer."""

import numpy as np
import pytest

from tissue import block
from tissue.contact.distance import distance_of_edges
from tissue.contact.edge_edge import Edges
from tissue.contact.motion_bounds import (
    can_touch,
    horizon,
    is_fast,
    measure_motion,
    new_motion_bounds,
    note_distance,
    wake_fast_pairs,
)
from tissue.contact.pairs import (
    add_pair,
    drop_pair,
    make_far,
    make_near,
    new_pairs,
    nodes_of_pair,
)
from tissue.core.vec3 import vec3
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

TOLERANCE = 1e-9
FAST_MOVE = 1e-4


class Wandering:
    """Nodes that move about in a box, and pairs of edges between them."""

    def __init__(self, seed, fast):
        self.random = np.random.default_rng(seed)
        self.body = build_body(block((2, 1, 1), (0.001, 0.0005, 0.0005)), None, None)
        self.n = len(self.body.positions)
        self.pairs, self.motion = new_pairs(8), new_motion_bounds(self.n, FAST_MOVE)
        self.speeds = np.where(np.arange(self.n) < fast, 3e-4, 2e-5)
        self.motion.seen[:] = self.body.positions
        for _ in range(8):
            nodes = tuple(self.random.choice(self.n, 4, replace=False).tolist())
            add_pair(self.pairs, nodes, 0, 0, 0)

    def go(self):
        start = self.body.positions.copy()
        step = self.random.normal(size=(self.n, 3)) * self.speeds[:, None]
        self.body.positions += step - 0.01 * (self.body.positions - self.body.rest)
        self.motion.step += 1
        nodes = np.arange(self.n)
        measure_motion(self.motion, self.body, start, nodes, self.n)
        if self.motion.n_newly_fast:
            wake_fast_pairs(self.motion, self.pairs)
        return np.linalg.norm(self.body.positions - start, axis=1)

    def distance(self, k):
        corners = (vec3(self.body.positions, node) for node in nodes_of_pair(self.pairs, k))
        return distance_of_edges(Edges(*corners))


@pytest.mark.parametrize("fast", [0, 2])
@pytest.mark.parametrize("seed", range(3))
def test_no_pair_sleeps_through_what_may_have_gone_through(seed, fast):
    wandering = Wandering(seed, fast)
    pairs, motion = wandering.pairs, wandering.motion
    n_slept = n_met = 0
    for _ in range(400):
        moved = wandering.go()
        until = horizon(motion, TOLERANCE)
        for k in range(8):
            a, b, c, d = nodes_of_pair(pairs, k)
            apart = wandering.distance(k)
            may_have_met = apart <= max(moved[a], moved[b]) + max(moved[c], moved[d])
            if pairs.wake[k] <= until and can_touch(motion, pairs, k, TOLERANCE):
                note_distance(motion, pairs, k, apart)
            else:
                assert not may_have_met
                n_slept += 1
            n_met += may_have_met
    assert n_slept > 100 and n_met > 0


def test_a_node_that_moves_much_is_fast_for_a_while_and_its_pairs_go_by_its_path():
    wandering = Wandering(0, 1)
    wandering.go()
    assert is_fast(wandering.motion, 0) and not is_fast(wandering.motion, 1)
    assert wandering.motion.slow_path < FAST_MOVE
    with_it = (wandering.pairs.node.reshape(4, -1) == 0).any(axis=0)
    for k in range(8):
        note_distance(wandering.motion, wandering.pairs, k, 1.0)
    np.testing.assert_array_equal(np.isinf(wandering.pairs.wake), with_it)
    wandering.speeds[:] = 0.0
    for _ in range(70):
        wandering.go()
    assert not is_fast(wandering.motion, 0)


def test_pairs_are_dropped_and_made_near_and_far_and_none_is_lost():
    pairs = new_pairs(5)
    for k in range(5):
        assert add_pair(pairs, (k, 10, 20, 30), k, k, k)
    assert not add_pair(pairs, (9, 9, 9, 9), 0, 0, 0)
    make_near(pairs, 3)
    make_near(pairs, 4)
    assert sorted(pairs.node[:2].tolist()) == [3, 4]
    make_far(pairs, 0)
    drop_pair(pairs, 0)
    left = pairs.node[: pairs.n_pairs].tolist()
    assert (pairs.n_near, pairs.n_pairs) == (0, 4) and len(set(left)) == 4
    assert pairs.item[:4, 0].tolist() == pairs.generation[:4].tolist() == left
