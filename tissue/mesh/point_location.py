"""Point location: which tetrahedron holds a point, or meets a box, by the lists of a grid."""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, lerp
from tissue.geometry.aabb import Aabb, overlap, tetrahedron_box, with_point
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import Body
from tissue.mesh.tetrahedron_grid import TETRAHEDRA_PER_LINE, TetrahedronGrid, cell_along


@kernel
def _cell_of(grid: TetrahedronGrid, p: Vec3) -> int:
    """Return the cell that holds `p` [m]."""
    i = cell_along(grid, p.x, 0)
    j = cell_along(grid, p.y, 1)
    k = cell_along(grid, p.z, 2)
    cell: int = (i * grid.shape[1] + j) * grid.shape[2] + k
    return cell


@inlined
def _point_on_line(ends: tuple[Vec3, Vec3], k: int, n: int) -> Vec3:
    """Return point `k` of `n` on a line, equally spaced from one end to the other [m]."""
    return lerp(k / (n - 1.0), ends[0], ends[1])


@kernel
def tetrahedron_at(body: Body, grid: TetrahedronGrid, positions: FloatArray, p: Vec3) -> int:
    """Return the tetrahedron that holds `p` [m], its nodes at `positions` [m]; -1 if none does.

    Of several it is the one with the lowest number, so that a point on a face is always found in
    the same one.
    """
    found = -1
    box = Aabb(p, p)
    cell = _cell_of(grid, p)
    line, n_in_line = grid.head[cell, 0], grid.head[cell, 1]
    while line >= 0:
        for i in range(1, n_in_line + 1):
            t = grid.lines[line, i]
            if (
                (found < 0 or t < found)
                and overlap(tetrahedron_box(positions, body.tetrahedra, t), box)
                and _holds(body, positions, t, p)
            ):
                found = t
        line, n_in_line = grid.lines[line, 0], TETRAHEDRA_PER_LINE
    return found


@kernel
def tetrahedra_along(
    body: Body,
    grid: TetrahedronGrid,
    ends: tuple[Vec3, Vec3],
    n: int,
    begin: int,
    stop: int,
    found: IntArray,
) -> int:
    """Find the tetrahedra that hold points on a line, as `tetrahedron_at` does for each.

    It takes the points from `begin` on that are in the same cell, and returns the one after them:
    the list of a cell is long, and is searched once for all.

    Args:
        body: The body as it is now.
        grid: Its grid.
        ends: Where the line begins and ends [m].
        n: Number of points on the line, equally spaced from one end to the other.
        begin: First point to look for.
        stop: One past the last.
        found: The tetrahedron of each point, or -1, is written; shape (n,) or longer.
    """
    first = _point_on_line(ends, begin, n)
    cell, last, after = _cell_of(grid, first), first, begin
    while after < stop:
        p = _point_on_line(ends, after, n)
        if _cell_of(grid, p) != cell:
            break
        found[after] = -1
        after, last = after + 1, p
    box = with_point(Aabb(first, first), last)
    line, n_in_line = grid.head[cell, 0], grid.head[cell, 1]
    while line >= 0:
        for i in range(1, n_in_line + 1):
            t = grid.lines[line, i]
            around = tetrahedron_box(body.positions, body.tetrahedra, t)
            if not overlap(around, box):
                continue
            for k in range(begin, after):
                p = _point_on_line(ends, k, n)
                if (
                    (found[k] < 0 or t < found[k])
                    and overlap(around, Aabb(p, p))
                    and _holds(body, body.positions, t, p)
                ):
                    found[k] = t
        line, n_in_line = grid.lines[line, 0], TETRAHEDRA_PER_LINE
    return after


@kernel
def _holds(body: Body, positions: FloatArray, t: int, p: Vec3) -> bool:
    """Return whether tetrahedron `t`, its nodes at `positions` [m], holds a point [m]."""
    return smallest_weight(barycentric_in(p, positions, body.tetrahedra, t)) >= 0.0


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
                cell = (i * grid.shape[1] + j) * grid.shape[2] + k
                line, n_in_line = grid.head[cell, 0], grid.head[cell, 1]
                while line >= 0:
                    for at in range(1, n_in_line + 1):
                        t: int = grid.lines[line, at]
                        if overlap(tetrahedron_box(positions, body.tetrahedra, t), Aabb(low, high)):
                            return t
                    line, n_in_line = grid.lines[line, 0], TETRAHEDRA_PER_LINE
    return -1
