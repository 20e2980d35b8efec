"""Rows of four in kernels: points with one number more, gathered, summed and stored by vectors.

A row is x, y, z of a point and a 0 or another number, in the precision of its array
(`tissue.core.simd_blocks`). As there each function is also a plain Python function, which runs when
the JIT is off.
"""

from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types

from tissue.core.array_types import FloatArray, SlotArray
from tissue.core.jit import kernel
from tissue.core.simd import (
    EVEN,
    FIRST,
    ODD,
    POINT,
    POINT_IR,
    SECOND,
    Lanes,
    Operand,
    Point,
    in_all_lanes,
    intrinsic,
    shuffled,
    tuple_of,
)
from tissue.core.simd_blocks import BOTH, converted, kind_of, size_of, vector_of, width_of
from tissue.core.simd_rows import fold_in_pairs

_LOW = [x for q in range(0, 16, 4) for x in (q, 16 + q, q + 1, 17 + q)]
_HIGH = [x for q in range(0, 16, 4) for x in (q + 2, 18 + q, q + 3, 19 + q)]
_FORMER = [x for q in range(0, 16, 4) for x in (q, q + 1, 16 + q, 17 + q)]
_LATTER = [x for q in range(0, 16, 4) for x in (q + 2, q + 3, 18 + q, 19 + q)]
"""Orders of a transposition of four by four within each quarter of a vector of singles."""


def store_row(rows: FloatArray, i: int, a: Point) -> None:
    """Write a point into row `i` of an array of shape (n, 4), in its precision."""
    rows[i] = a


@intrinsic(store_row, types.Array, types.Integer, POINT, result=types.void)
def _store_row(builder: Any, rows: Operand, i: Any, a: Any) -> None:
    kind = ir.VectorType(rows.element, 4)
    values = a if kind == POINT_IR else builder.fptrunc(a, kind)
    pointer = builder.bitcast(rows.at(i, 4), kind.as_pointer())
    builder.store(values, pointer, align=4 * size_of(rows.element))


def _row(builder: Any, rows: Operand, i: Any) -> Any:
    kind = ir.VectorType(rows.element, 4)
    pointer = builder.bitcast(rows.at(i, 4), kind.as_pointer())
    return builder.load(pointer, align=4 * size_of(rows.element))


def store_everywhere(rows: FloatArray, i: int, value: float) -> None:
    """Write a number into all four columns of row `i`, for `values_of_rows`."""
    rows[i] = value


@intrinsic(store_everywhere, types.Array, types.Integer, types.Float, result=types.void)
def _store_everywhere(builder: Any, rows: Operand, i: Any, value: Any) -> None:
    kind = ir.VectorType(rows.element, 4)
    values = in_all_lanes(builder, converted(builder, value, rows.element), kind)
    pointer = builder.bitcast(rows.at(i, 4), kind.as_pointer())
    builder.store(values, pointer, align=4 * size_of(rows.element))


def values_of_rows(rows: FloatArray, of: SlotArray, i: int) -> Lanes:
    """Return a number of each of the rows at `of[i]` and the places behind it, shape (n, 4).

    Each row holds its number four times, so that no number moves from lane to lane: the corner
    forces of tetrahedra take 0.96 times as long as with a gather of single numbers.
    """
    places = of[i : i + width_of(rows)]
    return rows[places, np.arange(len(places)) % 4]


@intrinsic(values_of_rows, types.Array, types.Array, types.Integer, result=kind_of)
def _values_of_rows(builder: Any, rows: Operand, of: Operand, i: Any) -> Any:
    n = vector_of(rows).count
    found = [_row(builder, rows, builder.load(of.at(builder.add(i, i.type(k))))) for k in range(n)]
    for lane in range(1, 4):
        order = [4 + c if c == lane else c for c in range(4)]
        for first in range(0, n, 4):
            found[first] = shuffled(builder, found[first], found[first + lane], order)
    made = found[::4]
    while len(made) > 1:
        made = [
            shuffled(builder, a, b, range(2 * a.type.count))
            for a, b in zip(made[::2], made[1::2], strict=True)
        ]
    return made[0]


def sum_of_eight_rows(rows: FloatArray, of: SlotArray, i: int) -> Point:
    """Return the sum of rows `of[i]` to `of[i + 7]` of an array of shape (n, 4), in doubles."""
    return np.asarray(fold_in_pairs(list(rows[of[i : i + 8]])), dtype=np.float64)


@intrinsic(sum_of_eight_rows, types.Array, types.Array, types.Integer, result=POINT)
def _sum_of_eight_rows(builder: Any, rows: Operand, of: Operand, i: Any) -> Any:
    places = [builder.load(of.at(builder.add(i, i.type(k)))) for k in range(8)]
    total = fold_in_pairs([_row(builder, rows, place) for place in places], builder.fadd)
    return total if total.type == POINT_IR else builder.fpext(total, POINT_IR)


def points_of_rows(rows: FloatArray, of: SlotArray, i: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return x, y and z of the rows at `of[i]` and the places behind it, shape (n, 4)."""
    found = rows[of[i : i + width_of(rows)]]
    return found[:, 0].copy(), found[:, 1].copy(), found[:, 2].copy()


def _three(rows: types.Array, *_: types.Type) -> Any:
    return cast(Any, types).UniTuple(kind_of(rows), 3)


@intrinsic(points_of_rows, types.Array, types.Array, types.Integer, result=_three)
def _points_of_rows(builder: Any, rows: Operand, of: Operand, i: Any) -> Any:
    def mixed(a: Any, b: Any, order: Any) -> Any:
        return shuffled(builder, a, b, order)

    n = vector_of(rows).count
    found = [_row(builder, rows, builder.load(of.at(builder.add(i, i.type(k))))) for k in range(n)]
    if n == 8:
        a, b, c, d = (mixed(found[k], found[k + 4], range(8)) for k in range(4))
        ab, cd = mixed(a, b, EVEN), mixed(c, d, EVEN)
        x, z = mixed(ab, cd, FIRST), mixed(ab, cd, SECOND)
        y = mixed(mixed(a, b, ODD), mixed(c, d, ODD), FIRST)
        return tuple_of(builder, [x, y, z])
    quarters = []
    for k in range(4):
        low = mixed(found[k], found[4 + k], range(8))
        high = mixed(found[8 + k], found[12 + k], range(8))
        quarters.append(mixed(low, high, range(16)))
    a, b, c, d = quarters
    ab, cd = mixed(a, b, _LOW), mixed(c, d, _LOW)
    x, y = mixed(ab, cd, _FORMER), mixed(ab, cd, _LATTER)
    z = mixed(mixed(a, b, _HIGH), mixed(c, d, _HIGH), _FORMER)
    return tuple_of(builder, [x, y, z])


@kernel
def row_of_lane(lane: int, width: int) -> int:
    """Return in which of `width` rows `store_rows` writes that lane: without a last shuffle."""
    return lane % 4 * (width // 4) + lane // 4


@kernel
def lane_of_row(row: int, width: int) -> int:
    """Return the lane that is written into a row: the inverse of `row_of_lane`."""
    return row % (width // 4) * 4 + row // (width // 4)


def store_rows(rows: FloatArray, i: int, x: Lanes, y: Lanes, z: Lanes) -> None:
    """Write the points of a vector into as many rows, lane k into row `i + row_of_lane(k)`.

    Args:
        rows: Rows of four, shape (n, 4); the last column becomes z again, which takes two
            operations less than 0.
        i: First row.
        x: First coordinates.
        y: Second coordinates.
        z: Third coordinates.
    """
    n = len(x)
    for lane in range(n):
        rows[i + row_of_lane(lane, n)] = (x[lane], y[lane], z[lane], z[lane])


for _kind in BOTH:

    @intrinsic(store_rows, types.Array, types.Integer, *[_kind] * 3, result=types.void)
    def _store_rows(builder: Any, rows: Operand, i: Any, x: Any, y: Any, z: Any) -> None:
        n = x.type.count
        first, second = (EVEN, ODD) if n == 8 else (_LOW, _HIGH)
        low, high = shuffled(builder, x, y, first), shuffled(builder, x, y, second)
        for k in range(4):
            # x and y of lane k of each four are in `xy`, at `at`.
            if n == 8:
                xy, at = (high if k % 2 else low), 2 * (k // 2)
            else:
                xy, at = (high if k >= 2 else low), 2 * (k % 2)
            order = [c for q in range(0, n, 4) for c in (q + at, q + at + 1, n + q + k, n + q + k)]
            place = rows.at(builder.add(i, i.type(k * n // 4)), 4)
            pointer = builder.bitcast(place, x.type.as_pointer())
            values = shuffled(builder, xy, z, order)
            builder.store(values, pointer, align=4 * size_of(rows.element))
