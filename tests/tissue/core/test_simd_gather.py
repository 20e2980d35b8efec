"""Each gather operation gives the same bits in a kernel and in NumPy."""

import numpy as np
import pytest

from tissue.core.jit import kernel
from tissue.core.simd import load_lanes, store_lanes, store_point
from tissue.core.simd_gather import gathered, larger, largest, sum_of_eight, sum_of_eight_points

pytestmark = pytest.mark.kernel

VALUES = np.random.default_rng(0).uniform(0.5, 2.0, 48)
OF = np.array([3, 1, 24, 1, 5, 9, 22, 6, 5, 3], dtype=np.int32)


def gather(values, of, out, points):
    store_lanes(out, 0, gathered(values, of, 1))
    out[8] = sum_of_eight(values, of, 2)
    store_point(points, 0, sum_of_eight_points(values, of, 1))


def test_values_and_points_are_gathered_and_summed_up():
    (out, expected), (points, expected_points) = np.zeros((2, 9)), np.zeros((2, 1, 3))
    kernel(gather)(VALUES, OF, out, points)
    gather(VALUES, OF, expected, expected_points)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(points, expected_points)
    np.testing.assert_array_equal(out[:8], VALUES[OF[1:9]])
    assert out[8] == pytest.approx(VALUES[OF[2:10]].sum(), rel=1e-15)
    rows = [VALUES[OF[1:9] + c * 8].sum() for c in range(3)]
    np.testing.assert_allclose(points[0], rows, rtol=1e-14)


def compare(values, out):
    store_lanes(out, 0, larger(load_lanes(values, 0), load_lanes(values, 8)))
    out[8] = largest(load_lanes(values, 16))


def test_the_larger_of_two_and_the_largest_of_eight():
    out, expected = np.zeros((2, 9))
    kernel(compare)(VALUES, out)
    compare(VALUES, expected)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(out[:8], np.maximum(VALUES[:8], VALUES[8:16]))
    assert out[8] == VALUES[16:24].max()
