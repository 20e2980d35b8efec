"""Vector operations on blocks of eight tetrahedra: gathers by node, and rows of forces on corners.

As in `tissue.simd` each is also a plain Python function, which runs when the JIT is off.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types

from tissue.simd import (
    _EVEN,
    _FIRST,
    _I32,
    _I64,
    _ODD,
    _POINT,
    _SECOND,
    _VECTOR,
    LANES,
    POINT,
    WIDTH,
    Lanes,
    Point,
    _Array,
    _compiled,
    _shuffled,
)
from tissue.types import FloatArray, SlotArray


def gathered(values: FloatArray, of: SlotArray, i: int) -> Lanes:
    """Return `values` at `of[i]` to `of[i + 7]`."""
    return values[of[i : i + WIDTH]]


@_compiled(gathered, types.Array, types.Array, types.Integer)
def _gathered(builder: Any, values: _Array, of: _Array, i: Any) -> Any:
    made = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(WIDTH):
        place = builder.load(of.at(builder.add(i, i.type(lane))))
        made = builder.insert_element(made, builder.load(values.at(place)), _I32(lane))
    return made


def sum_of_quarters(values: FloatArray, of: SlotArray, i: int) -> float:
    """Return the sum of `values` at a quarter of `of[i]` to `of[i + 7]`, rounded down."""
    return _tree([values[place >> 2] for place in of[i : i + WIDTH]])


@_compiled(sum_of_quarters, types.Array, types.Array, types.Integer, result=types.float64)
def _sum_of_quarters(builder: Any, values: _Array, of: _Array, i: Any) -> Any:
    terms = []
    for k in range(WIDTH):
        place = builder.load(of.at(builder.add(i, i.type(k))))
        terms.append(builder.load(values.at(builder.ashr(place, place.type(2)))))
    return _tree(terms, builder.fadd)


def sum_of_rows(rows: FloatArray, of: SlotArray, i: int) -> Point:
    """Return the sum of rows `of[i]` to `of[i + 7]` of an array of shape (n, 4)."""
    return _tree([rows[place] for place in of[i : i + WIDTH]])


@_compiled(sum_of_rows, types.Array, types.Array, types.Integer, result=POINT)
def _sum_of_rows(builder: Any, rows: _Array, of: _Array, i: Any) -> Any:
    terms = []
    for k in range(WIDTH):
        pointer = rows.at(builder.load(of.at(builder.add(i, i.type(k)))), 4)
        terms.append(builder.load(builder.bitcast(pointer, _POINT.as_pointer()), align=8))
    return _tree(terms, builder.fadd)


def _tree(terms: list[Any], add: Any = np.add) -> Any:
    """Sum of eight, neighbours first: the additions need not wait for each other."""
    while len(terms) > 1:
        terms = [add(a, b) for a, b in zip(terms[::2], terms[1::2], strict=True)]
    return terms[0]


def store_pairs(
    rows: FloatArray, i: int, x: Lanes, y: Lanes, z: Lanes, u: Lanes, v: Lanes, w: Lanes
) -> None:
    """Write eight points x, y, z and a 0 into rows i, i + 4, ..., and u, v, w and a 0 behind each.

    `rows` has shape (n, 4).
    """
    zero = np.zeros(WIDTH)
    rows[i : i + 4 * WIDTH : 4] = np.stack([x, y, z, zero], axis=1)
    rows[i + 1 : i + 1 + 4 * WIDTH : 4] = np.stack([u, v, w, zero], axis=1)


@_compiled(store_pairs, types.Array, types.Integer, *[LANES] * 6, result=types.void)
def _store_pairs(builder: Any, rows: _Array, i: Any, x: Any, y: Any, z: Any, *uvw: Any) -> None:
    u, v, w = uvw
    zero = ir.Constant(_VECTOR, [0.0] * WIDTH)

    def shuffled(pairs: list[tuple[Any, Any]], orders: tuple[Any, Any]) -> list[Any]:
        return [_shuffled(builder, *pair, order) for order in orders for pair in pairs]

    # The eight vectors as rows of a matrix of 8 x 8, transposed in three rounds of eight shuffles.
    xy0, z00, uv0, w00, xy1, z01, uv1, w01 = shuffled(
        [(x, y), (z, zero), (u, v), (w, zero)], (_EVEN, _ODD)
    )
    a04, u04, a26, u26 = shuffled([(xy0, z00), (uv0, w00)], (_FIRST, _SECOND))
    a15, u15, a37, u37 = shuffled([(xy1, z01), (uv1, w01)], (_FIRST, _SECOND))
    low, high = [*range(4), *range(8, 12)], [*range(4, 8), *range(12, 16)]
    points = shuffled([(a04, u04), (a15, u15), (a26, u26), (a37, u37)], (low, high))
    for lane, values in enumerate(points):
        place = builder.add(i, i.type(4 * lane))
        if place.type.width < 64:
            place = builder.sext(place, _I64)
        pointer = builder.bitcast(rows.at(place, 4), _VECTOR.as_pointer())
        builder.store(values, pointer, align=8)
