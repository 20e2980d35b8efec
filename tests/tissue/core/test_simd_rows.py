"""Each operation on rows gives the same bits in a kernel and in NumPy."""

import numpy as np
import pytest

from tissue.core.jit import kernel
from tissue.core.simd import room_for_points, store_lanes
from tissue.core.simd_rows import (
    add_to_row,
    points_of_column,
    rows_of_four,
    rows_of_three,
    store_rows_of_four,
    store_rows_of_three,
)

pytestmark = pytest.mark.kernel

RANDOM = np.random.default_rng(0)
POINTS = room_for_points(20)
POINTS[:] = RANDOM.uniform(size=(20, 3))
OF = RANDOM.integers(20, size=(11, 4))
FOUR = RANDOM.uniform(size=(12, 4))


def gather(points, of, out):
    x, y, z = points_of_column(points, of, 3, 2)
    store_lanes(out, 0, x)
    store_lanes(out, 8, y)
    store_lanes(out, 16, z)


def test_points_are_gathered_by_a_column():
    out, expected = np.zeros((2, 24))
    kernel(gather)(POINTS, OF, out)
    gather(POINTS, OF, expected)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(expected.reshape(3, 8).T, POINTS[OF[3:11, 2]])


def copy(three, four, to_three, to_four):
    x, y, z = rows_of_three(three, 2)
    a, b, c, d = rows_of_four(four, 3)
    store_rows_of_three(to_three, 1, x, y, z)
    store_rows_of_four(to_four, 4, a, b, c, d)


def test_rows_are_read_and_written_by_columns():
    for run in (copy, kernel(copy)):
        to_three, to_four = np.zeros((12, 3)), np.zeros((13, 4))
        run(POINTS, FOUR, to_three, to_four)
        np.testing.assert_array_equal(to_three[1:9], POINTS[2:10])
        np.testing.assert_array_equal(to_four[4:12], FOUR[3:11])
        assert not to_three[[0, *range(9, 12)]].any() and not to_four[[0, 1, 2, 3, 12]].any()


def add_multiples(rows, vectors):
    for i in range(len(vectors)):
        add_to_row(rows, i % 3, 0.1 * i, vectors[i, 0], vectors[i, 1], vectors[i, 2])


def test_a_multiple_of_a_vector_is_added_to_a_row_as_scalars_are():
    rows, expected = POINTS[:4].copy(), POINTS[:4].copy()
    kernel(add_multiples)(rows, POINTS)
    for i in range(len(POINTS)):
        for x in range(3):
            expected[i % 3, x] += 0.1 * i * POINTS[i, x]
    np.testing.assert_array_equal(rows, expected)
