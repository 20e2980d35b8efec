"""Point location: which tetrahedron holds a point, by a grid of cells that list tetrahedra.

Each tetrahedron is listed in the cells that its box overlaps, widened by a margin. Where a node has
moved further than the margin, the tetrahedra around it are listed again where they are now, in the
cells in which they were not listed before. Stale entries cost a test, never a wrong answer. So the
cost of a step is one pass over the nodes that moved, and listing the tetrahedra around those that
moved far.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3
from tissue.geometry.aabb import Aabb, overlap, tetrahedron_box, widened
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import Body
from tissue.mesh.star import Visits, star

TETRAHEDRA_PER_CELL = 4.0
"""Tetrahedra that a cell holds on average. Fewer make more cells for each tetrahedron, more make
longer lists in each cell."""

_MOST_CELLS = 1 << 20
"""Cells at most, for a body that fills little of its box."""

ENTRIES_PER_TETRAHEDRON = 24
"""Room for entries. A tetrahedron of the organ overlaps 12 to 15 cells with its margin; when the
room is used up the grid is built again, which takes a millisecond. Less: what moves uses it up
within some frames; more: the lists become long with stale entries."""

LEAST_ENTRIES = 1 << 14
"""Room for entries at least."""


class TetrahedronGrid(Arrays):
    """Linked lists of tetrahedra, one for each cell."""

    origin: FloatArray
    """Lowest corner [m], shape (3,)."""
    spacing: float
    """Edge of a cell [m]."""
    shape: IntArray
    """Number of cells along each axis, shape (3,). Cells on the rim reach to infinity."""
    head: IntArray
    """First entry of each cell's list, -1 if it is empty; shape (n_cells,)."""
    following: SlotArray
    """The next entry of the same list, -1 at its end; shape (room,)."""
    entry: SlotArray
    """Tetrahedron of each entry, shape (room,)."""
    n_listed: IntCell
    """Number of tetrahedra listed: 0 to `n_listed` - 1."""
    n_entries: IntCell
    """Number of entries in all lists."""
    cells: SlotArray
    """First cell along each axis in which each tetrahedron was listed last, then the last one;
    shape (tetrahedron capacity, 6). The last is before the first where it was not listed yet."""
    listed_at: FloatArray
    """Where each node was when its tetrahedra were listed last [m], shape (node capacity, 3)."""
    margin: float
    """Distance by which the boxes of tetrahedra are widened [m]."""


def no_grid() -> TetrahedronGrid:
    """Return a grid that lists nothing."""
    return TetrahedronGrid(
        origin=np.zeros(3),
        spacing=1.0,
        shape=np.ones(3, np.int64),
        head=np.full(1, -1, np.int64),
        following=np.zeros(0, np.int32),
        entry=np.zeros(0, np.int32),
        n_listed=0,
        n_entries=0,
        cells=np.zeros((0, 6), np.int32),
        listed_at=np.zeros((0, 3)),
        margin=0.0,
    )


def build_grid(body: Body, positions: FloatArray, margin: float) -> TetrahedronGrid:
    """Return the grid of all tetrahedra at `positions` [m], widened by `margin` [m]."""
    n_nodes, n_tetrahedra = body.n_nodes, body.n_tetrahedra
    low = positions[:n_nodes].min(axis=0) - margin
    size = positions[:n_nodes].max(axis=0) + margin - low
    n_cells = min(max(n_tetrahedra / TETRAHEDRA_PER_CELL, 1.0), _MOST_CELLS)
    spacing = float(max(np.cbrt(size.prod() / n_cells), size.max() / n_cells))
    shape = np.floor(size / spacing).astype(np.int64) + 1
    room = max(ENTRIES_PER_TETRAHEDRON * n_tetrahedra, LEAST_ENTRIES)
    while True:
        grid = TetrahedronGrid(
            origin=low,
            spacing=spacing,
            shape=shape,
            head=np.full(int(shape.prod()), -1, np.int64),
            following=np.empty(room, np.int32),
            entry=np.empty(room, np.int32),
            n_listed=0,
            n_entries=0,
            cells=_no_cells(len(body.tetrahedra)),
            listed_at=positions.copy(),
            margin=margin,
        )
        if list_appended(body, positions, grid):
            return grid
        room *= 2


def _no_cells(n: int) -> SlotArray:
    """Return `TetrahedronGrid.cells` of that many tetrahedra that are not listed."""
    cells = np.zeros((n, 6), np.int32)
    cells[:, 3:] = -1
    return cells


@kernel
def fits(grid: TetrahedronGrid, body: Body) -> bool:
    """Return whether the grid has room for all nodes and tetrahedra that the body has room for."""
    n_nodes, n_tetrahedra = len(body.positions), len(body.tetrahedra)
    return len(grid.listed_at) == n_nodes and len(grid.cells) == n_tetrahedra


@kernel
def list_appended(body: Body, positions: FloatArray, grid: TetrahedronGrid) -> bool:
    """List the tetrahedra that were appended since the last call; return whether there was room.

    There is none for a body whose arrays have grown since the grid was built.
    """
    if not fits(grid, body):
        return False
    while grid.n_listed < body.n_tetrahedra:
        t = grid.n_listed
        for k in range(4):
            node = body.tetrahedra[t, k]
            for c in range(3):
                grid.listed_at[node, c] = positions[node, c]
        if not _list_tetrahedron(body, positions, grid, t):
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
    """List the tetrahedra around nodes that moved far again; return whether there was room.

    Args:
        body: The body now.
        visits: For searches.
        grid: Written.
        nodes: Nodes, of which the first `n_nodes` are all that moved since the last call.
        n_nodes: How many these are.
        around: Scratch, shape (LARGEST_STAR,).
    """
    x = body.positions
    limit = grid.margin * grid.margin
    for i in range(n_nodes):
        node = nodes[i]
        dx = x[node, 0] - grid.listed_at[node, 0]
        dy = x[node, 1] - grid.listed_at[node, 1]
        dz = x[node, 2] - grid.listed_at[node, 2]
        if dx * dx + dy * dy + dz * dz <= limit:
            continue
        for c in range(3):
            grid.listed_at[node, c] = x[node, c]
        n = star(body, visits, node, body.node_tetrahedron[node], around)
        for k in range(n):
            if not _list_tetrahedron(body, x, grid, around[k]):
                return False
    return True


@kernel
def _list_tetrahedron(body: Body, positions: FloatArray, grid: TetrahedronGrid, t: int) -> bool:
    """List a tetrahedron where it is and was not listed last; return whether there was room."""
    box = widened(tetrahedron_box(positions, body.tetrahedra, t), grid.margin)
    x0, x1 = cell_along(grid, box.low.x, 0), cell_along(grid, box.high.x, 0)
    y0, y1 = cell_along(grid, box.low.y, 1), cell_along(grid, box.high.y, 1)
    z0, z1 = cell_along(grid, box.low.z, 2), cell_along(grid, box.high.z, 2)
    if grid.n_entries + (x1 - x0 + 1) * (y1 - y0 + 1) * (z1 - z0 + 1) > len(grid.entry):
        return False
    for i in range(x0, x1 + 1):
        for j in range(y0, y1 + 1):
            for k in range(z0, z1 + 1):
                if _is_listed_in(grid, t, i, j, k):
                    continue
                cell = (i * grid.shape[1] + j) * grid.shape[2] + k
                at = grid.n_entries
                grid.n_entries += 1
                grid.entry[at] = t
                grid.following[at] = grid.head[cell]
                grid.head[cell] = at
    grid.cells[t, 0], grid.cells[t, 1], grid.cells[t, 2] = x0, y0, z0
    grid.cells[t, 3], grid.cells[t, 4], grid.cells[t, 5] = x1, y1, z1
    return True


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


@kernel
def tetrahedron_at(body: Body, grid: TetrahedronGrid, positions: FloatArray, p: Vec3) -> int:
    """Return the tetrahedron that holds `p` [m], its nodes at `positions` [m]; -1 if none does.

    Of several it is the one with the lowest number, so that a point on a face is always found in
    the same one.
    """
    i = cell_along(grid, p.x, 0)
    j = cell_along(grid, p.y, 1)
    k = cell_along(grid, p.z, 2)
    found = -1
    box = Aabb(p, p)
    at = grid.head[(i * grid.shape[1] + j) * grid.shape[2] + k]
    while at >= 0:
        t = grid.entry[at]
        if (
            (found < 0 or t < found)
            and overlap(tetrahedron_box(positions, body.tetrahedra, t), box)
            and smallest_weight(barycentric_in(p, positions, body.tetrahedra, t)) >= 0.0
        ):
            found = t
        at = grid.following[at]
    return found


@kernel
def tetrahedron_in_box(
    body: Body, grid: TetrahedronGrid, positions: FloatArray, low: Vec3, high: Vec3
) -> int:
    """Return a tetrahedron whose box overlaps a given box; -1 if none does.

    Args:
        body: The body.
        grid: Its grid.
        positions: Positions of the nodes [m], shape (node capacity, 3).
        low: Lowest corner of the given box [m].
        high: Highest corner [m].
    """
    for i in range(cell_along(grid, low.x, 0), cell_along(grid, high.x, 0) + 1):
        for j in range(cell_along(grid, low.y, 1), cell_along(grid, high.y, 1) + 1):
            for k in range(cell_along(grid, low.z, 2), cell_along(grid, high.z, 2) + 1):
                at = grid.head[(i * grid.shape[1] + j) * grid.shape[2] + k]
                while at >= 0:
                    t: int = grid.entry[at]
                    if overlap(tetrahedron_box(positions, body.tetrahedra, t), Aabb(low, high)):
                        return t
                    at = grid.following[at]
    return -1
