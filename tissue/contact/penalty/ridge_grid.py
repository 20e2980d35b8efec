"""`RidgeGrid`: boxes around ridges by the cells of two grids, for a ridge that asks which are near.

A box is in the cell of its middle, so that whoever asks looks as far beyond his own box as half of
the largest: the few long ridges have a grid of their own. Both are made anew for each update of the
pairs, by counting.
"""

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
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, aligned, filled, lanes, load_lanes
from tissue.core.simd_gather import larger, larger_bits
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, norm, scale, store, sub, vec3
from tissue.geometry.aabb import Aabb, box_at, empty_box, with_point

_LONG = 0.8
"""Half of the longest side of a box from which a ridge is long, per node size. Larger: those who
ask look farther; smaller: more are in the coarse grid. Measured after 26 strokes, with all of
pairing: 1.33 ms, and 1.37 ms at 0.6."""

_CELL, _LONG_CELL = 1.0, 2.0
"""Edges of the cells for short and for long ridges, per node size. Larger: boxes elsewhere are
looked at; smaller: more rows with less than eight in each."""

_N_ROWS = 10
_HIGH, _DIRECTION, _ORDER = 3, 6, 9
"""The first of the rows for highest corners, behind those for the lowest; for directions; and for
numbers."""


class RidgeBoxes(Arrays):
    """Boxes around ridges in the order of their cells."""

    n_items: IntCell
    """Number of ridges."""
    entered: IntArray
    """The ridges as they were entered, shape (capacity,)."""
    ridge: IntArray
    """The ridges in the order of their cells, shape (capacity + 8,)."""
    half: FloatArray
    """Half of the longest sides of boxes along x, y and z [m], shape (1, 3)."""
    rows: FloatArray
    """In that order x, y, z of lowest and of highest corners [m], x, y, z of unit vectors out of
    the body, or 0, and the number of each ridge that asks itself, or -1; row behind row, shape
    (10 * (capacity + 8),)."""
    cells: Cells


class RidgeGrid(Arrays):
    """All ridges that may be asked for."""

    short: RidgeBoxes
    long: RidgeBoxes
    found: IntArray
    """What the last question found, shape (capacity + 8,)."""


def _new_boxes(capacity: int) -> RidgeBoxes:
    """Return no boxes, with room for that many."""
    room = filled(capacity + WIDTH)
    return RidgeBoxes(
        n_items=0,
        entered=np.zeros(capacity, np.int64),
        ridge=np.zeros(room, np.int64),
        half=np.zeros((1, 3)),
        rows=aligned(_N_ROWS * room),
        cells=new_cells(capacity),
    )


def new_ridge_grid(capacity: int) -> RidgeGrid:
    """Return an empty grid with room for that many ridges."""
    return RidgeGrid(
        short=_new_boxes(capacity),
        long=_new_boxes(capacity),
        found=np.zeros(capacity + WIDTH, np.int64),
    )


@inlined
def enter_ridge(grid: RidgeGrid, ridge: int, box: Aabb, node_size: float) -> None:
    """Enter a ridge with a box around it [m]; `arrange_ridges` is called after the last."""
    side = sub(box.high, box.low)
    if max(side.x, max(side.y, side.z)) > 2.0 * _LONG * node_size:
        grid.long.entered[grid.long.n_items] = ridge
        grid.long.n_items += 1
    else:
        grid.short.entered[grid.short.n_items] = ridge
        grid.short.n_items += 1


@kernel
def arrange_ridges(
    grid: RidgeGrid,
    low: FloatArray,
    high: FloatArray,
    outward: FloatArray,
    asked_at: IntArray,
    now: int,
    node_size: float,
) -> None:
    """Put what was entered into cells.

    Args:
        grid: Written.
        low: Lowest corner of the box of each ridge [m], by its number; shape (n, 3).
        high: Highest corner of that box [m], shape (n, 3).
        outward: Vector out of the body at each, of any length; shape (n, 3).
        asked_at: Update in which each asked last, shape (n,).
        now: This update. Of two ridges that ask in it the one with the higher number finds the
            other.
        node_size: Mean node size [m].
    """
    _arrange_boxes(grid.short, low, high, outward, asked_at, now, _CELL * node_size)
    _arrange_boxes(grid.long, low, high, outward, asked_at, now, _LONG_CELL * node_size)


@kernel
def _arrange_boxes(
    boxes: RidgeBoxes,
    low: FloatArray,
    high: FloatArray,
    outward: FloatArray,
    asked_at: IntArray,
    now: int,
    edge: float,
) -> None:
    """Put boxes into cells of that edge [m], if there are not too many; see `arrange_ridges`."""
    bounds, half = empty_box(), Vec3(0.0, 0.0, 0.0)
    for i in range(boxes.n_items):
        box = box_at(low, high, boxes.entered[i])
        side = sub(box.high, box.low)
        half = Vec3(max(half.x, 0.5 * side.x), max(half.y, 0.5 * side.y), max(half.z, 0.5 * side.z))
        bounds = with_point(bounds, _middle(box))
    store(boxes.half, 0, half)
    lay_cells(boxes.cells, bounds, edge)
    for i in range(boxes.n_items):
        count_thing(boxes.cells, i, _middle(box_at(low, high, boxes.entered[i])))
    end_count(boxes.cells)
    for i in range(boxes.n_items):
        ridge = boxes.entered[i]
        number = ridge if asked_at[ridge] == now else -1
        _write_rows(boxes, i, box_at(low, high, ridge), vec3(outward, ridge), number)


@inlined
def _middle(box: Aabb) -> Vec3:
    """Return the middle of a box [m]."""
    return scale(0.5, add(box.low, box.high))


@inlined
def _write_rows(boxes: RidgeBoxes, i: int, box: Aabb, outward: Vec3, number: int) -> None:
    """Write what is known of ridge `i` of those entered."""
    at, rows, room = take_place(boxes.cells, i), boxes.rows, len(boxes.ridge)
    length = norm(outward)
    per_length = 1.0 / length if length > 0.0 else 0.0
    boxes.ridge[at] = boxes.entered[i]
    rows[at], rows[room + at], rows[2 * room + at] = box.low.x, box.low.y, box.low.z
    rows[_HIGH * room + at] = box.high.x
    rows[(_HIGH + 1) * room + at] = box.high.y
    rows[(_HIGH + 2) * room + at] = box.high.z
    rows[_DIRECTION * room + at] = per_length * outward.x
    rows[(_DIRECTION + 1) * room + at] = per_length * outward.y
    rows[(_DIRECTION + 2) * room + at] = per_length * outward.z
    rows[_ORDER * room + at] = number


@kernel
def find_near_ridges(
    grid: RidgeGrid, ridge: int, box: Aabb, direction: Vec3, furthest: float
) -> int:
    """Write the ridges whose boxes overlap a box to `found`; return how many there are.

    Those that face alike are left out, and of those that ask themselves the one that asks and what
    has a higher number. What faces alike to within rounding may be found.

    Args:
        grid: `found` is written.
        ridge: Number of the ridge that asks.
        box: The box around it [m].
        direction: Vector out of the body at it.
        furthest: Product of that and a unit vector above which they face alike; inf if that does
            not matter.
    """
    n = _find_boxes(grid.short, grid.found, 0, ridge, box, direction, furthest)
    return int(_find_boxes(grid.long, grid.found, n, ridge, box, direction, furthest))


@inlined
def _find_boxes(
    boxes: RidgeBoxes,
    found: IntArray,
    n: int,
    ridge: int,
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
                bits = _near(boxes, i, ridge, box, direction, furthest)
                n = note_found(found, boxes.ridge, i, end, bits, n)
                i += WIDTH
    return n


@inlined
def _near(
    boxes: RidgeBoxes, i: int, ridge: int, box: Aabb, direction: Vec3, furthest: float
) -> int:
    """Return bits for which of eight are asked for, from place `i` on; see `find_near_ridges`."""
    rows, room = boxes.rows, len(boxes.ridge)
    apart = larger(
        _gap(rows, i, room, box.low.x, box.high.x),
        larger(
            _gap(rows, room + i, room, box.low.y, box.high.y),
            _gap(rows, 2 * room + i, room, box.low.z, box.high.z),
        ),
    )
    along = (
        lanes(direction.x) * load_lanes(rows, _DIRECTION * room + i)
        + lanes(direction.y) * load_lanes(rows, (_DIRECTION + 1) * room + i)
        + lanes(direction.z) * load_lanes(rows, (_DIRECTION + 2) * room + i)
    )
    is_out = larger_bits(apart, lanes(0.0)) | larger_bits(along, lanes(furthest))
    return ~(is_out | larger_bits(load_lanes(rows, _ORDER * room + i), lanes(ridge - 0.5)))


@inlined
def _gap(rows: FloatArray, at: int, room: int, low: float, high: float) -> Lanes:
    """Return how far apart boxes are along an axis [m], negative where they overlap."""
    above = load_lanes(rows, at) - lanes(high)
    return larger(above, lanes(low) - load_lanes(rows, _HIGH * room + at))
