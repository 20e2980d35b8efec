"""No pair of edges within reach is missing as nodes move."""

import itertools

import numpy as np
import pytest

from tests.tissue.contact.two_blocks import SIZE, TwoBlocks
from tissue.contact.search.near_pairs import CONTACT_REACH

pytestmark = pytest.mark.kernel


def edges_within_reach(search: TwoBlocks) -> set[frozenset[int]]:
    """Return the pairs of edges of two blocks that cross within reach and face each other."""
    x, edges = search.body.positions, search.edges
    middle = {upper: x[search.is_upper == upper].mean(axis=0) for upper in (False, True)}
    near = set()
    for one, other in itertools.combinations(edges.listed[: edges.n_edges], 2):
        (a, b), (c, d) = x[edges.node[one]], x[edges.node[other]]
        of_upper = [bool(search.is_upper[edges.node[edge, 0]]) for edge in (one, other)]
        if of_upper[0] == of_upper[1]:
            continue
        system = np.column_stack([b - a, c - d])
        (s, t), *_ = np.linalg.lstsq(system, c - a, rcond=None)
        apart = a + s * (b - a) - c - t * (d - c)
        if not (0.0 < s < 1.0 and 0.0 < t < 1.0 and np.linalg.norm(apart) < CONTACT_REACH * SIZE):
            continue
        if (a - middle[of_upper[0]]) @ (c - middle[of_upper[1]]) < 0.0:
            near.add(frozenset(map(int, (*edges.node[one], *edges.node[other]))))
    return near


@pytest.mark.parametrize("seed", range(3))
def test_no_edges_within_reach_are_missing_as_nodes_move(seed):
    search, random = TwoBlocks(), np.random.default_rng(seed)
    search.body.positions[search.is_upper] += [0.014, 0.003, -0.0002]
    n_near = 0
    for _ in range(20):
        move = random.normal(scale=2e-4, size=search.body.positions.shape)
        drift = random.normal(scale=5e-4, size=3) * [1.0, 1.0, 0.2]
        search.body.positions[:] += move * (random.random() < 0.5)
        search.body.positions[search.is_upper] += drift
        search.update()
        found, node = search.edge_pairs, search.edges.node
        pairs = found.edge[: found.n_pairs]
        listed = {frozenset(map(int, (*node[one], *node[other]))) for one, other in pairs}
        assert len(listed) == found.n_pairs
        near = edges_within_reach(search)
        assert near <= listed
        n_near += len(near)
    assert n_near > 3 and search.n_updates > 2
