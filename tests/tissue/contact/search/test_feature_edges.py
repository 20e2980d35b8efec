"""The feature edges of blocks; what their grids find is what a test of all boxes finds."""

import itertools
import math

import numpy as np
import pytest

from tests.tissue.contact.two_blocks import SIZE, TwoBlocks
from tissue.contact.search.feature_edges import (
    arrange_edges,
    enter_edge,
    find_near_edges,
    new_edge_grid,
)
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3
from tissue.geometry.aabb import Aabb, box_at

pytestmark = pytest.mark.kernel

NODE_SIZE = 0.05
SAME_SIDE = 0.5
NOW = 3


def feature_edges_of(search: TwoBlocks) -> set[tuple[int, int]]:
    """Return the feature edges that are listed, lower node first."""
    edges = search.edges
    listed = edges.listed[: edges.n_edges]
    return {tuple(sorted(map(int, edges.node[edge]))) for edge in listed}


def test_the_feature_edges_of_blocks_are_their_edges_each_once():
    search = TwoBlocks()
    search.update()
    # Along each edge of a block two of its coordinates are at their ends.
    x = search.body.rest[: search.body.n_nodes]
    wanted = set()
    for of_block in (search.is_upper, ~search.is_upper):
        nodes = np.flatnonzero(of_block[: len(x)])
        low, high = x[nodes].min(axis=0), x[nodes].max(axis=0)
        for a, b in itertools.combinations(nodes, 2):
            at_end = np.isclose(x[a], x[b]) & (np.isclose(x[a], low) | np.isclose(x[a], high))
            if at_end.sum() == 2 and np.linalg.norm(x[a] - x[b]) < 1.1 * SIZE:
                wanted.add((int(a), int(b)))
    assert len(wanted) == 2 * (8 * 2 + 4)
    assert feature_edges_of(search) == wanted
    assert search.edges.n_edges == len(wanted)


@kernel
def fill(grid, low, high, outward, dirty_at):
    """Enter edges and arrange them."""
    grid.short.n_items = grid.long.n_items = 0
    for i in range(len(low)):
        enter_edge(grid, i, box_at(low, high, i), NODE_SIZE)
    arrange_edges(grid, low, high, outward, dirty_at, NOW, NODE_SIZE)


def on_two_lips(random, n):
    """Return boxes and directions of edges on two bent lips, some at rims without a direction."""
    side = np.where(random.random(n) < 0.5, 1.0, -1.0)
    middle = random.uniform(size=(n, 3)) * [1.0, 1.0, 0.02]
    direction = np.stack([0.4 * middle[:, 0], np.zeros(n), side], axis=1)
    direction += random.normal(scale=0.1, size=(n, 3))
    direction *= random.uniform(0.1, 3.0, size=(n, 1))
    direction[random.random(n) < 0.02] = 0.0
    reach = random.uniform(0.2, 0.5, size=(n, 3)) * NODE_SIZE
    reach[random.random(n) < 0.1] *= 4.0
    return middle - reach, middle + reach, direction


@pytest.mark.parametrize("n", [0, 1, 8, 9, 70, 700])
def test_the_grid_finds_what_testing_all_finds(n):
    random, grid = np.random.default_rng(n), new_edge_grid(700)
    fill(grid, *on_two_lips(random, 700), np.zeros(700, np.int64))  # of which nothing is left
    low, high, outward = on_two_lips(random, n)
    dirty_at = np.where(random.random(n) < 0.3, NOW, NOW - 1)
    fill(grid, low, high, outward, dirty_at)
    unit = outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None]
    numbers, n_found = np.arange(n), 0
    for a, b, query in zip(*on_two_lips(random, 60), strict=True):
        edge = int(random.integers(700))
        furthest = SAME_SIDE * float(np.linalg.norm(query))
        overlaps = ((low <= b) & (high >= a)).all(axis=1)
        overlaps &= (dirty_at != NOW) | (numbers < edge)
        box, towards = Aabb(Vec3(*a), Vec3(*b)), Vec3(*query)
        found = grid.found[: find_near_edges(grid, edge, box, towards, furthest)]
        assert sorted(found) == list(np.flatnonzero(overlaps & ~(unit @ query > furthest)))
        n_found += len(found)
        everywhere = grid.found[: find_near_edges(grid, edge, box, towards, math.inf)]
        assert sorted(everywhere) == list(np.flatnonzero(overlaps))
    assert n < 700 or n_found > 60


def test_edges_far_from_all_others_are_found_where_they_are():
    low = np.array([[0.0, 0.0, 0.0], [1e3, 0.0, 0.0], [0.0, -1e3, 1e3]])
    outward = np.zeros((3, 3))
    grid = new_edge_grid(3)
    fill(grid, low, low + NODE_SIZE, outward, np.zeros(3, np.int64))
    for i in range(3):
        box = box_at(low, low + NODE_SIZE, i)
        assert find_near_edges(grid, 5, box, Vec3(0.0, 0.0, 1.0), 0.5) == 1
        assert grid.found[0] == i
