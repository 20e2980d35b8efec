"""Boxes by the cells of a uniform grid that they reach into, in a hash table of linked lists.

Boxes are put in and taken out one by one, so that only those that changed cost anything.

Source: Teschner et al. (2003), Optimized spatial hashing for collision detection.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3

_MOST_CELLS = 8
"""Cells along an axis that a box is put into at most. A larger one is looked at by every search:
an element that is stretched so far is rare, and one of 100 cells would fill a million of them."""

N_ENTRIES, _FREE = 0, 1
"""Places in `Grid.state`."""


class Grid(Arrays):
    """The table."""

    first: IntArray
    """First entry of each bucket, or -1: a power of two of them, and last that of large boxes."""
    item: IntArray
    """The box of each entry, shape (capacity,)."""
    next: IntArray
    """The next entry of the same bucket, or -1; shape (capacity,)."""
    state: IntArray
    """How many entries were ever in use, and the first of those that are free; shape (2,)."""
    size: float
    """Edge of a cell [m]."""


class Box(NamedTuple):
    """An axis-aligned box."""

    low: Vec3
    high: Vec3


class _Cells(NamedTuple):
    """The cells from one to another."""

    i: int
    j: int
    k: int
    i_last: int
    j_last: int
    k_last: int


def new_grid(n_buckets: int, n_entries: int, size: float) -> Grid:
    """Return an empty table; `n_buckets` is a power of two, `size` the edge of a cell [m]."""
    return Grid(
        first=np.full(n_buckets + 1, -1, np.int64),
        item=np.zeros(n_entries, np.int64),
        next=np.zeros(n_entries, np.int64),
        state=np.array([0, -1], np.int64),
        size=size,
    )


@kernel
def clear_grid(grid: Grid) -> None:
    """Take out all."""
    for bucket in range(len(grid.first)):
        grid.first[bucket] = -1
    grid.state[N_ENTRIES] = 0
    grid.state[_FREE] = -1


@kernel
def _cells_of(grid: Grid, box: Box) -> _Cells:
    per_metre = 1.0 / grid.size
    return _Cells(
        math.floor(box.low.x * per_metre),
        math.floor(box.low.y * per_metre),
        math.floor(box.low.z * per_metre),
        math.floor(box.high.x * per_metre),
        math.floor(box.high.y * per_metre),
        math.floor(box.high.z * per_metre),
    )


@kernel
def _is_large(cells: _Cells) -> bool:
    return (
        cells.i_last - cells.i >= _MOST_CELLS
        or cells.j_last - cells.j >= _MOST_CELLS
        or cells.k_last - cells.k >= _MOST_CELLS
    )


@kernel
def _bucket_of(grid: Grid, i: int, j: int, k: int) -> int:
    return (i * 73856093 ^ j * 19349663 ^ k * 83492791) & (len(grid.first) - 2)


@kernel
def put(grid: Grid, item: int, box: Box) -> bool:
    """Put a box in; return False if there is no room."""
    cells = _cells_of(grid, box)
    if _is_large(cells):
        return _put(grid, item, len(grid.first) - 1)
    for i in range(cells.i, cells.i_last + 1):
        for j in range(cells.j, cells.j_last + 1):
            for k in range(cells.k, cells.k_last + 1):
                if not _put(grid, item, _bucket_of(grid, i, j, k)):
                    return False
    return True


@kernel
def _put(grid: Grid, item: int, bucket: int) -> bool:
    entry = grid.state[_FREE]
    if entry >= 0:
        grid.state[_FREE] = grid.next[entry]
    else:
        entry = grid.state[N_ENTRIES]
        if entry == len(grid.item):
            return False
        grid.state[N_ENTRIES] += 1
    grid.item[entry] = item
    grid.next[entry] = grid.first[bucket]
    grid.first[bucket] = entry
    return True


@kernel
def take(grid: Grid, item: int, box: Box) -> None:
    """Take a box out; `box` is what it was put in with."""
    cells = _cells_of(grid, box)
    if _is_large(cells):
        _take(grid, item, len(grid.first) - 1)
        return
    for i in range(cells.i, cells.i_last + 1):
        for j in range(cells.j, cells.j_last + 1):
            for k in range(cells.k, cells.k_last + 1):
                _take(grid, item, _bucket_of(grid, i, j, k))


@kernel
def _take(grid: Grid, item: int, bucket: int) -> None:
    """Take one entry of the box out of a bucket."""
    before = -1
    entry = grid.first[bucket]
    while entry >= 0 and grid.item[entry] != item:
        before = entry
        entry = grid.next[entry]
    if entry < 0:
        return
    if before < 0:
        grid.first[bucket] = grid.next[entry]
    else:
        grid.next[before] = grid.next[entry]
    grid.next[entry] = grid.state[_FREE]
    grid.state[_FREE] = entry


class Search(Arrays):
    """What a search found, and how it tells what it has seen."""

    found: IntArray
    """Boxes, shape (capacity,)."""
    stamp: IntArray
    """The search that found each box last, shape (capacity,)."""
    number: IntArray
    """Of the current search, shape (1,)."""


def new_search(n_items: int) -> Search:
    """Return no finds, with room for all of that many boxes."""
    return Search(
        found=np.zeros(n_items, np.int64),
        stamp=np.zeros(n_items, np.int64),
        number=np.zeros(1, np.int64),
    )


@kernel
def boxes_near(grid: Grid, search: Search, low: FloatArray, high: FloatArray, box: Box) -> int:
    """Write the boxes that overlap `box` to `search.found`, each once; return how many there are.

    Args:
        grid: The table.
        search: Written.
        low: Lowest corner of each box [m], shape (n_items, 3).
        high: Highest corner.
        box: Where to look.
    """
    search.number[0] += 1
    n = _look(grid, search, low, high, box, len(grid.first) - 1, 0)
    cells = _cells_of(grid, box)
    if _is_large(cells):
        for bucket in range(len(grid.first) - 1):
            n = _look(grid, search, low, high, box, bucket, n)
        return n
    for i in range(cells.i, cells.i_last + 1):
        for j in range(cells.j, cells.j_last + 1):
            for k in range(cells.k, cells.k_last + 1):
                n = _look(grid, search, low, high, box, _bucket_of(grid, i, j, k), n)
    return n


@kernel
def _look(
    grid: Grid,
    search: Search,
    low: FloatArray,
    high: FloatArray,
    box: Box,
    bucket: int,
    n: int,
) -> int:
    """Go through one bucket; `n` boxes were found before, return how many now."""
    number = search.number[0]
    entry = grid.first[bucket]
    while entry >= 0:
        item = grid.item[entry]
        entry = grid.next[entry]
        if (
            low[item, 0] <= box.high.x
            and box.low.x <= high[item, 0]
            and low[item, 1] <= box.high.y
            and box.low.y <= high[item, 1]
            and low[item, 2] <= box.high.z
            and box.low.z <= high[item, 2]
            and search.stamp[item] != number
        ):
            search.stamp[item] = number
            search.found[n] = item
            n += 1
    return n
