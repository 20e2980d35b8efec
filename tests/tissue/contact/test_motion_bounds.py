"""Pairs are skipped while they cannot have touched, and no longer."""

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


class RandomMotion:
    """Nodes that move at random in a box, and pairs of edges between them."""

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

    def step(self):
        start = self.body.positions.copy()
        moves = self.random.normal(size=(self.n, 3)) * self.speeds[:, None]
        self.body.positions += moves - 0.01 * (self.body.positions - self.body.rest)
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
def test_no_pair_that_may_have_passed_through_is_skipped(seed, fast):
    moving = RandomMotion(seed, fast)
    pairs, motion = moving.pairs, moving.motion
    n_skipped = n_touched = 0
    for _ in range(400):
        moved = moving.step()
        until = horizon(motion, TOLERANCE)
        for k in range(8):
            a, b, c, d = nodes_of_pair(pairs, k)
            apart = moving.distance(k)
            may_have_touched = apart <= max(moved[a], moved[b]) + max(moved[c], moved[d])
            if pairs.wake[k] <= until and can_touch(motion, pairs, k, TOLERANCE):
                note_distance(motion, pairs, k, apart)
            else:
                assert not may_have_touched
                n_skipped += 1
            n_touched += may_have_touched
    assert n_skipped > 100 and n_touched > 0


def test_a_node_that_moves_far_is_fast_for_a_while_and_its_pairs_use_node_paths():
    moving = RandomMotion(0, 1)
    moving.step()
    assert is_fast(moving.motion, 0) and not is_fast(moving.motion, 1)
    assert moving.motion.slow_path < FAST_MOVE
    has_node_0 = (moving.pairs.node.reshape(4, -1) == 0).any(axis=0)
    for k in range(8):
        note_distance(moving.motion, moving.pairs, k, 1.0)
    np.testing.assert_array_equal(np.isinf(moving.pairs.wake), has_node_0)
    moving.speeds[:] = 0.0
    for _ in range(70):
        moving.step()
    assert not is_fast(moving.motion, 0)


def test_dropping_and_moving_pairs_between_near_and_far_loses_none():
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
