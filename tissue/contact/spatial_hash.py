"""Boxes by the cells of a uniform grid that they overlap, in a hash table of linked lists.

Boxes are inserted and removed one by one, so that only those that changed cost time.

Source: Teschner et al. (2003), Optimized spatial hashing for collision detection.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.hash_table import hash_of
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.geometry.aabb import Aabb, box_at, overlap

_LONGEST = 8
"""Cells along an axis that a box is inserted into at most. A longer box is tested by every search:
an element that is stretched so far is rare, and one of 100 cells would fill a million of them."""


class Grid(Arrays):
    """The table of cells."""

    n_entries: IntCell
    """Number of entries that were ever in use."""
    free: IntCell
    """First of the free entries, which are linked by `next`; -1 if there is none."""
    first: IntArray
    """First entry of each bucket, or -1: a power of two of them, and last that of long boxes."""
    item: IntArray
    """Box of each entry, shape (capacity,)."""
    next: IntArray
    """Next entry of the same bucket, or -1; shape (capacity,)."""
    size: float
    """Edge of a cell [m]."""


class _Cells(NamedTuple):
    """The cells from a lowest to a highest."""

    i: int
    j: int
    k: int
    i_last: int
    j_last: int
    k_last: int


def new_grid(n_buckets: int, n_entries: int, size: float) -> Grid:
    """Return an empty table; `n_buckets` is a power of two, `size` the edge of a cell [m]."""
    return Grid(
        n_entries=0,
        free=-1,
        first=np.full(n_buckets + 1, -1, np.int64),
        item=np.zeros(n_entries, np.int64),
        next=np.zeros(n_entries, np.int64),
        size=size,
    )


@kernel
def clear_grid(grid: Grid) -> None:
    """Remove all boxes."""
    for bucket in range(len(grid.first)):
        grid.first[bucket] = -1
    grid.n_entries = 0
    grid.free = -1


@kernel
def _cells_of(grid: Grid, box: Aabb) -> _Cells:
    """Return the cells that a box overlaps."""
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
def _are_long(cells: _Cells) -> bool:
    """Whether cells are too many along an axis for a box to be inserted into each."""
    return (
        cells.i_last - cells.i >= _LONGEST
        or cells.j_last - cells.j >= _LONGEST
        or cells.k_last - cells.k >= _LONGEST
    )


@kernel
def _bucket_of(grid: Grid, i: int, j: int, k: int) -> int:
    """Return the bucket of a cell."""
    return hash_of(i, j, k, 0) & (len(grid.first) - 2)


@kernel
def insert_box(grid: Grid, item: int, box: Aabb) -> bool:
    """Insert a box; return False if there is no room."""
    cells = _cells_of(grid, box)
    if _are_long(cells):
        return _insert(grid, item, len(grid.first) - 1)
    for i in range(cells.i, cells.i_last + 1):
        for j in range(cells.j, cells.j_last + 1):
            for k in range(cells.k, cells.k_last + 1):
                if not _insert(grid, item, _bucket_of(grid, i, j, k)):
                    return False
    return True


@kernel
def _insert(grid: Grid, item: int, bucket: int) -> bool:
    """Insert a box into a bucket; return False if there is no room."""
    entry = grid.free
    if entry >= 0:
        grid.free = grid.next[entry]
    else:
        entry = grid.n_entries
        if entry == len(grid.item):
            return False
        grid.n_entries += 1
    grid.item[entry] = item
    grid.next[entry] = grid.first[bucket]
    grid.first[bucket] = entry
    return True


@kernel
def remove_box(grid: Grid, item: int, box: Aabb) -> None:
    """Remove a box; `box` is as it was when it was inserted."""
    cells = _cells_of(grid, box)
    if _are_long(cells):
        _remove(grid, item, len(grid.first) - 1)
        return
    for i in range(cells.i, cells.i_last + 1):
        for j in range(cells.j, cells.j_last + 1):
            for k in range(cells.k, cells.k_last + 1):
                _remove(grid, item, _bucket_of(grid, i, j, k))


@kernel
def _remove(grid: Grid, item: int, bucket: int) -> None:
    """Remove one entry of a box from a bucket."""
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
    grid.next[entry] = grid.free
    grid.free = entry


class Search(Arrays):
    """What a search found, and which boxes it has seen."""

    number: IntCell
    """Number of the current search."""
    found: IntArray
    """Boxes found, shape (capacity,)."""
    stamp: IntArray
    """Number of the search that found each box last, shape (capacity,)."""


def new_search(n_items: int) -> Search:
    """Return a search that found nothing, with room for `n_items` boxes."""
    return Search(number=0, found=np.zeros(n_items, np.int64), stamp=np.zeros(n_items, np.int64))


@kernel
def find_overlaps(grid: Grid, search: Search, low: FloatArray, high: FloatArray, box: Aabb) -> int:
    """Write the boxes that overlap `box` to `search.found`, each once; return how many there are.

    Args:
        grid: The table.
        search: Written.
        low: Lowest corner of each box [m], shape (n_items, 3).
        high: Highest corner of each box [m], shape (n_items, 3).
        box: Where to search.
    """
    search.number += 1
    n = _search_bucket(grid, search, low, high, box, len(grid.first) - 1, 0)
    cells = _cells_of(grid, box)
    if _are_long(cells):
        for bucket in range(len(grid.first) - 1):
            n = _search_bucket(grid, search, low, high, box, bucket, n)
        return n
    for i in range(cells.i, cells.i_last + 1):
        for j in range(cells.j, cells.j_last + 1):
            for k in range(cells.k, cells.k_last + 1):
                n = _search_bucket(grid, search, low, high, box, _bucket_of(grid, i, j, k), n)
    return n


@kernel
def _search_bucket(
    grid: Grid,
    search: Search,
    low: FloatArray,
    high: FloatArray,
    box: Aabb,
    bucket: int,
    n: int,
) -> int:
    """Test the boxes of one bucket; `n` were found before, return how many are now."""
    number = search.number
    entry = grid.first[bucket]
    while entry >= 0:
        item = grid.item[entry]
        entry = grid.next[entry]
        if overlap(box_at(low, high, item), box) and search.stamp[item] != number:
            search.stamp[item] = number
            search.found[n] = item
            n += 1
    return n
