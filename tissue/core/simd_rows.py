"""Eight rows of an array at a time inside kernels, column by column.

As in `tissue.core.simd` each function is also a plain Python function, which runs when the JIT is
off.
"""

from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.simd import (
    _I64,
    _POINT,
    _THREE,
    _VECTOR,
    LANES,
    UNFUSED,
    WIDTH,
    Lanes,
    _Array,
    _compiled,
    _shuffled,
    _transposed,
    _tuple_of,
)

_FOUR = cast(Any, types).UniTuple(LANES, 4)
_SPREAD, _BEHIND = [0, 8, 1, 9, 2, 10, 3, 11], [4, 12, 5, 13, 6, 14, 7, 15]


def points_of_column(points: FloatArray, of: IntArray, i: int, q: int) -> Any:
    """Return x, y and z of rows `of[i, q]` to `of[i + 7, q]` of an array of shape (n, 3).

    `of` has four columns. Of `points` four doubles are read for each, as by `eight_points`.
    """
    rows = points[of[i : i + WIDTH, q]]
    return rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy()


@_compiled(points_of_column, types.Array, types.Array, types.Integer, types.Integer, result=_THREE)
def _points_of_column(builder: Any, points: _Array, of: _Array, i: Any, q: Any) -> Any:
    first = of.at(i, 4)
    rows = []
    for k in range(WIDTH):
        at = builder.add(
            builder.sext(q, _I64) if q.type.width < 64 else q, ir.Constant(_I64, 4 * k)
        )
        row = points.at(builder.load(builder.gep(first, [at])), 3)
        rows.append(builder.load(builder.bitcast(row, _POINT.as_pointer()), align=8))
    return _tuple_of(builder, _transposed(builder, rows))


def rows_of_three(rows: FloatArray, i: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return the columns of rows `i` to `i + 7` of an array of shape (n, 3)."""
    a = rows[i : i + WIDTH]
    return a[:, 0].copy(), a[:, 1].copy(), a[:, 2].copy()


@_compiled(rows_of_three, types.Array, types.Integer, result=_THREE)
def _rows_of_three(builder: Any, rows: _Array, i: Any) -> Any:
    a, b, c = _vectors(builder, rows.at(i, 3), 3)
    columns = []
    for k, order in enumerate(([0, 1, 2, 3, 4, 5, 10, 13], [0, 1, 2, 3, 4, 8, 11, 14])):
        ab = _shuffled(builder, a, b, [min(k + 3 * row, 15) for row in range(WIDTH)])
        columns.append(_shuffled(builder, ab, c, order))
    ab = _shuffled(builder, a, b, [min(2 + 3 * row, 15) for row in range(WIDTH)])
    columns.append(_shuffled(builder, ab, c, [0, 1, 2, 3, 4, 9, 12, 15]))
    return _tuple_of(builder, columns)


def store_rows_of_three(rows: FloatArray, i: int, x: Lanes, y: Lanes, z: Lanes) -> None:
    """Write eight rows of an array of shape (n, 3).

    Args:
        rows: The array.
        i: First row.
        x: First column of the rows.
        y: Second column.
        z: Third column.
    """
    for column, values in enumerate((x, y, z)):
        rows[i : i + WIDTH, column] = values


@_compiled(store_rows_of_three, types.Array, types.Integer, LANES, LANES, LANES, result=types.void)
def _store_rows_of_three(builder: Any, rows: _Array, i: Any, x: Any, y: Any, z: Any) -> None:
    # Number 3 r + c of all is column c of row r.
    vectors = []
    for first in range(0, 3 * WIDTH, WIDTH):
        places = [divmod(first + k, 3) for k in range(WIDTH)]
        xy = _shuffled(builder, x, y, [row + WIDTH * min(c, 1) for row, c in places])
        order = [k if c < 2 else WIDTH + row for k, (row, c) in enumerate(places)]
        vectors.append(_shuffled(builder, xy, z, order))
    _store_vectors(builder, rows.at(i, 3), vectors)


def rows_of_four(rows: FloatArray, i: int) -> Any:
    """Return the columns of rows `i` to `i + 7` of an array of shape (n, 4)."""
    a = rows[i : i + WIDTH]
    return a[:, 0].copy(), a[:, 1].copy(), a[:, 2].copy(), a[:, 3].copy()


@_compiled(rows_of_four, types.Array, types.Integer, result=_FOUR)
def _rows_of_four(builder: Any, rows: _Array, i: Any) -> Any:
    a, b, c, d = _vectors(builder, rows.at(i, 4), 4)
    columns = []
    for k in range(4):
        order = [k, 4 + k, 8 + k, 12 + k] * 2
        ab, cd = _shuffled(builder, a, b, order), _shuffled(builder, c, d, order)
        columns.append(_shuffled(builder, ab, cd, [0, 1, 2, 3, 8, 9, 10, 11]))
    return _tuple_of(builder, columns)


def store_rows_of_four(rows: FloatArray, i: int, a: Lanes, b: Lanes, c: Lanes, d: Lanes) -> None:
    """Write rows `i` to `i + 7` of an array of shape (n, 4), given by columns.

    Args:
        rows: Written.
        i: First row.
        a: First column.
        b: Second column.
        c: Third column.
        d: Fourth column.
    """
    for column, values in enumerate((a, b, c, d)):
        rows[i : i + WIDTH, column] = values


@_compiled(store_rows_of_four, types.Array, types.Integer, *[LANES] * 4, result=types.void)
@_compiled(store_rows_of_four, types.Array, types.Integer, *[UNFUSED] * 4, result=types.void)
def _store_rows_of_four(builder: Any, rows: _Array, i: Any, a: Any, b: Any, c: Any, d: Any) -> None:
    vectors = []
    for order in (_SPREAD, _BEHIND):
        ab, cd = _shuffled(builder, a, b, order), _shuffled(builder, c, d, order)
        vectors.append(_shuffled(builder, ab, cd, [0, 1, 8, 9, 2, 3, 10, 11]))
        vectors.append(_shuffled(builder, ab, cd, [4, 5, 12, 13, 6, 7, 14, 15]))
    _store_vectors(builder, rows.at(i, 4), vectors)


def add_to_row(rows: FloatArray, i: int, factor: float, x: float, y: float, z: float) -> None:
    """Add a multiple of a vector to row `i` of an array of shape (n, 3).

    Args:
        rows: The array; written.
        i: Row, not negative.
        factor: Factor.
        x: First component of the vector.
        y: Second component.
        z: Third component.
    """
    rows[i] += factor * np.array([x, y, z])


@_compiled(add_to_row, types.Array, types.Integer, *[types.Float] * 4, result=types.void)
def _add_to_row(builder: Any, rows: _Array, i: Any, factor: Any, x: Any, y: Any, z: Any) -> None:
    first, pair = rows.at(i, 3), ir.VectorType(ir.DoubleType(), 2)
    made = ir.Constant(pair, ir.Undefined)
    both, twice = made, made
    for k, value in enumerate((x, y)):
        both = builder.insert_element(both, value, ir.Constant(ir.IntType(32), k))
        twice = builder.insert_element(twice, factor, ir.Constant(ir.IntType(32), k))
    # Products and sums are rounded apart, as those of scalars are.
    low, last = (
        builder.bitcast(first, pair.as_pointer()),
        builder.gep(first, [ir.Constant(_I64, 2)]),
    )
    total = builder.fadd(builder.load(low, align=8), builder.fmul(twice, both))
    builder.store(total, low, align=8)
    builder.store(builder.fadd(builder.load(last), builder.fmul(factor, z)), last)


def _vectors(builder: Any, first: Any, n: int) -> list[Any]:
    pointer = builder.bitcast(first, _VECTOR.as_pointer())
    return [builder.load(builder.gep(pointer, [ir.Constant(_I64, k)]), align=8) for k in range(n)]


def _store_vectors(builder: Any, first: Any, vectors: list[Any]) -> None:
    pointer = builder.bitcast(first, _VECTOR.as_pointer())
    for k, vector in enumerate(vectors):
        builder.store(vector, builder.gep(pointer, [ir.Constant(_I64, k)]), align=8)
