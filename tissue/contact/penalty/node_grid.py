"""`NodeGrid`: nodes by the cells of a grid, for faces that ask which nodes may touch them.

The nodes of cells beside each other along x are one after the other, and eight are tested at a
time. What a face asks for is in some nine such rows of cells, with a few nodes each. The grid is
made anew for each update of the pairs, by counting.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.penalty.cells import (
    Cells,
    cells_in,
    count_thing,
    end_count,
    lay_cells,
    new_cells,
    note_found,
    row_of,
    take_place,
)
from tissue.contact.penalty.node_ways import BALL, NodeWays
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, aligned, filled, lanes, load_lanes
from tissue.core.simd_gather import larger, larger_bits
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, norm, vec3
from tissue.geometry.aabb import Aabb, empty_box, widened, with_point

DEEPEST = 0.25
"""Depth below a face up to which a node is paired with it, per node size. Larger: nodes on the far
side of thin lips are looked at; smaller: what was pressed in deep is lost."""

SAME_SHEET = 0.17
"""Cosine between the normals of node and face above which they are of one sheet, which bends and
does not touch itself. Larger: more pairs; smaller: lips that lie across each other are missed."""

_N_ROWS = 7
_RADIUS, _NORMAL = 3, 4
"""The first of the rows for radii and for normals, behind those for places."""


class NodeGrid(Arrays):
    """The nodes, as they were entered and in the order of their cells."""

    n_items: IntCell
    """Number of nodes."""
    most: FloatCell
    """By how much the ball of a node is larger than that of a slow one at most [m]."""
    entered: IntArray
    """The nodes as they were entered, shape (capacity,)."""
    node: IntArray
    """The nodes in the order of their cells, shape (capacity + 8,)."""
    rows: FloatArray
    """In that order x, y, z and radius of the ball of each [m], and x, y, z of a unit vector out of
    the body, or 0; row behind row, shape (7 * (capacity + 8),)."""
    found: IntArray
    """What the last question found, shape (capacity,)."""
    cells: Cells


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
def arrange_grid(grid: NodeGrid, ways: NodeWays, normal: FloatArray, edge: float) -> None:
    """Put what was entered into cells of that edge [m], or larger ones where there are too many."""
    box, most = empty_box(), 0.0
    for i in range(grid.n_items):
        node = grid.entered[i]
        box = with_point(box, vec3(ways.reference, node))
        most = max(most, ways.radius[node] - BALL * ways.node_size)
    grid.most = most
    lay_cells(grid.cells, box, edge)
    for i in range(grid.n_items):
        count_thing(grid.cells, i, vec3(ways.reference, grid.entered[i]))
    end_count(grid.cells)
    for i in range(grid.n_items):
        _write_rows(grid, take_place(grid.cells, i), grid.entered[i], ways, normal)


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
