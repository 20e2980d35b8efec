"""Each operation on rows gives the same bits in a kernel and in NumPy."""

import numpy as np
import pytest

from tissue.core.jit import kernel
from tissue.core.simd import load_lanes, room_for_points, store_lanes
from tissue.core.simd_rows import (
    add_to_row,
    first_bit,
    larger_bits,
    natural,
    points_of_column,
    rows_of_four,
    rows_of_three,
    store_rows_of_four,
    store_rows_of_three,
    sum_of_eight,
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


VALUES = np.random.default_rng(0).uniform(0.5, 2.0, 48)
PLACES = np.array([3, 1, 24, 1, 5, 9, 22, 6, 5, 3], dtype=np.int32)


def gather_values(values, of, out):
    out[0] = sum_of_eight(values, of, 2)


def test_values_are_gathered_and_summed_up():
    out, expected = np.zeros((2, 1))
    kernel(gather_values)(VALUES, PLACES, out)
    gather_values(VALUES, PLACES, expected)
    np.testing.assert_array_equal(out, expected)
    assert out[0] == pytest.approx(VALUES[PLACES[2:10]].sum(), rel=1e-15)


def compare_bits(values, out):
    out[0] = larger_bits(load_lanes(values, 0), load_lanes(values, 8))


def test_bits_say_in_which_lanes_a_number_is_larger():
    out, expected = np.zeros((2, 1), np.int64)
    kernel(compare_bits)(VALUES, out)
    compare_bits(VALUES, expected)
    assert out[0] == expected[0]
    assert expected[0] == sum(1 << k for k in range(8) if VALUES[k] > VALUES[8 + k])


def number_bits(numbers, out):
    for i in range(len(numbers)):
        out[i] = first_bit(numbers[i])


def test_the_first_bit_is_the_lowest_that_is_one():
    numbers = np.array([1, 2, 3, 8, 12, 96, 128, 1 << 40])
    out, expected = np.zeros((2, len(numbers)), np.int64)
    kernel(number_bits)(numbers, out)
    number_bits(numbers, expected)
    assert out.tolist() == expected.tolist() == [0, 1, 0, 3, 2, 5, 7, 40]


def picked(values, of, out):
    for i in range(len(of)):
        out[natural(i)] = values[natural(of[i])]


def test_an_index_that_is_not_negative_is_itself():
    out, expected = np.zeros((2, len(PLACES)))
    kernel(picked)(VALUES, PLACES, out)
    picked(VALUES, PLACES, expected)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(out, VALUES[PLACES])
