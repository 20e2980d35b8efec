"""Boxes by the cells of a uniform grid that they reach into, in a hash table.

The table is built anew each time, by counting: no lists, no allocation, and always the same order.

Source: Teschner et al. (2003), Optimized spatial hashing for collision detection.
"""

import math

import numpy as np

from tissue.arrays import Arrays
from tissue.jit import kernel
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3


class Grid(Arrays):
    """The table."""

    first: IntArray
    """Where in `item` each bucket begins, shape (n_buckets + 1,); n_buckets is a power of two."""
    item: IntArray
    """Boxes, bucket by bucket; shape (capacity,)."""
    last: IntArray
    """Scratch: the box that each bucket got last, shape (n_buckets,)."""
    next: IntArray
    """Scratch: where each bucket goes on, shape (n_buckets,)."""


def new_grid(n_buckets: int, n_items: int) -> Grid:
    """Return an empty table; `n_buckets` is a power of two."""
    return Grid(
        first=np.zeros(n_buckets + 1, np.int64),
        item=np.zeros(n_items, np.int64),
        last=np.zeros(n_buckets, np.int64),
        next=np.zeros(n_buckets, np.int64),
    )


@kernel
def cell_of(x: float, size: float) -> int:
    """Number of the cell in which a coordinate lies, along its axis."""
    return math.floor(x / size)


@kernel
def bucket_of(grid: Grid, i: int, j: int, k: int) -> int:
    """Bucket of a cell."""
    return (i * 73856093 ^ j * 19349663 ^ k * 83492791) & (len(grid.last) - 1)


@kernel
def cell_size(low: FloatArray, high: FloatArray, n: int) -> float:
    """Mean of the largest edges of the first `n` boxes [m]: a box reaches into some eight cells.

    At least an eighth of the largest of all, so that no box reaches into more than 9 x 9 x 9.
    """
    total = 0.0
    largest = 0.0
    for i in range(n):
        extent = max(high[i, 0] - low[i, 0], max(high[i, 1] - low[i, 1], high[i, 2] - low[i, 2]))
        total += extent
        largest = max(largest, extent)
    return max(total / max(n, 1), largest / 8.0)


@kernel
def fill_grid(grid: Grid, low: FloatArray, high: FloatArray, n: int, size: float) -> bool:
    """Put the first `n` boxes into cells of that size [m]; return False if there is no room.

    A box comes at most once in a bucket, and boxes come in order.
    """
    n_buckets = len(grid.last)
    for b in range(n_buckets + 1):
        grid.first[b] = 0
    for b in range(n_buckets):
        grid.last[b] = -1
    for box in range(n):
        _put(grid, low, high, box, size, True)
    for b in range(n_buckets):
        grid.first[b + 1] += grid.first[b]
        grid.last[b] = -1
        grid.next[b] = grid.first[b]
    if grid.first[n_buckets] > len(grid.item):
        return False
    for box in range(n):
        _put(grid, low, high, box, size, False)
    return True


@kernel
def _put(
    grid: Grid, low: FloatArray, high: FloatArray, box: int, size: float, only_count: bool
) -> None:
    for i in range(cell_of(low[box, 0], size), cell_of(high[box, 0], size) + 1):
        for j in range(cell_of(low[box, 1], size), cell_of(high[box, 1], size) + 1):
            for k in range(cell_of(low[box, 2], size), cell_of(high[box, 2], size) + 1):
                b = bucket_of(grid, i, j, k)
                if grid.last[b] == box:
                    continue
                grid.last[b] = box
                if only_count:
                    grid.first[b + 1] += 1
                else:
                    grid.item[grid.next[b]] = box
                    grid.next[b] += 1


@kernel
def holds(low: FloatArray, high: FloatArray, box: int, p: Vec3) -> bool:
    """Whether point `p` is in the box."""
    return (
        low[box, 0] <= p.x <= high[box, 0]
        and low[box, 1] <= p.y <= high[box, 1]
        and low[box, 2] <= p.z <= high[box, 2]
    )


@kernel
def overlap(low: FloatArray, high: FloatArray, a: int, b: int) -> bool:
    """Whether two boxes do."""
    return (
        low[a, 0] <= high[b, 0]
        and low[b, 0] <= high[a, 0]
        and low[a, 1] <= high[b, 1]
        and low[b, 1] <= high[a, 1]
        and low[a, 2] <= high[b, 2]
        and low[b, 2] <= high[a, 2]
    )
