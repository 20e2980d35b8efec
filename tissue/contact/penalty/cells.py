"""`Cells`: the cells of a grid, by which nodes or boxes are sorted.

What is in cells beside each other along x is one after the other, so that a box covers a few rows,
of each of which what is there can be read eight at a time. Sorting is by counting.
"""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH
from tissue.core.simd_gather import first_bit, natural
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, store
from tissue.geometry.aabb import Aabb, widened

_MOST_CELLS = 1 << 14
"""Cells of a grid at most. More: what is in a body that extends far is told apart better, and each
sorting takes longer."""

_ROUNDING = 1e-9
"""By how much a box is widened before its cells are found [m]."""


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
        bits: Which of the eight are asked for.
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
