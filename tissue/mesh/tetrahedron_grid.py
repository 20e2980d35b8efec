"""A grid of cells that list the tetrahedra of a body, for point location.

Each tetrahedron is listed in a box of cells: those that its own box overlaps, widened by a margin.
While its nodes stay in that box of cells, whatever point it holds is in one of them. So each node
has a box of its own, that of the cells in which all tetrahedra around it are listed; where it has
left that, they are listed again where they are now, in the cells in which they were not listed
before. Stale entries cost a test, never a wrong answer. So the cost of a step is one pass over the
nodes that moved, and listing the tetrahedra around those that left their box.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH
from tissue.core.simd_rows import larger_bits, rows_of_three
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import vec3
from tissue.geometry.aabb import tetrahedron_box, widened
from tissue.mesh.body import Body
from tissue.mesh.star import Visits, star

TETRAHEDRA_PER_CELL = 4.0
"""Tetrahedra that a cell holds on average. Fewer make more cells for each tetrahedron, more make
longer lists in each cell."""

_MOST_CELLS = 1 << 20
"""Cells at most, for a body that fills little of its box."""

ENTRIES_PER_TETRAHEDRON = 24
"""Room for entries. A tetrahedron of the organ is listed in 12 to 15 cells with its margin; when
the room is used up the grid is built again, which takes a millisecond. Less: what moves uses it up
within some frames; more: the lists become long with stale entries."""

LEAST_ENTRIES = 1 << 14
"""Room for entries at least."""

TETRAHEDRA_PER_LINE = 15
"""Tetrahedra in a line of a list, which with the number of the next line fills a cache line. As a
list of single entries each of them took 45 ns to read, for two lines of the cache."""

LOGGED = 256
"""Tetrahedra that `TetrahedronGrid.log` has room for."""

_INSIDE = 1e-6
"""Distance of the limits for a node within a cell, per spacing: more than any rounding."""


class TetrahedronGrid(Arrays):
    """Lists of tetrahedra, one for each cell."""

    origin: FloatArray
    """Lowest corner [m], shape (3,)."""
    spacing: float
    """Edge of a cell [m]."""
    shape: IntArray
    """Number of cells along each axis, shape (3,). Cells on the rim reach to infinity."""
    head: IntArray
    """First line of each cell's list, -1 if it is empty, and how many tetrahedra are in it; shape
    (n_cells, 2)."""
    lines: SlotArray = sized("lines", 1 + TETRAHEDRA_PER_LINE, is_for_vectors=True)
    """The next line of the same list, -1 at its end, and tetrahedra. Lines behind the first one of
    a list are full. Shape (room, 1 + TETRAHEDRA_PER_LINE)."""
    n_lines: IntCell
    """Number of lines in all lists."""
    n_listed: IntCell
    """Number of tetrahedra listed: 0 to `n_listed` - 1."""
    n_logged: IntCell
    """Number of tetrahedra listed in other cells than before since `log` was read; there may be
    more than `log` has room for."""
    log: SlotArray = sized(LOGGED)
    """These tetrahedra, shape (LOGGED,)."""
    cells: SlotArray = sized("tetrahedra", 6)
    """First cell along each axis in which each tetrahedron was listed last, then the last one;
    shape (tetrahedron capacity, 6). The last is before the first where it was not listed yet."""
    low: FloatArray = sized("nodes", 3, fill=np.inf)
    """Lowest corner of the box that each node may move in [m], shape (node capacity, 3)."""
    high: FloatArray = sized("nodes", 3, fill=-np.inf)
    """Highest corner [m], shape (node capacity, 3); below the lowest one for new nodes."""
    margin: float
    """Distance by which the boxes of tetrahedra are widened [m]."""


def no_grid() -> TetrahedronGrid:
    """Return a grid that lists nothing."""
    return _empty_grid(np.zeros(3), 1.0, np.ones(3, np.int64), 0, (0, 0), 0.0)


def _empty_grid(
    origin: FloatArray,
    spacing: float,
    shape: IntArray,
    n_lines: int,
    capacity: tuple[int, int],
    margin: float,
) -> TetrahedronGrid:
    """Return a grid that lists nothing yet, for that many nodes and tetrahedra."""
    n_nodes, n_tetrahedra = capacity
    grid = TetrahedronGrid.new(
        {"nodes": n_nodes, "tetrahedra": n_tetrahedra, "lines": n_lines},
        origin=origin,
        spacing=spacing,
        shape=shape,
        head=np.tile([-1, TETRAHEDRA_PER_LINE], (int(shape.prod()), 1)),
        margin=margin,
    )
    grid.cells[:, 3:] = -1
    return grid


def build_grid(body: Body, positions: FloatArray, margin: float) -> TetrahedronGrid:
    """Return the grid of all tetrahedra at `positions` [m], widened by `margin` [m]."""
    n_nodes, n_tetrahedra = body.n_nodes, body.n_tetrahedra
    low = positions[:n_nodes].min(axis=0) - margin
    size = positions[:n_nodes].max(axis=0) + margin - low
    most = min(max(n_tetrahedra / TETRAHEDRA_PER_CELL, 1.0), _MOST_CELLS)
    spacing = float(max(np.cbrt(size.prod() / most), size.max() / most))
    shape = np.floor(size / spacing).astype(np.int64) + 1
    n_cells = int(shape.prod())
    room = max(ENTRIES_PER_TETRAHEDRON * n_tetrahedra, LEAST_ENTRIES)
    capacity = len(positions), len(body.tetrahedra)
    while True:
        n_lines = n_cells + room // TETRAHEDRA_PER_LINE
        grid = _empty_grid(low, spacing, shape, n_lines, capacity, margin)
        grid.low[:n_nodes], grid.high[:n_nodes] = -np.inf, np.inf
        if list_appended(body, positions, grid):
            return grid
        room *= 2


@kernel
def fits(grid: TetrahedronGrid, body: Body) -> bool:
    """Return whether the grid has room for all nodes and tetrahedra that the body has room for."""
    n_nodes, n_tetrahedra = len(body.positions), len(body.tetrahedra)
    return len(grid.low) == n_nodes and len(grid.cells) == n_tetrahedra


@kernel
def list_appended(body: Body, positions: FloatArray, grid: TetrahedronGrid) -> bool:
    """List the tetrahedra that were appended since the last call; return whether there was room.

    There is none for a body whose arrays have grown since the grid was built.
    """
    if not fits(grid, body):
        return False
    while grid.n_listed < body.n_tetrahedra:
        if not _list_tetrahedron(body, positions, grid, grid.n_listed):
            return False
        grid.n_listed += 1
    return True


@kernel
def list_moved(
    body: Body,
    visits: Visits,
    grid: TetrahedronGrid,
    nodes: IntArray,
    n_nodes: int,
    around: IntArray,
) -> bool:
    """List the tetrahedra around nodes that left their box again; return whether there was room.

    Args:
        body: The body now.
        visits: For searches.
        grid: Written.
        nodes: Nodes, of which the first `n_nodes` are all that moved since the last call.
        n_nodes: How many these are.
        around: Scratch, shape (LARGEST_STAR,).
    """
    x = body.positions
    are_all = n_nodes == body.n_nodes  # each is listed once
    i = 0
    while i < n_nodes:
        if are_all and i + WIDTH <= n_nodes and _eight_stayed(grid, x, i):
            i += WIDTH
            continue
        node = i if are_all else nodes[i]
        i += 1
        if _stayed(grid, x, node):
            continue
        n = star(body, visits, node, body.node_tetrahedron[node], around)
        for k in range(n):
            if not _list_tetrahedron(body, x, grid, around[k]):
                return False
        for c in range(3):
            grid.low[node, c], grid.high[node, c] = -np.inf, np.inf
        for k in range(n):
            _hold_node(grid, node, around[k])
    return True


@inlined
def _eight_stayed(grid: TetrahedronGrid, x: FloatArray, i: int) -> bool:
    """Return whether eight nodes from `i` on are in their boxes."""
    x0, y0, z0 = rows_of_three(grid.low, i)
    x1, y1, z1 = rows_of_three(grid.high, i)
    px, py, pz = rows_of_three(x, i)
    below = larger_bits(x0, px) | larger_bits(y0, py) | larger_bits(z0, pz)
    above = larger_bits(px, x1) | larger_bits(py, y1) | larger_bits(pz, z1)
    return below | above == 0


@inlined
def _stayed(grid: TetrahedronGrid, x: FloatArray, node: int) -> bool:
    """Return whether a node is in its box."""
    p, low, high = vec3(x, node), vec3(grid.low, node), vec3(grid.high, node)
    below = low.x > p.x or low.y > p.y or low.z > p.z
    return not (below or p.x > high.x or p.y > high.y or p.z > high.z)


@inlined
def _hold_node(grid: TetrahedronGrid, node: int, t: int) -> None:
    """Hold a node in the cells in which tetrahedron `t` around it is listed."""
    cells, inside = grid.cells, _INSIDE * grid.spacing
    for c in range(3):
        if cells[t, c] > 0:
            low = grid.origin[c] + cells[t, c] * grid.spacing + inside
            grid.low[node, c] = max(grid.low[node, c], low)
        if cells[t, 3 + c] < grid.shape[c] - 1:
            high = grid.origin[c] + (cells[t, 3 + c] + 1) * grid.spacing - inside
            grid.high[node, c] = min(grid.high[node, c], high)


@kernel
def _list_tetrahedron(body: Body, positions: FloatArray, grid: TetrahedronGrid, t: int) -> bool:
    """List a tetrahedron where it is and was not listed last; return whether there was room."""
    box = widened(tetrahedron_box(positions, body.tetrahedra, t), grid.margin)
    x0, x1 = cell_along(grid, box.low.x, 0), cell_along(grid, box.high.x, 0)
    y0, y1 = cell_along(grid, box.low.y, 1), cell_along(grid, box.high.y, 1)
    z0, z1 = cell_along(grid, box.low.z, 2), cell_along(grid, box.high.z, 2)
    if _is_listed_in(grid, t, x0, y0, z0) and _is_listed_in(grid, t, x1, y1, z1):
        return True  # and in all cells between
    if grid.n_lines + (x1 - x0 + 1) * (y1 - y0 + 1) * (z1 - z0 + 1) > len(grid.lines):
        return False
    for i in range(x0, x1 + 1):
        for j in range(y0, y1 + 1):
            for k in range(z0, z1 + 1):
                if not _is_listed_in(grid, t, i, j, k):
                    _add_to_cell(grid, (i * grid.shape[1] + j) * grid.shape[2] + k, t)
    grid.cells[t, 0], grid.cells[t, 1], grid.cells[t, 2] = x0, y0, z0
    grid.cells[t, 3], grid.cells[t, 4], grid.cells[t, 5] = x1, y1, z1
    for k in range(4):
        _hold_node(grid, body.tetrahedra[t, k], t)
    if grid.n_logged < len(grid.log):
        grid.log[grid.n_logged] = t
    grid.n_logged += 1
    return True


@kernel
def _add_to_cell(grid: TetrahedronGrid, cell: int, t: int) -> None:
    """Add a tetrahedron to the list of a cell."""
    head = grid.head
    if head[cell, 1] == TETRAHEDRA_PER_LINE:
        grid.lines[grid.n_lines, 0] = head[cell, 0]
        head[cell, 0], head[cell, 1] = grid.n_lines, 0
        grid.n_lines += 1
    head[cell, 1] += 1
    grid.lines[head[cell, 0], head[cell, 1]] = t


@kernel
def _is_listed_in(grid: TetrahedronGrid, t: int, i: int, j: int, k: int) -> bool:
    """Return whether a tetrahedron was listed last in that cell, among others."""
    cells = grid.cells
    return bool(
        cells[t, 0] <= i <= cells[t, 3]
        and cells[t, 1] <= j <= cells[t, 4]
        and cells[t, 2] <= k <= cells[t, 5]
    )


@kernel
def cell_along(grid: TetrahedronGrid, coordinate: float, c: int) -> int:
    """Return the cell along axis `c` that holds a coordinate [m]."""
    cell = (coordinate - grid.origin[c]) / grid.spacing
    return int(min(max(cell, 0.0), grid.shape[c] - 1.0))
