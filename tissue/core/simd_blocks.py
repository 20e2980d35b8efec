"""Vectors of one block of tetrahedra inside kernels: eight doubles, or sixteen singles.

The loops over tetrahedra read the same for both: how many numbers a vector holds follows from the
array that it is loaded from.

As in `tissue.core.simd` each function is also a plain Python function, which runs when the JIT is
off.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.simd import (
    I32,
    I64,
    LANES,
    LANES_OF_SINGLES,
    Lanes,
    LanesType,
    Operand,
    in_all_lanes,
    intrinsic,
)
from tissue.core.simd_rows import fold_in_pairs

BOTH = (LANES, LANES_OF_SINGLES)


def kind_of(array: types.Array, *_: types.Type) -> LanesType:
    """Return the type of the vectors of an array in kernels."""
    return LANES_OF_SINGLES if array.dtype == types.float32 else LANES


def vector_of(array: Operand) -> Any:
    """Return LLVM's type of the vectors of an array."""
    return ir.VectorType(array.element, 16 if isinstance(array.element, ir.FloatType) else 8)


def width_of(array: FloatArray) -> int:
    """Return how many numbers of an array are in a vector: 8 doubles or 16 singles."""
    return 16 if array.dtype == np.float32 else 8


@intrinsic(width_of, types.Array, result=types.int64)
def _width_of(_: Any, array: Operand) -> Any:
    return ir.Constant(I64, vector_of(array).count)


def splat(value: float, a: Lanes) -> Lanes:
    """Return a number in all lanes of a vector of the type of `a`."""
    return np.full_like(a, value)


def load_block(array: FloatArray, i: int) -> Lanes:
    """Return the elements of a vector from `i` on."""
    return array[i : i + width_of(array)].copy()


@intrinsic(load_block, types.Array, types.Integer, result=kind_of)
def _load_block(builder: Any, array: Operand, i: Any) -> Any:
    pointer = builder.bitcast(array.at(i), vector_of(array).as_pointer())
    return builder.load(pointer, align=size_of(array.element))


def store_block(array: FloatArray, i: int, values: Lanes) -> None:
    """Write the elements of a vector from `i` on."""
    array[i : i + len(values)] = values


def sum_of_lanes(a: Lanes) -> float:
    """Return the sum of the numbers of a vector, neighbours first."""
    return float(fold_in_pairs(list(a)))


for _kind in BOTH:

    @intrinsic(splat, types.Float, _kind, result=_kind)
    def _splat(builder: Any, value: Any, a: Any) -> Any:
        return in_all_lanes(builder, converted(builder, value, a.type.element), a.type)

    @intrinsic(store_block, types.Array, types.Integer, _kind, result=types.void)
    def _store_block(builder: Any, array: Operand, i: Any, values: Any) -> None:
        pointer = builder.bitcast(array.at(i), values.type.as_pointer())
        builder.store(values, pointer, align=size_of(array.element))

    @intrinsic(sum_of_lanes, _kind, result=types.float64)
    def _sum_of_lanes(builder: Any, a: Any) -> Any:
        terms = [builder.extract_element(a, I32(k)) for k in range(a.type.count)]
        return converted(builder, fold_in_pairs(terms, builder.fadd), ir.DoubleType())


def gathered_like(a: Lanes, values: FloatArray, of: SlotArray | IntArray, i: int) -> Lanes:
    """Return `values` at `of[i]` and the places behind it, as a vector of the type of `a`."""
    return values[of[i : i + len(a)]].astype(a.dtype)


for _kind in BOTH:

    @intrinsic(gathered_like, _kind, types.Array, types.Array, types.Integer, result=_kind)
    def _gathered_like(builder: Any, a: Any, values: Operand, of: Operand, i: Any) -> Any:
        made = ir.Constant(a.type, ir.Undefined)
        for lane in range(a.type.count):
            place = builder.load(of.at(builder.add(i, i.type(lane))))
            value = converted(builder, builder.load(values.at(place)), a.type.element)
            made = builder.insert_element(made, value, I32(lane))
        return made


def converted(builder: Any, value: Any, element: Any) -> Any:
    """Return a number in the precision of that element."""
    if value.type == element:
        return value
    if isinstance(element, ir.FloatType):
        return builder.fptrunc(value, element)
    return builder.fpext(value, element)


def size_of(element: Any) -> int:
    """Return the bytes that a number of that type takes."""
    return 4 if isinstance(element, ir.FloatType) else 8


_N_TERMS_DOUBLE, _N_TERMS_SINGLE = 11, 5
"""Terms of the series, as many as change the last bit."""

_SQRT_HALF_DOUBLE, _SQRT_HALF_SINGLE = 0x3FE6A09E667F3BCD, 0x3F3504F3
"""The bits of sqrt(1/2)."""

_MANTISSA_DOUBLE, _MANTISSA_SINGLE = 52, 23
"""Bits of a mantissa."""


def logarithm(a: Lanes) -> Lanes:
    """Return the natural logarithms of positive numbers that are not subnormal.

    In a kernel that of a number that is not finite is nan.
    """
    return np.log(a)


def _series(builder: Any, a: Any, bits: Any, sqrt_half: int, mantissa: int, n_terms: int) -> Any:
    """Return log a.

    Args:
        builder: Builds the code.
        a: A vector.
        bits: Type of the bits of one of its numbers.
        sqrt_half: The bits of sqrt(1/2).
        mantissa: Bits of a mantissa.
        n_terms: Terms of the series.
    """
    n = a.type.count
    words = ir.VectorType(bits, n)

    def all_of(value: float) -> Any:
        return ir.Constant(a.type, [value] * n)

    def whole(value: int) -> Any:
        return ir.Constant(words, [value] * n)

    def fused(x: Any, y: Any, z: Any) -> Any:
        product = builder.fmul(x, y, flags=("contract",))
        return builder.fadd(product, z, flags=("contract",))

    raw = builder.bitcast(a, words)
    exponent = builder.ashr(builder.sub(raw, whole(sqrt_half)), whole(mantissa))
    m = builder.bitcast(builder.sub(raw, builder.shl(exponent, whole(mantissa))), a.type)
    s = builder.fdiv(builder.fsub(m, all_of(1.0)), builder.fadd(m, all_of(1.0)))
    z = builder.fmul(s, s)
    total = all_of(2.0 / (2 * n_terms + 1))
    for k in range(n_terms - 1, 0, -1):
        total = fused(total, z, all_of(2.0 / (2 * k + 1)))
    twice = builder.fadd(s, s)
    of_m = fused(builder.fmul(total, z), s, twice)
    e = builder.sitofp(exponent, a.type)
    found = fused(e, all_of(float(np.log(2.0))), of_m)
    # a - a is 0 for finite numbers, and nan for others.
    return builder.fadd(found, builder.fsub(a, a))


@intrinsic(logarithm, LANES)
def _of_doubles(builder: Any, a: Any) -> Any:
    kind = ir.IntType(64)
    return _series(builder, a, kind, _SQRT_HALF_DOUBLE, _MANTISSA_DOUBLE, _N_TERMS_DOUBLE)


@intrinsic(logarithm, LANES_OF_SINGLES, result=LANES_OF_SINGLES)
def _of_singles(builder: Any, a: Any) -> Any:
    kind = ir.IntType(32)
    return _series(builder, a, kind, _SQRT_HALF_SINGLE, _MANTISSA_SINGLE, _N_TERMS_SINGLE)
