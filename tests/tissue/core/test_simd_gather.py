"""Each gather operation gives the same bits in a kernel and in NumPy."""

import numpy as np
import pytest

from tissue.core.jit import kernel
from tissue.core.simd import load_lanes
from tissue.core.simd_rows import (
    first_bit,
    larger_bits,
    natural,
    sum_of_eight,
)

pytestmark = pytest.mark.kernel

VALUES = np.random.default_rng(0).uniform(0.5, 2.0, 48)
OF = np.array([3, 1, 24, 1, 5, 9, 22, 6, 5, 3], dtype=np.int32)


def gather(values, of, out):
    out[0] = sum_of_eight(values, of, 2)


def test_values_are_gathered_and_summed_up():
    out, expected = np.zeros((2, 1))
    kernel(gather)(VALUES, OF, out)
    gather(VALUES, OF, expected)
    np.testing.assert_array_equal(out, expected)
    assert out[0] == pytest.approx(VALUES[OF[2:10]].sum(), rel=1e-15)


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
    out, expected = np.zeros((2, len(OF)))
    kernel(picked)(VALUES, OF, out)
    picked(VALUES, OF, expected)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(out, VALUES[OF])
