"""Rows of eleven numbers in kernels: summed as rows, and turned into columns for `Lanes`.

A row has room for sixteen, so that it begins with a cache line: in single precision it is one
vector, in double two. To sum five to thirty rows and turn the sums takes a third of the
operations of gathers of their numbers.

As in `tissue.core.simd` each function is also a plain Python function, which runs when the JIT is
off.
"""

from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types

from tissue.core.array_types import FloatArray, SlotArray
from tissue.core.simd import I64, WIDTH, Lanes, Operand, in_all_lanes, intrinsic, shuffled, tuple_of
from tissue.core.simd_blocks import BOTH, converted, kind_of, size_of, width_of
from tissue.core.simd_rows import fold_in_pairs

N_COLUMNS = 11
"""Numbers of a row."""

N_ROOM = 16
"""Numbers for which a row has room."""

Columns = tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]
"""The columns of as many rows as a vector has lanes."""

_PAIR_LOW = [0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29]
_PAIR_HIGH = [2 + k for k in _PAIR_LOW]
_BOTH_LOW = [0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29]
_BOTH_HIGH = [2 + k for k in _BOTH_LOW]
"""Orders of a transposition of four by four within each quarter of a vector of sixteen."""

_EVEN, _ODD = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
"""Orders of one of two by two within each quarter of a vector of eight."""


def _columns_of(array: types.Array, *_: types.Type) -> Any:
    return cast(Any, types).UniTuple(kind_of(array), N_COLUMNS)


def sums_of_four_rows(rows: FloatArray, of: SlotArray, i: int) -> Columns:
    """Return the columns of the sums of four rows each.

    Args:
        rows: The rows, shape (n, 16).
        of: Places of rows: those that are first in the sums, one for each lane, those that are
            second, and so on.
        i: Of the first of these in `of`.
    """
    n = width_of(rows)
    terms = [rows[of[i + k * n : i + (k + 1) * n], :N_COLUMNS] for k in range(4)]
    return cast(Columns, tuple(np.ascontiguousarray(fold_in_pairs(terms).T)))


@intrinsic(sums_of_four_rows, types.Array, types.Array, types.Integer, result=_columns_of)
def _sums_of_four_rows(builder: Any, rows: Operand, of: Operand, i: Any) -> Any:
    n, found = _width(rows), []
    for lane in range(n):
        places = [builder.load(of.at(builder.add(i, i.type(k * n + lane)))) for k in range(4)]
        found.append(_sum(builder, [_row(builder, rows, place) for place in places]))
    return tuple_of(builder, _turned(builder, found))


def columns_of_rows(rows: FloatArray, i: int) -> Columns:
    """Return the columns of as many rows from `i` on as a vector has lanes, shape (n, 16)."""
    return cast(Columns, tuple(np.ascontiguousarray(rows[i : i + width_of(rows), :N_COLUMNS].T)))


@intrinsic(columns_of_rows, types.Array, types.Integer, result=_columns_of)
def _columns_of_rows(builder: Any, rows: Operand, i: Any) -> Any:
    found = [_row(builder, rows, builder.add(i, i.type(k))) for k in range(_width(rows))]
    return tuple_of(builder, _turned(builder, found))


def store_columns(rows: FloatArray, i: int, columns: Columns) -> None:
    """Write columns to as many rows from `i` on as a vector has lanes, shape (n, 16)."""
    rows[i : i + width_of(rows), :N_COLUMNS] = np.array(columns).T


for _kind in BOTH:

    @intrinsic(
        store_columns,
        types.Array,
        types.Integer,
        cast(Any, types).UniTuple(_kind, N_COLUMNS),
        result=types.void,
    )
    def _store_columns(builder: Any, rows: Operand, i: Any, columns: Any) -> None:
        made = [builder.extract_value(columns, k) for k in range(N_COLUMNS)]
        for k, row in enumerate(_turned_back(builder, made)):
            _store(builder, rows, builder.add(i, i.type(k)), row)


def store_sum_of_rows(
    out: FloatArray, row: int, factor: float, rows: FloatArray, of: SlotArray, i: int, n: int
) -> None:
    """Write the sum of rows, times a factor, to a row of `out`.

    Args:
        out: Written, shape (n, 16).
        row: The row.
        factor: The factor.
        rows: The rows, shape (n, 16).
        of: Their places, a multiple of eight.
        i: Of the first of these in `of`.
        n: How many places count. Those behind them, up to a multiple of eight, are of zeros.
    """
    total = np.zeros(N_COLUMNS, rows.dtype)
    for first in range(i, i + n, WIDTH):
        terms = list(rows[of[first : first + WIDTH], :N_COLUMNS])
        total = total + fold_in_pairs(terms)
    out[row, :N_COLUMNS] = rows.dtype.type(factor) * total


@intrinsic(
    store_sum_of_rows,
    types.Array,
    types.Integer,
    types.Float,
    types.Array,
    types.Array,
    types.Integer,
    types.Integer,
    result=types.void,
)
def _store_sum_of_rows(
    builder: Any, out: Operand, row: Any, factor: Any, rows: Operand, of: Operand, i: Any, n: Any
) -> None:
    i, n = (builder.sext(k, I64) if k.type.width < 64 else k for k in (i, n))
    made: Any = cgutils
    totals = [made.alloca_once_value(builder, ir.Constant(kind, None)) for kind in _parts(rows)]
    end = builder.add(i, n)
    with made.for_range_slice(builder, i, end, I64(WIDTH), intp=I64) as (first, _):
        places = [builder.load(of.at(builder.add(first, I64(k)))) for k in range(WIDTH)]
        more = _sum(builder, [_row(builder, rows, place) for place in places])
        for total, part in zip(totals, more, strict=True):
            builder.store(builder.fadd(builder.load(total), part), total)
    scaled = []
    for total in totals:
        value = builder.load(total)
        times = converted(builder, factor, rows.element)
        scaled.append(builder.fmul(in_all_lanes(builder, times, value.type), value))
    _store(builder, out, row, scaled)


def _width(rows: Operand) -> int:
    return 16 if isinstance(rows.element, ir.FloatType) else 8


def _parts(rows: Operand) -> list[Any]:
    """Return LLVM's types of the vectors that a row is read as."""
    counts = [16] if isinstance(rows.element, ir.FloatType) else [8, 8]
    return [ir.VectorType(rows.element, count) for count in counts]


def _pointers(builder: Any, rows: Operand, i: Any) -> list[Any]:
    first = rows.at(i, N_ROOM)
    starts = [first, builder.gep(first, [I64(8)])]
    return [
        builder.bitcast(start, kind.as_pointer())
        for start, kind in zip(starts, _parts(rows), strict=False)
    ]


def _row(builder: Any, rows: Operand, i: Any) -> list[Any]:
    """Return a row as vectors."""
    align = 2 * size_of(rows.element)
    return [builder.load(pointer, align=align) for pointer in _pointers(builder, rows, i)]


def _store(builder: Any, rows: Operand, i: Any, row: list[Any]) -> None:
    align = 2 * size_of(rows.element)
    for pointer, part in zip(_pointers(builder, rows, i), row, strict=True):
        builder.store(part, pointer, align=align)


def _sum(builder: Any, rows: list[list[Any]]) -> list[Any]:
    """Return the sum of rows."""
    return [fold_in_pairs(list(parts), builder.fadd) for parts in zip(*rows, strict=True)]


def _turned(builder: Any, rows: list[list[Any]]) -> list[Any]:
    """Return the columns of rows."""

    def mixed(a: Any, b: Any, order: Any) -> Any:
        return shuffled(builder, a, b, order)

    if len(rows) == 16:
        return _turned_sixteen(mixed, [row[0] for row in rows])[:N_COLUMNS]
    parts = [_turned_eight(mixed, [row[part] for row in rows]) for part in range(2)]
    return [*parts[0], *parts[1]][:N_COLUMNS]


def _turned_back(builder: Any, columns: list[Any]) -> list[list[Any]]:
    """Return the rows of columns."""

    def mixed(a: Any, b: Any, order: Any) -> Any:
        return shuffled(builder, a, b, order)

    zero = ir.Constant(columns[0].type, None)
    whole = columns + [zero] * (N_ROOM - len(columns))
    if zero.type.count == N_ROOM:
        return [[row] for row in _turned_sixteen(mixed, whole)]
    parts = [_turned_eight(mixed, whole[first : first + 8]) for first in (0, 8)]
    return [list(row) for row in zip(*parts, strict=True)]


def _turned_sixteen(mixed: Any, rows: list[Any]) -> list[Any]:
    """Return the transposition of sixteen vectors of sixteen."""
    quarters = []
    for first in range(0, 16, 4):
        a, b, c, d = rows[first : first + 4]
        ab, cd = mixed(a, b, _PAIR_LOW), mixed(c, d, _PAIR_LOW)
        more = mixed(a, b, _PAIR_HIGH), mixed(c, d, _PAIR_HIGH)
        quarters.append(
            [
                mixed(ab, cd, _BOTH_LOW),
                mixed(ab, cd, _BOTH_HIGH),
                mixed(more[0], more[1], _BOTH_LOW),
                mixed(more[0], more[1], _BOTH_HIGH),
            ]
        )
    made = [_turned_quarters(mixed, [quarter[j] for quarter in quarters]) for j in range(4)]
    return [made[k % 4][k // 4] for k in range(16)]


def _turned_eight(mixed: Any, rows: list[Any]) -> list[Any]:
    """Return the transposition of eight vectors of eight."""
    even = [mixed(rows[k], rows[k + 1], _EVEN) for k in range(0, 8, 2)]
    odd = [mixed(rows[k], rows[k + 1], _ODD) for k in range(0, 8, 2)]
    both = [_turned_quarters(mixed, pairs) for pairs in (even, odd)]
    return [both[k % 2][k // 2] for k in range(8)]


def _turned_quarters(mixed: Any, a: list[Any]) -> list[Any]:
    """Return the transposition of four vectors of four quarters."""
    n = a[0].type.count
    low, high = range(n // 2), range(n // 2, n)

    def halves(x: Any, y: Any, half: range) -> Any:
        return mixed(x, y, [*half, *(n + k for k in half)])

    quarter = n // 4
    first = [c for q in (0, 2) for c in range(q * quarter, (q + 1) * quarter)]
    second = [c + quarter for c in first]
    made = []
    for half in (low, high):
        ab, cd = halves(a[0], a[1], half), halves(a[2], a[3], half)
        made += [mixed(ab, cd, [*o, *(n + k for k in o)]) for o in (first, second)]
    return made
