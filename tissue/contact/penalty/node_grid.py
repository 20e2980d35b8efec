"""Nodes by the cells of a grid: each node is entered once, and whoever asks, asks with a box.

The table is made anew for each update of the pairs, by counting: a tenth of what the asking takes.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.contact.penalty.node_ways import BALL, NodeWays
from tissue.core.array_types import IntArray
from tissue.core.hash_table import hash_of
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import vec3
from tissue.geometry.aabb import Aabb, widened

_CELL = 1.25
"""Edge of a cell, per node size. Larger: more nodes are tested in each; smaller: a face asks more
cells."""

LONGEST = 8
"""Cells along an axis that are asked one by one; a longer box asks all nodes."""

_LEAST_BUCKETS = 64
"""Buckets that are in use at least."""


class NodeGrid(Arrays):
    """The table of cells."""

    n_entries: IntCell
    """Number of entries."""
    n_buckets: IntCell
    """Number of buckets in use: a power of two, twice the nodes or more."""
    begin: IntArray
    """First entry of each bucket, and behind the last one: shape (buckets + 2,)."""
    entry: IntArray
    """Nodes by their buckets, shape (capacity,)."""


class Cells(NamedTuple):
    """The cells from a lowest to a highest."""

    i: int
    j: int
    k: int
    i_last: int
    j_last: int
    k_last: int


def new_node_grid(capacity: int) -> NodeGrid:
    """Return an empty table with room for that many entries."""
    buckets = 1 << (capacity - 1).bit_length()
    begin, entry = np.zeros(buckets + 2, np.int64), np.zeros(capacity, np.int64)
    return NodeGrid(n_entries=0, n_buckets=buckets, begin=begin, entry=entry)


@kernel
def fill_node_grid(grid: NodeGrid, ways: NodeWays, nodes: IntArray, n: int) -> bool:
    """Enter the first `n` of `nodes` by their references; return False if there is no room.

    A node whose ball is larger than that of a slow one is entered in all cells which that reaches.
    """
    begin = grid.begin
    grid.n_buckets = len(begin) - 2
    while grid.n_buckets > _LEAST_BUCKETS and grid.n_buckets >= 4 * n:
        grid.n_buckets //= 2
    for bucket in range(grid.n_buckets + 2):
        begin[bucket] = 0
    for i in range(n):
        cells = _cells_of_node(ways, nodes[i])
        for a in range(cells.i, cells.i_last + 1):
            for b in range(cells.j, cells.j_last + 1):
                for c in range(cells.k, cells.k_last + 1):
                    begin[bucket_of(grid, a, b, c) + 2] += 1
    for bucket in range(2, grid.n_buckets + 2):
        begin[bucket] += begin[bucket - 1]
    grid.n_entries = begin[grid.n_buckets + 1]
    if grid.n_entries > len(grid.entry):
        return False
    for i in range(n):
        cells = _cells_of_node(ways, nodes[i])
        for a in range(cells.i, cells.i_last + 1):
            for b in range(cells.j, cells.j_last + 1):
                for c in range(cells.k, cells.k_last + 1):
                    bucket = bucket_of(grid, a, b, c)
                    grid.entry[begin[bucket + 1]] = nodes[i]
                    begin[bucket + 1] += 1
    return True


@kernel
def cells_of_box(ways: NodeWays, box: Aabb) -> Cells:
    """Return the cells that a box overlaps."""
    per_metre = 1.0 / (_CELL * ways.node_size)
    return Cells(
        math.floor(box.low.x * per_metre),
        math.floor(box.low.y * per_metre),
        math.floor(box.low.z * per_metre),
        math.floor(box.high.x * per_metre),
        math.floor(box.high.y * per_metre),
        math.floor(box.high.z * per_metre),
    )


@kernel
def bucket_of(grid: NodeGrid, i: int, j: int, k: int) -> int:
    """Return the bucket of a cell."""
    return hash_of(i, j, k, 0) & (grid.n_buckets - 1)


@kernel
def _cells_of_node(ways: NodeWays, node: int) -> Cells:
    """Return the cells that a node is entered in."""
    p = vec3(ways.reference, node)
    more = max(ways.radius[node] - BALL * ways.node_size, 0.0)
    return cells_of_box(ways, widened(Aabb(p, p), more))
