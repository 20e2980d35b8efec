"""Rows of an array in vectors: eight at a time by columns, sums over rows, and comparisons.

As in `tissue.core.simd` each function is also a plain Python function, which runs when the JIT is
off.
"""

import operator
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.simd import (
    I32,
    I64,
    LANES,
    LANES_IR,
    LANES_OF_SINGLES,
    POINT_IR,
    THREE_LANES,
    UNFUSED,
    WIDTH,
    Lanes,
    Operand,
    declared,
    intrinsic,
    shuffled,
    transposed,
    tuple_of,
)

_FOUR = cast(Any, types).UniTuple(LANES, 4)
_SPREAD, _BEHIND = [0, 8, 1, 9, 2, 10, 3, 11], [4, 12, 5, 13, 6, 14, 7, 15]


def points_of_column(points: FloatArray, of: IntArray, i: int, q: int) -> Any:
    """Return x, y and z of rows `of[i, q]` to `of[i + 7, q]` of an array of shape (n, 3).

    `of` has four columns. Of `points` four doubles are read for each, as by `eight_points`.
    """
    rows = points[of[i : i + WIDTH, q]]
    return rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy()


@intrinsic(
    points_of_column, types.Array, types.Array, types.Integer, types.Integer, result=THREE_LANES
)
def _points_of_column(builder: Any, points: Operand, of: Operand, i: Any, q: Any) -> Any:
    first = of.at(i, 4)
    rows = []
    for k in range(WIDTH):
        at = builder.add(builder.sext(q, I64) if q.type.width < 64 else q, ir.Constant(I64, 4 * k))
        row = points.at(builder.load(builder.gep(first, [at])), 3)
        rows.append(builder.load(builder.bitcast(row, POINT_IR.as_pointer()), align=8))
    return tuple_of(builder, transposed(builder, rows))


def rows_of_three(rows: FloatArray, i: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return the columns of rows `i` to `i + 7` of an array of shape (n, 3)."""
    a = rows[i : i + WIDTH]
    return a[:, 0].copy(), a[:, 1].copy(), a[:, 2].copy()


@intrinsic(rows_of_three, types.Array, types.Integer, result=THREE_LANES)
def _rows_of_three(builder: Any, rows: Operand, i: Any) -> Any:
    a, b, c = _vectors(builder, rows.at(i, 3), 3)
    columns = []
    for k, order in enumerate(([0, 1, 2, 3, 4, 5, 10, 13], [0, 1, 2, 3, 4, 8, 11, 14])):
        ab = shuffled(builder, a, b, [min(k + 3 * row, 15) for row in range(WIDTH)])
        columns.append(shuffled(builder, ab, c, order))
    ab = shuffled(builder, a, b, [min(2 + 3 * row, 15) for row in range(WIDTH)])
    columns.append(shuffled(builder, ab, c, [0, 1, 2, 3, 4, 9, 12, 15]))
    return tuple_of(builder, columns)


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


@intrinsic(store_rows_of_three, types.Array, types.Integer, LANES, LANES, LANES, result=types.void)
def _store_rows_of_three(builder: Any, rows: Operand, i: Any, x: Any, y: Any, z: Any) -> None:
    # Number 3 r + c of all is column c of row r.
    vectors = []
    for first in range(0, 3 * WIDTH, WIDTH):
        places = [divmod(first + k, 3) for k in range(WIDTH)]
        xy = shuffled(builder, x, y, [row + WIDTH * min(c, 1) for row, c in places])
        order = [k if c < 2 else WIDTH + row for k, (row, c) in enumerate(places)]
        vectors.append(shuffled(builder, xy, z, order))
    _store_vectors(builder, rows.at(i, 3), vectors)


def rows_of_four(rows: FloatArray, i: int) -> Any:
    """Return the columns of rows `i` to `i + 7` of an array of shape (n, 4)."""
    a = rows[i : i + WIDTH]
    return a[:, 0].copy(), a[:, 1].copy(), a[:, 2].copy(), a[:, 3].copy()


@intrinsic(rows_of_four, types.Array, types.Integer, result=_FOUR)
def _rows_of_four(builder: Any, rows: Operand, i: Any) -> Any:
    a, b, c, d = _vectors(builder, rows.at(i, 4), 4)
    columns = []
    for k in range(4):
        order = [k, 4 + k, 8 + k, 12 + k] * 2
        ab, cd = shuffled(builder, a, b, order), shuffled(builder, c, d, order)
        columns.append(shuffled(builder, ab, cd, [0, 1, 2, 3, 8, 9, 10, 11]))
    return tuple_of(builder, columns)


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


@intrinsic(store_rows_of_four, types.Array, types.Integer, *[LANES] * 4, result=types.void)
@intrinsic(store_rows_of_four, types.Array, types.Integer, *[UNFUSED] * 4, result=types.void)
def _store_rows_of_four(
    builder: Any, rows: Operand, i: Any, a: Any, b: Any, c: Any, d: Any
) -> None:
    vectors = []
    for order in (_SPREAD, _BEHIND):
        ab, cd = shuffled(builder, a, b, order), shuffled(builder, c, d, order)
        vectors.append(shuffled(builder, ab, cd, [0, 1, 8, 9, 2, 3, 10, 11]))
        vectors.append(shuffled(builder, ab, cd, [4, 5, 12, 13, 6, 7, 14, 15]))
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


@intrinsic(add_to_row, types.Array, types.Integer, *[types.Float] * 4, result=types.void)
def _add_to_row(builder: Any, rows: Operand, i: Any, factor: Any, x: Any, y: Any, z: Any) -> None:
    first, pair = rows.at(i, 3), ir.VectorType(ir.DoubleType(), 2)
    made = ir.Constant(pair, ir.Undefined)
    both, twice = made, made
    for k, value in enumerate((x, y)):
        both = builder.insert_element(both, value, ir.Constant(ir.IntType(32), k))
        twice = builder.insert_element(twice, factor, ir.Constant(ir.IntType(32), k))
    # Products and sums are rounded apart, as those of scalars are.
    low, last = (
        builder.bitcast(first, pair.as_pointer()),
        builder.gep(first, [ir.Constant(I64, 2)]),
    )
    total = builder.fadd(builder.load(low, align=8), builder.fmul(twice, both))
    builder.store(total, low, align=8)
    builder.store(builder.fadd(builder.load(last), builder.fmul(factor, z)), last)


def _vectors(builder: Any, first: Any, n: int) -> list[Any]:
    pointer = builder.bitcast(first, LANES_IR.as_pointer())
    return [builder.load(builder.gep(pointer, [ir.Constant(I64, k)]), align=8) for k in range(n)]


def _store_vectors(builder: Any, first: Any, vectors: list[Any]) -> None:
    pointer = builder.bitcast(first, LANES_IR.as_pointer())
    for k, vector in enumerate(vectors):
        builder.store(vector, builder.gep(pointer, [ir.Constant(I64, k)]), align=8)


def sum_of_eight(values: FloatArray, of: SlotArray, i: int) -> float:
    """Return the sum of `values` at `of[i]` to `of[i + 7]`."""
    return float(fold_in_pairs(list(values[of[i : i + WIDTH]])))


@intrinsic(sum_of_eight, types.Array, types.Array, types.Integer, result=types.float64)
def _sum_of_eight(builder: Any, values: Operand, of: Operand, i: Any) -> Any:
    places = (builder.load(of.at(builder.add(i, i.type(k)))) for k in range(WIDTH))
    total = fold_in_pairs([builder.load(values.at(place)) for place in places], builder.fadd)
    return total if total.type == ir.DoubleType() else builder.fpext(total, ir.DoubleType())


def natural(i: int) -> int:
    """Return `i`, which is not negative: then an index by it needs no test of its sign.

    Numba counts negative indices from the end, which takes three instructions an access; loops over
    nodes with a few dozen instructions a node have a dozen accesses.
    """
    return i


@intrinsic(natural, types.Integer, result=types.int64)
def _natural(builder: Any, i: Any) -> Any:
    is_natural = builder.icmp_signed(">=", i, i.type(0))
    kind = ir.FunctionType(ir.VoidType(), [ir.IntType(1)])
    builder.call(declared(builder.module, "llvm.assume", kind), [is_natural])
    return i if i.type == I64 else builder.sext(i, I64)


def larger(a: Lanes, b: Lanes) -> Lanes:
    """Return the larger of `a` and `b` in each lane; `b` where they cannot be compared (NaN)."""
    return np.where(a > b, a, b)


@intrinsic(larger, LANES, LANES)
@intrinsic(larger, UNFUSED, UNFUSED, result=UNFUSED)
@intrinsic(larger, LANES_OF_SINGLES, LANES_OF_SINGLES, result=LANES_OF_SINGLES)
def _larger(builder: Any, a: Any, b: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", a, b), a, b)


def where_larger(a: Lanes, b: Lanes, this: Lanes, other: Lanes) -> Lanes:
    """Return `this` in lanes where `a` is larger than `b`, and `other` in the others."""
    return np.where(a > b, this, other)


@intrinsic(where_larger, LANES, LANES, LANES, LANES)
@intrinsic(where_larger, UNFUSED, UNFUSED, UNFUSED, UNFUSED, result=UNFUSED)
@intrinsic(where_larger, *[LANES_OF_SINGLES] * 4, result=LANES_OF_SINGLES)
def _where_larger(builder: Any, a: Any, b: Any, this: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", a, b), this, other)


def largest(a: Lanes) -> float:
    """Return the largest of the numbers of a vector."""
    return float(a.max())


@intrinsic(largest, LANES, result=types.float64)
@intrinsic(largest, LANES_OF_SINGLES, result=types.float64)
def _largest(builder: Any, a: Any) -> Any:
    values = [builder.extract_element(a, I32(k)) for k in range(a.type.count)]
    found = fold_in_pairs(
        values, lambda b, c: builder.select(builder.fcmp_ordered(">", b, c), b, c)
    )
    return found if found.type == ir.DoubleType() else builder.fpext(found, ir.DoubleType())


def any_above(a: Lanes, b: Lanes) -> bool:
    """Return whether `a` is above `b` in any lane, or cannot be compared with it (NaN)."""
    return bool((~(a <= b)).any())


@intrinsic(any_above, LANES, LANES, result=types.boolean)
@intrinsic(any_above, LANES_OF_SINGLES, LANES_OF_SINGLES, result=types.boolean)
def _any_above(builder: Any, a: Any, b: Any) -> Any:
    bits = ir.IntType(a.type.count)
    above = builder.bitcast(builder.fcmp_unordered(">", a, b), bits)
    return builder.icmp_unsigned("!=", above, bits(0))


def larger_bits(a: Lanes, b: Lanes) -> int:
    """Return a number whose bit k is 1 where `a` is larger than `b` in lane k."""
    return int(np.packbits(a > b, bitorder="little")[0])


@intrinsic(larger_bits, LANES, LANES, result=types.int64)
@intrinsic(larger_bits, UNFUSED, UNFUSED, result=types.int64)
def _larger_bits(builder: Any, a: Any, b: Any) -> Any:
    bits = builder.bitcast(builder.fcmp_ordered(">", a, b), ir.IntType(WIDTH))
    return builder.zext(bits, ir.IntType(64))


def first_bit(bits: int) -> int:
    """Return the number of the lowest bit that is 1, from 0; one is."""
    return int(bits & -bits).bit_length() - 1


@intrinsic(first_bit, types.Integer, result=types.int64)
def _first_bit(builder: Any, bits: Any) -> Any:
    function = declared(builder.module, "llvm.cttz.i64", ir.FunctionType(I64, [I64, ir.IntType(1)]))
    return builder.call(function, [bits, ir.IntType(1)(1)])


def fold_in_pairs(terms: list[Any], add: Any = operator.add) -> Any:
    """Return the sum of eight, or another fold: neighbours first, so that no operation waits."""
    while len(terms) > 1:
        terms = [add(a, b) for a, b in zip(terms[::2], terms[1::2], strict=True)]
    return terms[0]
