"""Each operation on blocks gives in a kernel what its twin in NumPy gives, to the last bit."""

import numpy as np
import pytest

from tissue.jit import kernel
from tissue.simd import load, store, store_point
from tissue.simd_blocks import gathered, store_pairs, sum_of_quarters, sum_of_rows

pytestmark = pytest.mark.kernel

VALUES = np.random.default_rng(0).uniform(0.5, 2.0, 48)
ROWS = np.random.default_rng(1).normal(size=(12, 4))
OF = np.array([3, 1, 4, 1, 5, 9, 2, 6, 5, 3], dtype=np.int32)


def gather(values, rows, of, out, points):
    store(out, 0, gathered(values, of, 1))
    out[8] = sum_of_quarters(values, of, 2)
    store_point(points, 0, sum_of_rows(rows, of, 1))


def scatter(values, rows):
    x, y, z = load(values, 0), load(values, 8), load(values, 16)
    store_pairs(rows, 2, x, y, z, load(values, 24), load(values, 32), load(values, 40))


def test_values_and_rows_are_gathered_and_summed_up():
    (out, expected), (points, expected_points) = np.zeros((2, 9)), np.zeros((2, 1, 3))
    kernel(gather)(VALUES, ROWS, OF, out, points)
    gather(VALUES, ROWS, OF, expected, expected_points)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(points, expected_points)
    np.testing.assert_array_equal(out[:8], VALUES[OF[1:9]])
    assert out[8] == pytest.approx(VALUES[OF[2:10] // 4].sum(), rel=1e-15)
    np.testing.assert_allclose(points[0], ROWS[OF[1:9], :3].sum(axis=0), rtol=1e-14)


def test_pairs_of_points_are_stored_in_every_fourth_row_and_nothing_beside_them():
    out, expected = np.full((2, 36, 4), np.nan)
    kernel(scatter)(VALUES, out)
    scatter(VALUES, expected)
    np.testing.assert_array_equal(out, expected)
    points = VALUES.reshape(2, 3, 8)
    for lane in range(8):
        np.testing.assert_array_equal(out[2 + 4 * lane], [*points[0, :, lane], 0.0])
        np.testing.assert_array_equal(out[3 + 4 * lane], [*points[1, :, lane], 0.0])
    assert np.isnan(out).sum() == 4 * (36 - 16)
