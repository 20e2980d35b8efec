"""Sums over the row of a node, indices, and comparisons of the numbers of vectors.

As in `tissue.core.simd` each function is also a plain Python function, which runs when the JIT is
off.
"""

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types

from tissue.core.array_types import FloatArray, SlotArray
from tissue.core.simd import (
    _I32,
    _I64,
    LANES,
    UNFUSED,
    WIDTH,
    Lanes,
    _Array,
    _compiled,
    _declared,
)


def sum_of_eight(values: FloatArray, of: SlotArray, i: int) -> float:
    """Return the sum of `values` at `of[i]` to `of[i + 7]`."""
    return float(_tree(list(values[of[i : i + WIDTH]])))


@_compiled(sum_of_eight, types.Array, types.Array, types.Integer, result=types.float64)
def _sum_of_eight(builder: Any, values: _Array, of: _Array, i: Any) -> Any:
    places = (builder.load(of.at(builder.add(i, i.type(k)))) for k in range(WIDTH))
    total = _tree([builder.load(values.at(place)) for place in places], builder.fadd)
    return total if total.type == ir.DoubleType() else builder.fpext(total, ir.DoubleType())


def natural(i: int) -> int:
    """Return `i`, which is not negative: then an index by it needs no look at its sign.

    Numba counts negative indices from the end, which takes three instructions an access; loops over
    nodes with a few dozen instructions a node have a dozen accesses.
    """
    return i


@_compiled(natural, types.Integer, result=types.int64)
def _natural(builder: Any, i: Any) -> Any:
    is_natural = builder.icmp_signed(">=", i, i.type(0))
    kind = ir.FunctionType(ir.VoidType(), [ir.IntType(1)])
    builder.call(_declared(builder.module, "llvm.assume", kind), [is_natural])
    return i if i.type == _I64 else builder.sext(i, _I64)


def larger(a: Lanes, b: Lanes) -> Lanes:
    """Return the larger of `a` and `b` in each lane; `b` where they cannot be compared (NaN)."""
    return np.where(a > b, a, b)


@_compiled(larger, LANES, LANES)
@_compiled(larger, UNFUSED, UNFUSED, result=UNFUSED)
def _larger(builder: Any, a: Any, b: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", a, b), a, b)


def where_larger(a: Lanes, b: Lanes, this: Lanes, other: Lanes) -> Lanes:
    """Return `this` in lanes where `a` is larger than `b`, and `other` in the others."""
    return np.where(a > b, this, other)


@_compiled(where_larger, LANES, LANES, LANES, LANES)
@_compiled(where_larger, UNFUSED, UNFUSED, UNFUSED, UNFUSED, result=UNFUSED)
def _where_larger(builder: Any, a: Any, b: Any, this: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", a, b), this, other)


def largest(a: Lanes) -> float:
    """Return the largest of eight numbers."""
    return float(a.max())


@_compiled(largest, LANES, result=types.float64)
def _largest(builder: Any, a: Any) -> Any:
    values = [builder.extract_element(a, _I32(k)) for k in range(WIDTH)]
    return _tree(values, lambda b, c: builder.select(builder.fcmp_ordered(">", b, c), b, c))


def any_above(a: Lanes, b: Lanes) -> bool:
    """Return whether `a` is above `b` in any lane, or cannot be compared with it (NaN)."""
    return bool((~(a <= b)).any())


@_compiled(any_above, LANES, LANES, result=types.boolean)
def _any_above(builder: Any, a: Any, b: Any) -> Any:
    bits = ir.IntType(a.type.count)
    above = builder.bitcast(builder.fcmp_unordered(">", a, b), bits)
    return builder.icmp_unsigned("!=", above, bits(0))


def larger_bits(a: Lanes, b: Lanes) -> int:
    """Return a number whose bit k is 1 where `a` is larger than `b` in lane k."""
    return int(np.packbits(a > b, bitorder="little")[0])


@_compiled(larger_bits, LANES, LANES, result=types.int64)
@_compiled(larger_bits, UNFUSED, UNFUSED, result=types.int64)
def _larger_bits(builder: Any, a: Any, b: Any) -> Any:
    bits = builder.bitcast(builder.fcmp_ordered(">", a, b), ir.IntType(WIDTH))
    return builder.zext(bits, ir.IntType(64))


def first_bit(bits: int) -> int:
    """Return the number of the lowest bit that is 1, from 0; one is."""
    return int(bits & -bits).bit_length() - 1


@_compiled(first_bit, types.Integer, result=types.int64)
def _first_bit(builder: Any, bits: Any) -> Any:
    function = _declared(
        builder.module, "llvm.cttz.i64", ir.FunctionType(_I64, [_I64, ir.IntType(1)])
    )
    return builder.call(function, [bits, ir.IntType(1)(1)])


def _tree(terms: list[Any], add: Any = operator.add) -> Any:
    """Return the sum of eight, or another fold: neighbours first, so that no operation waits."""
    while len(terms) > 1:
        terms = [add(a, b) for a, b in zip(terms[::2], terms[1::2], strict=True)]
    return terms[0]
