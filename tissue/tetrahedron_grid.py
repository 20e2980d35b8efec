"""A grid of cells that lists the tetrahedra near each: where a point is, without asking them all.

It is built from the boxes of all tetrahedra, widened by a margin, and stays right until a node has
moved by more than that. Tetrahedra that a cut appends are not in it: they are few, and asked all.
"""

import numpy as np

from tissue.arrays import Arrays
from tissue.body import NODES, TETRAHEDRA, Body
from tissue.geometry import barycentric_in, smallest_weight
from tissue.jit import kernel
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3

TETRAHEDRA_PER_CELL = 4.0
"""Cells are so large that the body fills this many tetrahedra a cell on average. Fewer make long
lists of cells, more make long lists in each."""

MOST_CELLS = 1 << 20
"""Cells at most, for a body that fills little of its box."""

MOST_APPENDED = 512
"""Appended tetrahedra after which the grid is built anew; asking them all takes some 2 us."""


class TetrahedronGrid(Arrays):
    """Lists of tetrahedra, one a cell."""

    origin: FloatArray
    """Lowest corner [m], shape (3,)."""
    spacing: float
    """Edge of a cell [m]."""
    shape: IntArray
    """Cells along each axis, shape (3,)."""
    first: IntArray
    """Where each cell's list begins in `items`, and where the last one ends; (n_cells + 1,)."""
    items: IntArray
    """Tetrahedra, cell after cell."""
    n_tetrahedra: IntArray
    """How many tetrahedra there were, shape (1,)."""
    positions: FloatArray
    """Where the nodes were [m], shape (n_nodes, 3)."""
    margin: float
    """By how much the boxes were widened [m]."""


def no_grid() -> TetrahedronGrid:
    """Return a grid that lists nothing."""
    return TetrahedronGrid(
        origin=np.zeros(3),
        spacing=1.0,
        shape=np.zeros(3, np.int64),
        first=np.zeros(1, np.int64),
        items=np.zeros(0, np.int64),
        n_tetrahedra=np.zeros(1, np.int64),
        positions=np.zeros((0, 3)),
        margin=0.0,
    )


def build_grid(body: Body, positions: FloatArray, margin: float) -> TetrahedronGrid:
    """Return the grid of all tetrahedra at `positions` [m], widened by `margin` [m]."""
    n_nodes, n_tetrahedra = int(body.counts[NODES]), int(body.counts[TETRAHEDRA])
    positions = positions[:n_nodes].copy()
    low = positions.min(axis=0) - margin
    size = positions.max(axis=0) + margin - low
    n_cells = min(max(n_tetrahedra / TETRAHEDRA_PER_CELL, 1.0), MOST_CELLS)
    spacing = float(max(np.cbrt(size.prod() / n_cells), size.max() / n_cells))
    shape = np.floor(size / spacing).astype(np.int64) + 1
    grid = no_grid().replaced(
        origin=low,
        spacing=spacing,
        shape=shape,
        first=np.zeros(int(shape.prod()) + 1, np.int64),
        n_tetrahedra=np.array([n_tetrahedra]),
        positions=positions,
        margin=margin,
    )
    grid = grid.replaced(items=np.empty(count_items(body, grid), np.int64))
    fill_items(body, grid)
    return grid


@kernel
def _extent(body: Body, positions: FloatArray, t: int, c: int) -> tuple[float, float]:
    """Least and greatest coordinate along axis `c` of tetrahedron `t` [m]."""
    p = positions[body.tetrahedra[t, 0], c]
    q = positions[body.tetrahedra[t, 1], c]
    r = positions[body.tetrahedra[t, 2], c]
    s = positions[body.tetrahedra[t, 3], c]
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@kernel
def _cell_range(body: Body, grid: TetrahedronGrid, t: int, c: int) -> tuple[int, int]:
    """First and last cell along axis `c` that the widened box of tetrahedron `t` meets."""
    low, high = _extent(body, grid.positions, t, c)
    return _cells_between(grid, low - grid.margin, high + grid.margin, c)


@kernel
def count_items(body: Body, grid: TetrahedronGrid) -> int:
    """Write where each cell's list will end to `grid.first`; return the length of all lists."""
    first = grid.first
    for i in range(len(first)):
        first[i] = 0
    for t in range(grid.n_tetrahedra[0]):
        x0, x1 = _cell_range(body, grid, t, 0)
        y0, y1 = _cell_range(body, grid, t, 1)
        z0, z1 = _cell_range(body, grid, t, 2)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                for k in range(z0, z1 + 1):
                    first[(i * grid.shape[1] + j) * grid.shape[2] + k] += 1
    total = 0
    for i in range(len(first)):
        total += first[i]
        first[i] = total
    return total


@kernel
def fill_items(body: Body, grid: TetrahedronGrid) -> None:
    """Write the lists; `grid.first`, where they end so far, becomes where they begin."""
    first = grid.first
    for back in range(grid.n_tetrahedra[0]):
        t = grid.n_tetrahedra[0] - 1 - back
        x0, x1 = _cell_range(body, grid, t, 0)
        y0, y1 = _cell_range(body, grid, t, 1)
        z0, z1 = _cell_range(body, grid, t, 2)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                for k in range(z0, z1 + 1):
                    cell = (i * grid.shape[1] + j) * grid.shape[2] + k
                    first[cell] -= 1
                    grid.items[first[cell]] = t


@kernel
def cell_of(grid: TetrahedronGrid, p: Vec3) -> int:
    """The cell that holds `p` [m], or -1 outside the grid."""
    x = (p.x - grid.origin[0]) / grid.spacing
    y = (p.y - grid.origin[1]) / grid.spacing
    z = (p.z - grid.origin[2]) / grid.spacing
    if not (0.0 <= x < grid.shape[0] and 0.0 <= y < grid.shape[1] and 0.0 <= z < grid.shape[2]):
        return -1
    return (int(x) * grid.shape[1] + int(y)) * grid.shape[2] + int(z)


@kernel
def tetrahedron_at(body: Body, grid: TetrahedronGrid, positions: FloatArray, p: Vec3) -> int:
    """The first tetrahedron that holds `p` [m], its nodes at `positions` [m]; -1 if none does.

    The order is that of their numbers, so that a point on a face between two is always found in
    the same one.
    """
    cell = cell_of(grid, p)
    if cell >= 0:
        for i in range(grid.first[cell], grid.first[cell + 1]):
            w = barycentric_in(p, positions, body.tetrahedra, grid.items[i])
            if smallest_weight(w) >= 0.0:
                return grid.items[i]
    for t in range(grid.n_tetrahedra[0], body.counts[TETRAHEDRA]):
        if smallest_weight(barycentric_in(p, positions, body.tetrahedra, t)) >= 0.0:
            return t
    return -1


@kernel
def tetrahedron_in_box(
    body: Body, grid: TetrahedronGrid, positions: FloatArray, low: Vec3, high: Vec3
) -> int:
    """The first tetrahedron whose box meets that from `low` to `high` [m]; -1 if none does."""
    x0, x1 = _cells_between(grid, low.x, high.x, 0)
    y0, y1 = _cells_between(grid, low.y, high.y, 1)
    z0, z1 = _cells_between(grid, low.z, high.z, 2)
    for i in range(x0, x1 + 1):
        for j in range(y0, y1 + 1):
            for k in range(z0, z1 + 1):
                cell = (i * grid.shape[1] + j) * grid.shape[2] + k
                for at in range(grid.first[cell], grid.first[cell + 1]):
                    if _meets_box(body, positions, grid.items[at], low, high):
                        return grid.items[at]
    return -1


@kernel
def _cells_between(grid: TetrahedronGrid, low: float, high: float, c: int) -> tuple[int, int]:
    """First and last cell along axis `c` between two coordinates [m]."""
    last = grid.shape[c] - 1
    first = np.floor((low - grid.origin[c]) / grid.spacing)
    final = np.floor((high - grid.origin[c]) / grid.spacing)
    return int(max(first, 0.0)), int(min(final, float(last)))


@kernel
def _meets_box(body: Body, positions: FloatArray, t: int, low: Vec3, high: Vec3) -> bool:
    for c in range(3):
        smallest, largest = _extent(body, positions, t, c)
        if smallest > high[c] or largest < low[c]:
            return False
    return True
