"""`FeatureEdges`: the edges that can touch other edges, kept true to motion and cuts.

Edges go by 3 * place + k: edge `k` of the face in a place of `Faces`. `EdgeGrid` has the boxes
around them in the cells of two grids, each box in the cell of its middle, so that a query reaches
as far beyond its own box as half of the largest: the few long edges have a grid of their own. Both
are made for each update of the pairs, by counting.
"""

import numpy as np

from tissue.contact.geometry.edges import face_across, is_feature_edge
from tissue.contact.geometry.faces import NO_FACE, Faces
from tissue.contact.search.near_pairs import NearPairs
from tissue.contact.search.node_grid import (
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
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, aligned, filled, lanes, load_lanes, room_for_points
from tissue.core.simd_rows import larger, larger_bits
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, norm, scale, store, sub, vec3
from tissue.geometry.aabb import Aabb, box_at, empty_box, with_point
from tissue.mesh.body import CUT, Body
from tissue.mesh.faces import OUTWARD

_LONG = 0.8
"""Half of the longest side of a box from which an edge is long, per node size. Larger: those who
query search farther; smaller: more are in the coarse grid. Measured after 26 strokes, with all of
pairing: 1.33 ms, and 1.37 ms at 0.6."""

_N_ROWS = 10

_EDGE_CELL, _LONG_CELL = 1.0, 2.0
"""Edges of the cells for short and for long edges, per node size. Larger: boxes elsewhere are
tested; smaller: more rows with less than eight in each."""

_HIGH, _DIRECTION, _ORDER = 3, 6, 9
"""The first of the rows for highest corners, behind those for the lowest; for directions; and for
numbers."""


class EdgeBoxes(Arrays):
    """Boxes around edges in the order of their cells."""

    n_items: IntCell
    """Number of edges."""
    entered: IntArray
    """The edges as they were entered, shape (capacity,)."""
    edge: IntArray
    """The edges in the order of their cells, shape (capacity + 8,)."""
    half: FloatArray
    """Half of the longest sides of boxes along x, y and z [m], shape (1, 3)."""
    rows: FloatArray
    """In that order x, y, z of lowest and of highest corners [m], x, y, z of unit vectors out of
    the body, or 0, and the number of each edge that queries itself, or -1; row behind row, shape
    (10 * (capacity + 8),)."""
    cells: Cells


class EdgeGrid(Arrays):
    """All edges that may be queried."""

    short: EdgeBoxes
    long: EdgeBoxes
    found: IntArray
    """Results of the last query, shape (capacity + 8,)."""


class FeatureEdges(Arrays):
    """The edges of the active faces."""

    n_edges: IntCell
    """Number of edges."""
    listed: IntArray
    """The edges, shape (3 * face capacity,)."""
    is_feature: IntArray
    """1 if an edge is an edge that its face lists, else 0; shape (3 * face capacity,)."""
    is_of_cut: IntArray
    """1 if one of the two faces of an edge was made by a cut, else 0; shape (3 * face
    capacity,)."""
    dirty_at: IntArray
    """Update of the pairs in which each edge was last paired again, shape (3 * face capacity,)."""
    first_pair: IntArray
    """Where the pairs of each edge begin in `EdgePairs.of_edge`, shape (3 * face capacity +
    2,)."""
    path: FloatArray
    """Sum of the paths of the ends of each edge as it was last computed [m], shape (3 * face
    capacity,)."""
    node: IntArray
    """Ends of each edge, shape (3 * face capacity, 2)."""
    tip: IntArray
    """Third nodes of its two faces: that which lists it, and that across; shape (3 * face
    capacity, 2)."""
    low: FloatArray
    """Lowest corner of the box around each edge and its balls [m], shape (3 * face capacity,
    3)."""
    high: FloatArray
    """Highest corner of that box [m], shape (3 * face capacity, 3)."""
    outward: FloatArray
    """Vector out of the body at each edge, with its nodes where they were when they were paired:
    the sum of the unit normals of its two faces; shape (3 * face capacity, 3)."""
    eight: SlotArray
    """Scratch: eight edges, their first ends and their second ones; shape (24,)."""
    reach: FloatArray
    """Scratch: the radius of the larger ball of the ends of each [m], shape (8,)."""
    grid: EdgeGrid
    """The edges by their boxes."""


def new_feature_edges(n_faces: int) -> FeatureEdges:
    """Return no edges, with room for those of `n_faces`."""
    n = 3 * n_faces
    of_edges = ("listed", "is_feature", "is_of_cut", "dirty_at")
    return FeatureEdges(
        n_edges=0,
        **{name: np.zeros(n, np.int64) for name in of_edges},
        first_pair=np.zeros(n + 2, np.int64),
        path=np.zeros(n),
        node=np.zeros((n, 2), np.int64),
        tip=np.zeros((n, 2), np.int64),
        low=np.zeros((n, 3)),
        high=np.zeros((n, 3)),
        outward=room_for_points(n),
        eight=np.zeros(3 * WIDTH, np.int32),
        reach=aligned(WIDTH),
        grid=new_edge_grid(n),
    )


def new_edge_grid(capacity: int) -> EdgeGrid:
    """Return an empty grid with room for that many edges."""
    return EdgeGrid(
        short=_new_boxes(capacity),
        long=_new_boxes(capacity),
        found=np.zeros(capacity + WIDTH, np.int64),
    )


def _new_boxes(capacity: int) -> EdgeBoxes:
    """Return no boxes, with room for that many."""
    room = filled(capacity + WIDTH)
    return EdgeBoxes(
        n_items=0,
        entered=np.zeros(capacity, np.int64),
        edge=np.zeros(room, np.int64),
        half=np.zeros((1, 3)),
        rows=aligned(_N_ROWS * room),
        cells=new_cells(capacity),
    )


@kernel
def find_changed_edges(edges: FeatureEdges, pairs: NearPairs, faces: Faces, body: Body) -> None:
    """Judge the edges of faces that changed, and of their neighbours.

    Args:
        edges: Written.
        pairs: Faces that changed are dirty in this update, and no others yet.
        faces: The faces that may touch.
        body: Adjacency, and the body at rest.
    """
    for at in range(faces.n_places):
        if pairs.dirty_at[at] != pairs.n_updates:
            continue
        _judge_edges(edges, pairs, faces, body, at)
        face = faces.face[at]
        if face == NO_FACE:
            continue
        for k in range(3):
            neighbour = _place_of(faces, face_across(body, face // 4, face % 4, k)[0])
            if (
                neighbour >= 0
                and pairs.is_active[neighbour] == 1
                and pairs.dirty_at[neighbour] != pairs.n_updates
            ):
                _judge_edges(edges, pairs, faces, body, neighbour)


@kernel
def _place_of(faces: Faces, face: int) -> int:
    """Return the place of a face, or -1; `face` may be -1."""
    return int(faces.place[face // 4, face % 4]) if face >= 0 else -1


@kernel
def _judge_edges(edges: FeatureEdges, pairs: NearPairs, faces: Faces, body: Body, at: int) -> None:
    """Find out which edges of the face in place `at` are edges that it lists."""
    for k in range(3):
        edge = 3 * at + k
        if edges.is_feature[edge] == 1:
            edges.dirty_at[edge] = pairs.n_updates
        edges.is_feature[edge] = 0
        if pairs.is_active[at] == 0:
            continue
        face = faces.face[at]
        t, f = face // 4, face % 4
        across, tip = face_across(body, t, f, k)
        a, b = pairs.triangle[at, k], pairs.triangle[at, (k + 1) % 3]
        neighbour = _place_of(faces, across)
        # Both faces have the edge, one of them from its lower node to its higher.
        has_other = neighbour >= 0 and pairs.is_active[neighbour] == 1
        if (a > b and has_other) or not is_feature_edge(body, t, f, k):
            continue
        own_tip = body.tetrahedra[t, OUTWARD[f, (k + 2) % 3]]
        edges.is_feature[edge] = 1
        edges.dirty_at[edge] = pairs.n_updates
        edges.node[edge, 0], edges.node[edge, 1] = a, b
        edges.tip[edge, 0] = own_tip
        edges.tip[edge, 1] = tip if tip >= 0 else own_tip
        is_other_cut = across >= 0 and body.links[across // 4, across % 4] == CUT
        edges.is_of_cut[edge] = 1 if body.links[t, f] == CUT or is_other_cut else 0


@inlined
def enter_edge(grid: EdgeGrid, edge: int, box: Aabb, node_size: float) -> None:
    """Enter an edge with a box around it [m]; `arrange_edges` is called after the last."""
    side = sub(box.high, box.low)
    if max(side.x, max(side.y, side.z)) > 2.0 * _LONG * node_size:
        grid.long.entered[grid.long.n_items] = edge
        grid.long.n_items += 1
    else:
        grid.short.entered[grid.short.n_items] = edge
        grid.short.n_items += 1


@kernel
def arrange_edges(
    grid: EdgeGrid,
    low: FloatArray,
    high: FloatArray,
    outward: FloatArray,
    dirty_at: IntArray,
    now: int,
    node_size: float,
) -> None:
    """Put what was entered into cells.

    Args:
        grid: Written.
        low: Lowest corner of the box of each edge [m], by its number; shape (n, 3).
        high: Highest corner of that box [m], shape (n, 3).
        outward: Vector out of the body at each, of any length; shape (n, 3).
        dirty_at: Update in which each queried last, shape (n,).
        now: This update. Of two edges that query in it the one with the higher number finds the
            other.
        node_size: Mean node size [m].
    """
    _arrange_boxes(grid.short, low, high, outward, dirty_at, now, _EDGE_CELL * node_size)
    _arrange_boxes(grid.long, low, high, outward, dirty_at, now, _LONG_CELL * node_size)


@kernel
def _arrange_boxes(
    boxes: EdgeBoxes,
    low: FloatArray,
    high: FloatArray,
    outward: FloatArray,
    dirty_at: IntArray,
    now: int,
    cell_edge: float,
) -> None:
    """Put boxes into cells of that edge [m], if there are not too many; see `arrange_edges`."""
    bounds, half = empty_box(), Vec3(0.0, 0.0, 0.0)
    for i in range(boxes.n_items):
        box = box_at(low, high, boxes.entered[i])
        side = sub(box.high, box.low)
        half = Vec3(max(half.x, 0.5 * side.x), max(half.y, 0.5 * side.y), max(half.z, 0.5 * side.z))
        bounds = with_point(bounds, _middle(box))
    store(boxes.half, 0, half)
    lay_cells(boxes.cells, bounds, cell_edge)
    for i in range(boxes.n_items):
        count_thing(boxes.cells, i, _middle(box_at(low, high, boxes.entered[i])))
    end_count(boxes.cells)
    for i in range(boxes.n_items):
        edge = boxes.entered[i]
        number = edge if dirty_at[edge] == now else -1
        _write_edge(boxes, i, box_at(low, high, edge), vec3(outward, edge), number)


@inlined
def _middle(box: Aabb) -> Vec3:
    """Return the middle of a box [m]."""
    return scale(0.5, add(box.low, box.high))


@inlined
def _write_edge(boxes: EdgeBoxes, i: int, box: Aabb, outward: Vec3, number: int) -> None:
    """Write what is known of edge `i` of those entered."""
    at, rows, room = take_place(boxes.cells, i), boxes.rows, len(boxes.edge)
    length = norm(outward)
    per_length = 1.0 / length if length > 0.0 else 0.0
    boxes.edge[at] = boxes.entered[i]
    rows[at], rows[room + at], rows[2 * room + at] = box.low.x, box.low.y, box.low.z
    rows[_HIGH * room + at] = box.high.x
    rows[(_HIGH + 1) * room + at] = box.high.y
    rows[(_HIGH + 2) * room + at] = box.high.z
    rows[_DIRECTION * room + at] = per_length * outward.x
    rows[(_DIRECTION + 1) * room + at] = per_length * outward.y
    rows[(_DIRECTION + 2) * room + at] = per_length * outward.z
    rows[_ORDER * room + at] = number


@kernel
def find_near_edges(grid: EdgeGrid, edge: int, box: Aabb, direction: Vec3, furthest: float) -> int:
    """Write the edges whose boxes overlap a box to `found`; return how many there are.

    Those that face the same side are left out, and of those that query themselves the one that
    queries and what has a higher number. What faces the same side to within rounding may be found.

    Args:
        grid: `found` is written.
        edge: Number of the edge that queries.
        box: The box around it [m].
        direction: Vector out of the body at it.
        furthest: Product of that and a unit vector above which they face the same side; inf if that
            does not matter.
    """
    n = _find_boxes(grid.short, grid.found, 0, edge, box, direction, furthest)
    return int(_find_boxes(grid.long, grid.found, n, edge, box, direction, furthest))


@inlined
def _find_boxes(
    boxes: EdgeBoxes,
    found: IntArray,
    n: int,
    edge: int,
    box: Aabb,
    direction: Vec3,
    furthest: float,
) -> int:
    """Write what is found behind the first `n`; return how many there are then."""
    if boxes.n_items == 0:
        return n
    half = vec3(boxes.half, 0)
    within = cells_in(boxes.cells, Aabb(sub(box.low, half), add(box.high, half)))
    for z in range(within.z0, within.z1 + 1):
        for y in range(within.y0, within.y1 + 1):
            i, end = row_of(boxes.cells, within, y, z)
            while i < end:
                bits = _near(boxes, i, edge, box, direction, furthest)
                n = note_found(found, boxes.edge, i, end, bits, n)
                i += WIDTH
    return n


@inlined
def _near(boxes: EdgeBoxes, i: int, edge: int, box: Aabb, direction: Vec3, furthest: float) -> int:
    """Return bits for which of eight are found, from place `i` on; see `find_near_edges`."""
    rows, room = boxes.rows, len(boxes.edge)
    apart = larger(
        _edge_gap(rows, i, room, box.low.x, box.high.x),
        larger(
            _edge_gap(rows, room + i, room, box.low.y, box.high.y),
            _edge_gap(rows, 2 * room + i, room, box.low.z, box.high.z),
        ),
    )
    along = (
        lanes(direction.x) * load_lanes(rows, _DIRECTION * room + i)
        + lanes(direction.y) * load_lanes(rows, (_DIRECTION + 1) * room + i)
        + lanes(direction.z) * load_lanes(rows, (_DIRECTION + 2) * room + i)
    )
    is_out = larger_bits(apart, lanes(0.0)) | larger_bits(along, lanes(furthest))
    return ~(is_out | larger_bits(load_lanes(rows, _ORDER * room + i), lanes(edge - 0.5)))


@inlined
def _edge_gap(rows: FloatArray, at: int, room: int, low: float, high: float) -> Lanes:
    """Return how far apart boxes are along an axis [m], negative where they overlap."""
    above = load_lanes(rows, at) - lanes(high)
    return larger(above, lanes(low) - load_lanes(rows, _HIGH * room + at))
