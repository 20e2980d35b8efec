"""`Cells` and `NodeGrid`: nodes by the cells of a grid, for faces that query which may touch them.

What is in cells next to each other along x is one after the other, so that a box covers a few rows,
of each of which eight nodes are tested at a time. What a face queries is in some nine such rows,
with a few nodes each. A grid is made for each update of the pairs, by counting.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.search.node_motion import BALL, NodeMotion
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, aligned, filled, lanes, load_lanes
from tissue.core.simd_rows import first_bit, larger, larger_bits, natural
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, norm, store, vec3
from tissue.geometry.aabb import Aabb, empty_box, widened, with_point

_MOST_CELLS = 1 << 14
"""Cells of a grid at most. More: what is in a body that extends far is separated better, and each
sorting takes longer."""

_ROUNDING = 1e-9
"""Margin of a box before its cells are found [m]."""

DEEPEST = 0.25
"""Depth below a face up to which a node is paired with it, per node size. Larger: nodes on the far
side of thin lips are tested; smaller: what was pressed in deep is missed."""

SAME_SHEET = 0.17
"""Cosine between the normals of node and face above which they are of one sheet, which bends and
does not touch itself. Larger: more pairs; smaller: lips that lie across each other are missed."""

_N_ROWS = 7

_RADIUS, _NORMAL = 3, 4
"""The first of the rows for radii and for normals, behind those for places."""


class Cells(Arrays):
    """The cells, and where what is sorted by them begins in each."""

    n_x: IntCell
    """Number of cells along x."""
    n_y: IntCell
    """Number of cells along y."""
    n_z: IntCell
    """Number of cells along z."""
    per_metre: FloatCell
    """Cells in a metre along y and z, half as many as along x [1/m]."""
    corner: FloatArray
    """Lowest corner of the grid [m], shape (1, 3)."""
    begin: SlotArray
    """Place of the first thing in each cell, shape (cells + 2,)."""
    cell: SlotArray
    """Scratch: cell of each thing, shape (capacity,)."""


class CellRange(NamedTuple):
    """Cells from `x0` to `x1`, and so on, in `n_x` by `n_y` cells to a layer."""

    x0: int
    x1: int
    y0: int
    y1: int
    z0: int
    z1: int
    n_x: int
    n_y: int


class NodeGrid(Arrays):
    """The nodes, as they were entered and in the order of their cells."""

    n_items: IntCell
    """Number of nodes."""
    most: FloatCell
    """Largest radius of a ball over that of a slow node [m]."""
    entered: IntArray
    """The nodes as they were entered, shape (capacity,)."""
    node: IntArray
    """The nodes in the order of their cells, shape (capacity + 8,)."""
    rows: FloatArray
    """In that order x, y, z and radius of the ball of each [m], and x, y, z of a unit vector out of
    the body, or 0; row behind row, shape (7 * (capacity + 8),)."""
    found: IntArray
    """Results of the last query, shape (capacity,)."""
    cells: Cells


class FaceQuery(NamedTuple):
    """A face that queries the nodes near it."""

    at: int
    """Place of the face."""
    nodes: tuple[int, int, int]
    """Corners of the face."""
    corner: Vec3
    """Reference of the first corner [m]."""
    area: Vec3
    """Normal of the face, twice as long as its area [m2]."""
    length: float
    """Length of that [m2]."""
    reach: float
    """Distance from the face up to which a node is near, without the ball of the node [m]."""
    box: Aabb
    """Box of what touches it, with the ball of a slow node around it."""


def new_cells(capacity: int) -> Cells:
    """Return empty cells with room for that many things."""
    return Cells(
        n_x=1,
        n_y=1,
        n_z=1,
        per_metre=0.0,
        corner=np.zeros((1, 3)),
        begin=np.zeros(_MOST_CELLS + 2, np.int32),
        cell=np.zeros(capacity, np.int32),
    )


@kernel
def lay_cells(cells: Cells, box: Aabb, edge: float) -> None:
    """Lay cells of that edge [m] into a box, or larger ones where there are too many.

    Then each thing is counted (`count_thing`), and `end_count` called, and each takes its place
    (`take_place`), so that those of one cell keep their order.
    """
    cells.per_metre = 1.0 / edge
    cells.n_x = cells.n_y = cells.n_z = 1
    if box.low.x <= box.high.x:
        store(cells.corner, 0, box.low)
        _choose_numbers(cells, box)
    for cell in range(cells.n_x * cells.n_y * cells.n_z + 2):
        cells.begin[cell] = 0


@kernel
def _choose_numbers(cells: Cells, box: Aabb) -> None:
    """Choose how many cells there are along each axis."""
    for _ in range(100):
        cells.n_x = cells.n_y = cells.n_z = _MOST_CELLS
        x, y, z = _cell_of(cells, box.high)
        if (x + 1) * (y + 1) * (z + 1) <= _MOST_CELLS:
            cells.n_x, cells.n_y, cells.n_z = x + 1, y + 1, z + 1
            return
        cells.per_metre *= 0.8
    cells.n_x = cells.n_y = cells.n_z = 1


@inlined
def count_thing(cells: Cells, i: int, p: Vec3) -> None:
    """Count thing `i`, which is at a point."""
    x, y, z = _cell_of(cells, p)
    cell = (z * cells.n_y + y) * cells.n_x + x
    cells.cell[natural(i)] = cell
    cells.begin[natural(cell + 2)] += 1


@kernel
def end_count(cells: Cells) -> None:
    """Find where the things of each cell begin."""
    begin = cells.begin
    for cell in range(2, cells.n_x * cells.n_y * cells.n_z + 2):
        begin[cell] += begin[cell - 1]


@inlined
def take_place(cells: Cells, i: int) -> int:
    """Return the place of thing `i` in the order of the cells; each takes one once."""
    next_cell = natural(cells.cell[natural(i)] + 1)
    at = int(cells.begin[next_cell])
    cells.begin[next_cell] = at + 1
    return at


@inlined
def cells_in(cells: Cells, box: Aabb) -> CellRange:
    """Return the cells in which there may be a point that is in a box."""
    x0, y0, z0 = _cell_of(cells, widened(box, _ROUNDING).low)
    x1, y1, z1 = _cell_of(cells, widened(box, _ROUNDING).high)
    return CellRange(x0, x1, y0, y1, z0, z1, cells.n_x, cells.n_y)


@inlined
def row_of(cells: Cells, within: CellRange, y: int, z: int) -> tuple[int, int]:
    """Return the first place in a row of cells, and that behind the last."""
    row = (z * within.n_y + y) * within.n_x
    return cells.begin[natural(row + within.x0)], cells.begin[natural(row + within.x1 + 1)]


@inlined
def note_found(found: IntArray, things: IntArray, i: int, end: int, bits: int, n: int) -> int:
    """Write the things of the bits that are before `end`; return how many there are then.

    Args:
        found: Written behind the first `n`.
        things: The things in the order of the cells.
        i: Place of the first of eight.
        end: The place behind the last of their row.
        bits: Which of the eight are found.
        n: How many were found before.
    """
    bits &= (1 << min(end - i, WIDTH)) - 1
    while bits != 0:
        found[natural(n)] = things[natural(i + first_bit(bits))]
        n += 1
        bits &= bits - 1
    return n


@inlined
def _cell_of(cells: Cells, p: Vec3) -> tuple[int, int, int]:
    """Return the cell of a point, or that nearest to it."""
    scale = cells.per_metre
    x = int(2.0 * scale * (p.x - cells.corner[0, 0]))
    y = int(scale * (p.y - cells.corner[0, 1]))
    z = int(scale * (p.z - cells.corner[0, 2]))
    return (
        min(max(x, 0), cells.n_x - 1),
        min(max(y, 0), cells.n_y - 1),
        min(max(z, 0), cells.n_z - 1),
    )


def new_node_grid(capacity: int) -> NodeGrid:
    """Return an empty grid with room for that many nodes."""
    room = filled(capacity + WIDTH)
    return NodeGrid(
        n_items=0,
        most=0.0,
        entered=np.zeros(capacity, np.int64),
        node=np.zeros(room, np.int64),
        rows=aligned(_N_ROWS * room),
        found=np.zeros(capacity, np.int64),
        cells=new_cells(capacity),
    )


@inlined
def enter_node(grid: NodeGrid, node: int) -> None:
    """Enter a node; `arrange_grid` is called after the last."""
    grid.entered[grid.n_items] = node
    grid.n_items += 1


@kernel
def arrange_grid(grid: NodeGrid, motion: NodeMotion, normal: FloatArray, edge: float) -> None:
    """Put what was entered into cells of that edge [m], or larger ones where there are too many."""
    box, most = empty_box(), 0.0
    for i in range(grid.n_items):
        node = grid.entered[i]
        box = with_point(box, vec3(motion.reference, node))
        most = max(most, motion.radius[node] - BALL * motion.node_size)
    grid.most = most
    lay_cells(grid.cells, box, edge)
    for i in range(grid.n_items):
        count_thing(grid.cells, i, vec3(motion.reference, grid.entered[i]))
    end_count(grid.cells)
    for i in range(grid.n_items):
        _write_rows(grid, take_place(grid.cells, i), grid.entered[i], motion, normal)


@inlined
def _write_rows(grid: NodeGrid, at: int, node: int, motion: NodeMotion, normal: FloatArray) -> None:
    """Write what is known of a node."""
    rows, room = grid.rows, len(grid.node)
    p, n = vec3(motion.reference, node), vec3(normal, node)
    length = norm(n)
    per_length = 1.0 / length if length > 0.0 else 0.0
    grid.node[at] = node
    rows[at], rows[room + at], rows[2 * room + at] = p.x, p.y, p.z
    rows[_RADIUS * room + at] = motion.radius[node]
    rows[_NORMAL * room + at] = per_length * n.x
    rows[(_NORMAL + 1) * room + at] = per_length * n.y
    rows[(_NORMAL + 2) * room + at] = per_length * n.z


@inlined
def find_in_box(grid: NodeGrid, box: Aabb, node_size: float) -> int:
    """Write the nodes whose balls reach into a box; see `find_near_face`."""
    nothing = Vec3(0.0, 0.0, 0.0)
    return find_near_face(grid, FaceQuery(0, (0, 0, 0), nothing, nothing, 0.0, 0.0, box), node_size)


@kernel
def find_near_face(grid: NodeGrid, face: FaceQuery, node_size: float) -> int:
    """Write the nodes that may touch a face while all stay in their balls; return how many.

    Corners of the face may be among them.

    Args:
        grid: `found` is written.
        face: The face.
        node_size: Mean node size [m].
    """
    if grid.n_items == 0:
        return 0
    n, within = 0, cells_in(grid.cells, widened(face.box, grid.most))
    for z in range(within.z0, within.z1 + 1):
        for y in range(within.y0, within.y1 + 1):
            i, end = row_of(grid.cells, within, y, z)
            while i < end:
                bits = _in_box(grid, i, face.box, BALL * node_size)
                bits &= _at_face(grid, i, face, node_size)
                n = note_found(grid.found, grid.node, i, end, bits, n)
                i += WIDTH
    return n


@inlined
def _in_box(grid: NodeGrid, i: int, box: Aabb, slow: float) -> int:
    """Return bits for which of eight nodes have balls that reach into a box."""
    rows, room = grid.rows, len(grid.node)
    more = larger(load_lanes(rows, _RADIUS * room + i) - lanes(slow), lanes(0.0))
    apart = larger(
        _gap(load_lanes(rows, i), more, box.low.x, box.high.x),
        larger(
            _gap(load_lanes(rows, room + i), more, box.low.y, box.high.y),
            _gap(load_lanes(rows, 2 * room + i), more, box.low.z, box.high.z),
        ),
    )
    return ~larger_bits(apart, lanes(0.0))


@inlined
def _gap(place: Lanes, more: Lanes, low: float, high: float) -> Lanes:
    """Return how far balls are from a box along an axis [m], negative where they reach into it."""
    return larger((place - more) - lanes(high), lanes(low) - (place + more))


@inlined
def _at_face(grid: NodeGrid, i: int, face: FaceQuery, node_size: float) -> int:
    """Return bits for which of eight nodes are near the plane of a face and may face it."""
    rows, room, area = grid.rows, len(grid.node), face.area
    ax, ay, az = lanes(area.x), lanes(area.y), lanes(area.z)
    along = (
        ax * load_lanes(rows, _NORMAL * room + i)
        + ay * load_lanes(rows, (_NORMAL + 1) * room + i)
        + az * load_lanes(rows, (_NORMAL + 2) * room + i)
    )
    height = (
        ax * (load_lanes(rows, i) - lanes(face.corner.x))
        + ay * (load_lanes(rows, room + i) - lanes(face.corner.y))
        + az * (load_lanes(rows, 2 * room + i) - lanes(face.corner.z))
    )
    reach = load_lanes(rows, _RADIUS * room + i) + lanes(face.reach)
    above, below = reach, reach + lanes(DEEPEST * node_size)
    length = lanes(face.length)
    is_out = larger_bits(along, lanes(SAME_SHEET * face.length))
    is_out |= larger_bits(height, above * length)
    return ~(is_out | larger_bits(lanes(0.0) - height, below * length))
