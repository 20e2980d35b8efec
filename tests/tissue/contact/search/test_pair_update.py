"""Pairs that are updated as nodes move are the same as if all were listed again."""

import numpy as np
import pytest

from tests.tissue.contact.two_blocks import SIZE, TwoBlocks
from tissue.contact.search.near_pairs import CONTACT_REACH

pytestmark = pytest.mark.kernel


def listed(search):
    """Return the pairs in the list."""
    rows = slice(search.pairs.first, search.pairs.first + search.pairs.n_pairs)
    return list(zip(search.pairs.node[rows], search.pairs.face[rows], strict=True))


def touching(search):
    """Return the pairs of a node and a face of the other block that are within reach."""
    x, pairs = search.body.positions, search.pairs
    for face in np.flatnonzero(pairs.is_active):
        corners = pairs.triangle[face]
        a, b, c = x[corners]
        area = np.cross(b - a, c - a)
        outward = area / np.linalg.norm(area)
        for node in np.flatnonzero(search.is_upper != search.is_upper[corners[0]]):
            height = (x[node] - a) @ outward
            foot = x[node] - height * outward
            is_over = all(
                np.cross(q - p, foot - p) @ outward > 0.0 for p, q in ((a, b), (b, c), (c, a))
            )
            is_facing = search.normal[node] @ outward < 0.0
            if is_over and is_facing and abs(height) < CONTACT_REACH * SIZE:
                yield node, face


@pytest.mark.parametrize("seed", range(3))
def test_no_pair_within_reach_is_missing_as_nodes_move(seed):
    search, random = TwoBlocks(), np.random.default_rng(seed)
    n_touching = 0
    for _ in range(12):
        move = random.normal(scale=2e-4, size=search.body.positions.shape)
        drift = random.normal(scale=3e-4, size=3) * [1.0, 1.0, 0.3]
        search.body.positions[:] += move * (random.random() < 0.5)
        search.body.positions[search.is_upper] += drift
        search.update()
        known = set(listed(search))
        near = set(touching(search))
        assert near <= known
        n_touching += len(near)
    assert n_touching > 20 and search.n_updates > 2


def test_no_pair_is_listed_twice_and_they_are_sorted_by_nodes():
    search, random = TwoBlocks(), np.random.default_rng(0)
    for _ in range(6):
        which = random.random(search.body.n_nodes) < 0.3
        search.body.positions[which] += random.normal(scale=1e-3, size=(which.sum(), 3))
        search.update()
    known, pairs = listed(search), search.pairs
    assert search.n_updates > 3
    assert len(known) == len(set(known)) > 0
    for node in pairs.nodes[: pairs.n_nodes]:
        own = slice(pairs.begin[node], pairs.end[node])
        assert (pairs.node[own] == node).all()
        assert pairs.end[node] - pairs.begin[node] == sum(n == node for n, _ in known)
