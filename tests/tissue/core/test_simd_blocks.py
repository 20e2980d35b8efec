"""Vectors of a block give the same bits in a kernel and in NumPy, in both precisions."""

import numpy as np
import pytest

from tissue.core.jit import kernel
from tissue.core.simd import aligned, point, store_point
from tissue.core.simd_blocks import (
    gathered_like,
    load_block,
    logarithm,
    splat,
    store_block,
    sum_of_lanes,
    width_of,
)
from tissue.core.simd_columns import (
    columns_of_rows,
    store_columns,
    store_sum_of_rows,
    sums_of_four_rows,
)
from tissue.core.simd_points import (
    points_of_rows,
    row_of_lane,
    store_everywhere,
    store_row,
    store_rows,
    sum_of_eight_rows,
    values_of_rows,
)
from tissue.core.simd_rows import larger, largest, where_larger

REALS = {"double": np.float64, "single": np.float32}
OF = np.random.default_rng(2).integers(0, 40, 32).astype(np.int32)


@pytest.fixture(params=REALS)
def real(request):
    return REALS[request.param]


def filled(n, real, seed=0):
    """Return aligned random numbers of that precision."""
    array = aligned(n, real)
    array[:] = np.random.default_rng(seed).uniform(0.5, 2.0, n)
    return array


def aligned_copy(array):
    """Return a copy that is aligned as kernels ask of rows; an ordinary copy may not be."""
    copied = aligned(array.size, array.dtype.type).reshape(array.shape)
    copied[...] = array
    return copied


def both(function, *arguments, out):
    """Return what a function writes to `out` as a kernel, and as plain Python."""
    compiled, plain = aligned_copy(out), out.copy()
    kernel(function)(*arguments, compiled)
    function(*arguments, plain)
    return compiled, plain


def arithmetic(values, out):
    width = width_of(values)
    a, b = load_block(values, 0), load_block(values, width)
    store_block(out, 0, (a + b) * splat(3.0, a))
    store_block(out, width, where_larger(a, b, a / b, larger(a, splat(1.0, a)) - b))


@pytest.mark.kernel
def test_a_block_holds_eight_doubles_or_sixteen_singles(real):
    values = filled(48, real)
    width = 64 // values.itemsize
    assert width_of(values) == len(load_block(values, 0)) == width
    compiled, plain = both(arithmetic, values, out=np.zeros(2 * width, real))
    np.testing.assert_array_equal(compiled, plain)
    np.testing.assert_array_equal(plain[:width], 3 * (values[:width] + values[width : 2 * width]))


def folds(values, out):
    a = load_block(values, 0)
    out[0], out[1] = largest(a), sum_of_lanes(a)


@pytest.mark.kernel
def test_a_block_is_folded_to_a_double(real):
    values = filled(16, real)
    compiled, plain = both(folds, values, out=np.zeros(2))
    np.testing.assert_array_equal(compiled, plain)
    assert plain[0] == values[: 64 // values.itemsize].max()


def converted(values, doubles, of, out):
    a = load_block(values, 0)
    store_block(out, 0, gathered_like(a, doubles, of, 0) * a)


@pytest.mark.kernel
def test_doubles_are_gathered_in_the_precision_of_the_block(real):
    values, doubles = filled(16, real), filled(40, np.float64, 1)
    width = 64 // values.itemsize
    compiled, plain = both(converted, values, doubles, OF, out=np.zeros(width, real))
    np.testing.assert_array_equal(compiled, plain)
    np.testing.assert_array_equal(plain, doubles.astype(real)[OF[:width]] * values[:width])


def transposed(rows, of, out):
    x, y, z = points_of_rows(rows, of, 0)
    store_rows(out, width_of(rows), x, y, z)


@pytest.mark.kernel
def test_rows_are_gathered_as_points_and_stored_again_as_rows(real):
    rows = filled(4 * 40, real).reshape(40, 4)
    rows[:, 3] = 0.0
    width = 64 // rows.itemsize
    out = aligned(4 * 2 * width, real).reshape(-1, 4)
    compiled, plain = both(transposed, rows, OF, out=out)
    np.testing.assert_array_equal(compiled, plain)
    places = [width + row_of_lane(lane, width) for lane in range(width)]
    assert sorted(places) == list(range(width, 2 * width))
    np.testing.assert_array_equal(plain[places], rows[OF[:width]][:, [0, 1, 2, 2]])


def spread_values(values, of, rows, out):
    for i in range(40):
        store_everywhere(rows, i, float(values[i]))
    store_block(out, 0, values_of_rows(rows, of, 8))


@pytest.mark.kernel
def test_numbers_of_rows_are_gathered(real):
    values, rows = filled(40, real), aligned(4 * 40, real).reshape(-1, 4)
    width = 64 // values.itemsize
    compiled, plain = both(spread_values, values, OF, rows, out=np.zeros(width, real))
    np.testing.assert_array_equal(compiled, plain)
    np.testing.assert_array_equal(plain, values[OF[8 : 8 + width]])


def summed(rows, of, points, out):
    store_row(rows, 2, point(points, 1))
    store_point(out, 0, sum_of_eight_rows(rows, of, 8))


@pytest.mark.kernel
def test_eight_rows_are_summed_to_a_point_of_doubles(real):
    rows, points = filled(4 * 40, real).reshape(40, 4), filled(9, np.float64, 3).reshape(3, 3)
    rows[:, 3] = 0.0
    compiled, plain = both(summed, rows, OF, points, out=np.zeros((1, 3)))
    np.testing.assert_array_equal(compiled, plain)
    np.testing.assert_array_equal(rows[2, :3], points[1].astype(real))
    expected = rows[OF[8:16], :3].astype(np.float64).sum(axis=0)
    np.testing.assert_allclose(plain[0], expected, rtol=8 * np.finfo(real).eps)


def columns_there_and_back(values, of, rows, out):
    store_columns(out, 0, sums_of_four_rows(rows, of, 0))
    width = width_of(values)
    store_columns(out, width, columns_of_rows(rows, 3))
    store_sum_of_rows(out, 2 * width, float(values[0]), rows, of, 8, 13)


@pytest.mark.kernel
def test_rows_of_ten_are_summed_and_turned_into_columns_and_back(real):
    values, rows = filled(16, real), filled(16 * 40, real).reshape(40, 16)
    width = 64 // values.itemsize
    of = np.random.default_rng(3).integers(0, 40, 4 * width).astype(np.int32)
    out = np.zeros((2 * width + 1, 16), real)
    found = both(columns_there_and_back, values, of, rows, out=out)
    compiled, plain = (each[:, :10] for each in found)
    np.testing.assert_array_equal(compiled, plain)
    places = of.reshape(4, width)
    np.testing.assert_allclose(plain[:width], rows[places, :10].sum(axis=0), rtol=1e-6)
    np.testing.assert_array_equal(plain[width:-1], rows[3 : 3 + width, :10])
    expected = values[0] * rows[of[8:24], :10].sum(axis=0)
    np.testing.assert_allclose(plain[-1], expected, rtol=1e-6)


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
