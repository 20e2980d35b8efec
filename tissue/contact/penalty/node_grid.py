"""`NodeGrid`: nodes by the cells of a grid, for faces that ask which nodes may touch them.

The nodes of cells beside each other along x are one after the other, and eight are tested at a
time. What a face asks for is in some nine such rows of cells, with a few nodes each. The grid is
made anew for each update of the pairs, by counting.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.penalty.node_ways import BALL, NodeWays
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, aligned, filled, lanes, load_lanes
from tissue.core.simd_gather import first_bit, larger, larger_bits, natural
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, norm, store, vec3
from tissue.geometry.aabb import Aabb, empty_box, widened, with_point

DEEPEST = 0.25
"""Depth below a face up to which a node is paired with it, per node size. Larger: nodes on the far
side of thin lips are looked at; smaller: what was pressed in deep is lost."""

SAME_SHEET = 0.17
"""Cosine between the normals of node and face above which they are of one sheet, which bends and
does not touch itself. Larger: more pairs; smaller: lips that lie across each other are missed."""

_MOST_CELLS = 1 << 14
"""Cells of a grid at most. More: nodes of a body that extends far are told apart better, and each
update takes longer."""

_N_ROWS = 7
_RADIUS, _NORMAL = 3, 4
"""The first of the rows for radii and for normals, behind those for places."""

_ROUNDING = 1e-9
"""By how much a box is widened before its cells are found [m]."""


class NodeGrid(Arrays):
    """The nodes, as they were entered and in the order of their cells."""

    n_items: IntCell
    """Number of nodes."""
    n_x: IntCell
    """Number of cells along x."""
    n_y: IntCell
    """Number of cells along y."""
    n_z: IntCell
    """Number of cells along z."""
    per_metre: FloatCell
    """Cells in a metre along y and z, half as many as along x [1/m]."""
    most: FloatCell
    """By how much the ball of a node is larger than that of a slow one at most [m]."""
    corner: FloatArray
    """Lowest corner of the grid [m], shape (1, 3)."""
    begin: SlotArray
    """First node of each cell, shape (cells + 2,)."""
    cell: SlotArray
    """Scratch: cell of each node as it was entered, shape (capacity,)."""
    entered: IntArray
    """The nodes as they were entered, shape (capacity,)."""
    node: IntArray
    """The nodes in the order of their cells, shape (capacity + 8,)."""
    rows: FloatArray
    """In that order x, y, z and radius of the ball of each [m], and x, y, z of a unit vector out of
    the body, or 0; row behind row, shape (7 * (capacity + 8),)."""
    found: IntArray
    """What the last question found, shape (capacity,)."""


class Asking(NamedTuple):
    """A face as it asks for nodes near it."""

    at: int
    """Its place."""
    nodes: tuple[int, int, int]
    """Its corners."""
    corner: Vec3
    """Reference of the first corner [m]."""
    area: Vec3
    """Its normal, twice as long as its area [m2]."""
    length: float
    """Length of that [m2]."""
    reach: float
    """How far a node may be from it, without the ball of the node [m]."""
    box: Aabb
    """Box of what touches it, with the ball of a slow node around it."""


def new_node_grid(capacity: int) -> NodeGrid:
    """Return an empty grid with room for that many nodes."""
    room = filled(capacity + WIDTH)
    return NodeGrid(
        n_items=0,
        n_x=1,
        n_y=1,
        n_z=1,
        per_metre=0.0,
        most=0.0,
        corner=np.zeros((1, 3)),
        begin=np.zeros(_MOST_CELLS + 2, np.int32),
        cell=np.zeros(capacity, np.int32),
        entered=np.zeros(capacity, np.int64),
        node=np.zeros(room, np.int64),
        rows=aligned(_N_ROWS * room),
        found=np.zeros(capacity, np.int64),
    )


@inlined
def enter_node(grid: NodeGrid, node: int) -> None:
    """Enter a node; `arrange_grid` is called after the last."""
    grid.entered[grid.n_items] = node
    grid.n_items += 1


@kernel
def arrange_grid(grid: NodeGrid, ways: NodeWays, normal: FloatArray, edge: float) -> None:
    """Put what was entered into cells of that edge [m], or larger ones where there are too many."""
    box, most = empty_box(), 0.0
    for i in range(grid.n_items):
        node = grid.entered[i]
        box = with_point(box, vec3(ways.reference, node))
        most = max(most, ways.radius[node] - BALL * ways.node_size)
    grid.most = most
    _lay_cells(grid, box, edge)
    begin = grid.begin
    n_cells = grid.n_x * grid.n_y * grid.n_z
    for cell in range(n_cells + 2):
        begin[cell] = 0
    for i in range(grid.n_items):
        p = vec3(ways.reference, grid.entered[i])
        x, y, z = _cell_of(grid, p)
        grid.cell[i] = (z * grid.n_y + y) * grid.n_x + x
        begin[grid.cell[i] + 2] += 1
    for cell in range(2, n_cells + 2):
        begin[cell] += begin[cell - 1]
    for i in range(grid.n_items):
        at = begin[grid.cell[i] + 1]
        begin[grid.cell[i] + 1] += 1
        _write_rows(grid, at, grid.entered[i], ways, normal)


@kernel
def _lay_cells(grid: NodeGrid, box: Aabb, edge: float) -> None:
    """Choose the cells."""
    grid.per_metre = 1.0 / edge
    grid.n_x = grid.n_y = grid.n_z = 1
    if grid.n_items == 0:
        return
    store(grid.corner, 0, box.low)
    for _ in range(100):
        grid.n_x = grid.n_y = grid.n_z = _MOST_CELLS
        x, y, z = _cell_of(grid, box.high)
        if (x + 1) * (y + 1) * (z + 1) <= _MOST_CELLS:
            grid.n_x, grid.n_y, grid.n_z = x + 1, y + 1, z + 1
            return
        grid.per_metre *= 0.8


@inlined
def _cell_of(grid: NodeGrid, p: Vec3) -> tuple[int, int, int]:
    """Return the cell of a point, or that nearest to it."""
    scale = grid.per_metre
    x = int(2.0 * scale * (p.x - grid.corner[0, 0]))
    y = int(scale * (p.y - grid.corner[0, 1]))
    z = int(scale * (p.z - grid.corner[0, 2]))
    return (
        min(max(x, 0), grid.n_x - 1),
        min(max(y, 0), grid.n_y - 1),
        min(max(z, 0), grid.n_z - 1),
    )


@inlined
def _write_rows(grid: NodeGrid, at: int, node: int, ways: NodeWays, normal: FloatArray) -> None:
    """Write what is known of a node."""
    rows, room = grid.rows, len(grid.node)
    p, n = vec3(ways.reference, node), vec3(normal, node)
    length = norm(n)
    per_length = 1.0 / length if length > 0.0 else 0.0
    grid.node[at] = node
    rows[at], rows[room + at], rows[2 * room + at] = p.x, p.y, p.z
    rows[_RADIUS * room + at] = ways.radius[node]
    rows[_NORMAL * room + at] = per_length * n.x
    rows[(_NORMAL + 1) * room + at] = per_length * n.y
    rows[(_NORMAL + 2) * room + at] = per_length * n.z


@inlined
def find_in_box(grid: NodeGrid, box: Aabb, node_size: float) -> int:
    """Write the nodes whose balls reach into a box; see `find_near_face`."""
    nothing = Vec3(0.0, 0.0, 0.0)
    return find_near_face(grid, Asking(0, (0, 0, 0), nothing, nothing, 0.0, 0.0, box), node_size)


@kernel
def find_near_face(grid: NodeGrid, face: Asking, node_size: float) -> int:
    """Write the nodes that may touch a face while all stay in their balls; return how many.

    Corners of the face may be among them.

    Args:
        grid: `found` is written.
        face: The face.
        node_size: Mean node size [m].
    """
    if grid.n_items == 0:
        return 0
    wide = widened(face.box, grid.most + _ROUNDING)
    x0, y0, z0 = _cell_of(grid, wide.low)
    x1, y1, z1 = _cell_of(grid, wide.high)
    n, n_x, n_y = 0, grid.n_x, grid.n_y
    begin = grid.begin
    for z in range(z0, z1 + 1):
        for y in range(y0, y1 + 1):
            row = (z * n_y + y) * n_x
            i, end = begin[natural(row + x0)], begin[natural(row + x1 + 1)]
            while i < end:
                bits = _in_box(grid, i, face.box, BALL * node_size)
                n = _note_found(grid, i, end, bits & _at_face(grid, i, face, node_size), n)
                i += WIDTH
    return n


@inlined
def _note_found(grid: NodeGrid, i: int, end: int, bits: int, n: int) -> int:
    """Write the nodes of the bits that are before `end`; return how many there are then."""
    bits &= (1 << min(end - i, WIDTH)) - 1
    while bits != 0:
        grid.found[natural(n)] = grid.node[natural(i + first_bit(bits))]
        n += 1
        bits &= bits - 1
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
def _at_face(grid: NodeGrid, i: int, face: Asking, node_size: float) -> int:
    """Return bits for which of eight nodes are near the plane of a face and do not face alike."""
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
