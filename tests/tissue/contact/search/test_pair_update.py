"""Pairs that are updated as nodes move are the same as if all were listed again."""

import itertools

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
