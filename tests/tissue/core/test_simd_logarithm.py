"""The logarithm of a vector in compiled code; without the compiler it is that of NumPy."""

import numpy as np
import pytest

from tissue.core.jit import kernel
from tissue.core.simd import aligned
from tissue.core.simd_blocks import load_block, logarithm, store_block


@kernel
def logarithms(values, out):
    width = 64 // values.itemsize
    for i in range(0, len(values), width):
        store_block(out, i, logarithm(load_block(values, i)))


def found(values):
    """Return the logarithms of as many numbers as fill vectors."""
    given, out = aligned(len(values), values.dtype.type), aligned(len(values), values.dtype.type)
    given[:] = values
    logarithms(given, out)
    return out


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_a_logarithm_is_right_to_two_units_in_the_last_place(real):
    limits, random = np.finfo(real), np.random.default_rng(0)
    wide = np.exp(random.uniform(np.log(limits.tiny), np.log(limits.max), 4096))
    near_one = 1.0 + random.uniform(-0.6, 0.6, 4096) ** 9
    values = np.concatenate([wide, near_one]).astype(real)
    expected = np.log(values.astype(np.longdouble))
    allowed = 2.0 * np.maximum(np.spacing(np.abs(expected).astype(real)), limits.tiny)
    assert (np.abs(found(values) - expected) <= allowed).all()


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_what_is_not_finite_has_no_logarithm(real):
    values = np.resize(np.array([np.nan, np.inf], real), 16)
    assert np.isnan(found(values)).all()
