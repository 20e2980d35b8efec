"""The natural logarithm of a vector of doubles or singles, in the registers of the vector.

LLVM calls the C library once for each number of a vector: in an account of energy that took most of
the time of the tetrahedra. With a = m 2^e, m from sqrt(1/2) to sqrt(2), and s = (m - 1) / (m + 1),

    log a = e log 2 + 2 (s + s^3/3 + s^5/5 + ...)

where s is at most 0.172, so that a term is 0.029 times the one before.
"""

from typing import Any

import numpy as np
from llvmlite import ir

from tissue.core.simd import LANES, LANES_OF_SINGLES, Lanes, _compiled

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


@_compiled(logarithm, LANES)
def _of_doubles(builder: Any, a: Any) -> Any:
    kind = ir.IntType(64)
    return _series(builder, a, kind, _SQRT_HALF_DOUBLE, _MANTISSA_DOUBLE, _N_TERMS_DOUBLE)


@_compiled(logarithm, LANES_OF_SINGLES, result=LANES_OF_SINGLES)
def _of_singles(builder: Any, a: Any) -> Any:
    kind = ir.IntType(32)
    return _series(builder, a, kind, _SQRT_HALF_SINGLE, _MANTISSA_SINGLE, _N_TERMS_SINGLE)
