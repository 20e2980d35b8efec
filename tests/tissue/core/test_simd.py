"""Each SIMD operation gives the same bits in a kernel and in NumPy."""

import numpy as np
import pytest

from tests.support.materials import SPRINGS
from tissue import SolverSettings, Tissue, block
from tissue.core.jit import kernel
from tissue.core.simd import (
    eight_points,
    lanes,
    load_lanes,
    point,
    point_of,
    room_for_points,
    spread,
    square_root,
    store_lanes,
    store_point,
    summed,
    times,
    unfused,
)
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
from tissue.forces.step_context import Stages
from tissue.integrators.bielser_1998.kernels import new_local_clocks
from tissue.mesh.body import grown

pytestmark = pytest.mark.kernel

VALUES = np.random.default_rng(0).uniform(0.5, 2.0, 24)
POINTS = np.random.default_rng(1).normal(size=(12, 3))
OF = np.array([3, 1, 4, 1, 5, 9, 2, 6, 5, 3], dtype=np.int32)


def same_in_both(function, *arguments, out):
    """Return what a function writes to `out` as plain Python, and as a kernel to the same bits."""
    compiled, plain = out.copy(), out.copy()
    kernel(function)(*arguments, compiled)
    function(*arguments, plain)
    np.testing.assert_array_equal(compiled, plain)
    return plain


def arithmetic(values, out):
    a, b = load_lanes(values, 0), load_lanes(values, 8)
    store_lanes(out, 0, (a + b) * lanes(3.0))
    store_lanes(out, 8, (a - b) / square_root(b))


def of_points(points, of, out):
    x, y, z = eight_points(points, of, 1)
    store_point(out, 0, summed(x, y, z))
    store_point(out, 1, times(2.0, point(points, 3)) + point_of(1.0, 2.0, 3.0))


def spread_out(points, out):
    x, y, z = spread(point(points, 2))
    store_lanes(out, 0, x)
    store_lanes(out, 8, y)
    store_lanes(out, 16, z)


def test_a_spread_point_has_its_coordinates_in_all_lanes():
    out = same_in_both(spread_out, POINTS, out=np.zeros(24))
    np.testing.assert_array_equal(out, np.repeat(POINTS[2], 8))


def test_arithmetic_is_done_lane_by_lane():
    out = same_in_both(arithmetic, VALUES, out=np.zeros(16))
    np.testing.assert_allclose(out[:8], 3.0 * (VALUES[:8] + VALUES[8:16]), rtol=1e-15)


def unfused_arithmetic(values, out):
    a, b = unfused(load_lanes(values, 0)), unfused(load_lanes(values, 8))
    store_lanes(out, 0, a * b - square_root(a) * b)
    store_lanes(out, 8, a * a - b * b)


def test_unfused_arithmetic_has_the_bits_of_scalars():
    out = np.zeros(16)
    kernel(unfused_arithmetic)(VALUES, out)
    for k, (a, b) in enumerate(zip(VALUES[:8], VALUES[8:16], strict=True)):
        assert out[k] == a * b - np.sqrt(a) * b
        assert out[8 + k] == a * a - b * b


def test_eight_points_are_gathered_and_summed_up():
    out = same_in_both(of_points, POINTS, OF, out=np.zeros((2, 3)))
    np.testing.assert_allclose(out[0], POINTS[OF[1:9]].sum(axis=0), rtol=1e-14)


def test_all_arrays_whose_rows_are_gathered_have_padding_after_the_last():
    tissue = Tissue(
        block((1, 1, 1), (0.01, 0.01, 0.01)),
        SPRINGS,
        solver=SolverSettings(relaxation="hierarchical"),
    )
    body, stages = tissue._body, tissue._model.stages
    arrays = [body.rest, body.positions, body.velocities, new_local_clocks(5).origins]
    arrays += [getattr(stages, name) for name in Stages.__annotations__]
    arrays += [room_for_points(7), grown(room_for_points(7), 9)]
    for array in arrays:
        end, room = array.ctypes.data + array.nbytes, array.base.ctypes.data + array.base.nbytes
        assert room - end >= 8


def test_a_single_point_is_copied_without_what_follows_it():
    points = np.full((3, 4), np.nan)
    points[:, :3] = 1.0
    rows = np.full((2, 3), 7.0)
    kernel(_copy_last)(np.ascontiguousarray(points[:, :3]), rows)
    np.testing.assert_array_equal(rows, [[1.0] * 3, [7.0] * 3])


def _copy_last(points, rows):
    store_point(rows, 0, point(points, 2))


RANDOM = np.random.default_rng(0)
TWENTY = room_for_points(20)
TWENTY[:] = RANDOM.uniform(size=(20, 3))
COLUMNS = RANDOM.integers(20, size=(11, 4))
FOUR = RANDOM.uniform(size=(12, 4))


def gather(points, of, out):
    x, y, z = points_of_column(points, of, 3, 2)
    store_lanes(out, 0, x)
    store_lanes(out, 8, y)
    store_lanes(out, 16, z)


def test_points_are_gathered_by_a_column():
    expected = same_in_both(gather, TWENTY, COLUMNS, out=np.zeros(24))
    np.testing.assert_array_equal(expected.reshape(3, 8).T, TWENTY[COLUMNS[3:11, 2]])


def copy(three, four, to_three, to_four):
    x, y, z = rows_of_three(three, 2)
    a, b, c, d = rows_of_four(four, 3)
    store_rows_of_three(to_three, 1, x, y, z)
    store_rows_of_four(to_four, 4, a, b, c, d)


def test_rows_are_read_and_written_by_columns():
    for run in (copy, kernel(copy)):
        to_three, to_four = np.zeros((12, 3)), np.zeros((13, 4))
        run(TWENTY, FOUR, to_three, to_four)
        np.testing.assert_array_equal(to_three[1:9], TWENTY[2:10])
        np.testing.assert_array_equal(to_four[4:12], FOUR[3:11])
        assert not to_three[[0, *range(9, 12)]].any() and not to_four[[0, 1, 2, 3, 12]].any()


def add_multiples(rows, vectors):
    for i in range(len(vectors)):
        add_to_row(rows, i % 3, 0.1 * i, vectors[i, 0], vectors[i, 1], vectors[i, 2])


def test_a_multiple_of_a_vector_is_added_to_a_row_as_scalars_are():
    rows, expected = TWENTY[:4].copy(), TWENTY[:4].copy()
    kernel(add_multiples)(rows, TWENTY)
    for i in range(len(TWENTY)):
        for x in range(3):
            expected[i % 3, x] += 0.1 * i * TWENTY[i, x]
    np.testing.assert_array_equal(rows, expected)


MANY = np.random.default_rng(0).uniform(0.5, 2.0, 48)
PLACES = np.array([3, 1, 24, 1, 5, 9, 22, 6, 5, 3], dtype=np.int32)


def gather_values(values, of, out):
    out[0] = sum_of_eight(values, of, 2)


def test_values_are_gathered_and_summed_up():
    expected = same_in_both(gather_values, MANY, PLACES, out=np.zeros(1))
    assert expected[0] == pytest.approx(MANY[PLACES[2:10]].sum(), rel=1e-15)


def compare_bits(values, out):
    out[0] = larger_bits(load_lanes(values, 0), load_lanes(values, 8))


def test_bits_say_in_which_lanes_a_number_is_larger():
    expected = same_in_both(compare_bits, MANY, out=np.zeros(1, np.int64))
    assert expected[0] == sum(1 << k for k in range(8) if MANY[k] > MANY[8 + k])


def number_bits(numbers, out):
    for i in range(len(numbers)):
        out[i] = first_bit(numbers[i])


def test_the_first_bit_is_the_lowest_that_is_one():
    numbers = np.array([1, 2, 3, 8, 12, 96, 128, 1 << 40])
    expected = same_in_both(number_bits, numbers, out=np.zeros(len(numbers), np.int64))
    assert expected.tolist() == [0, 1, 0, 3, 2, 5, 7, 40]


def picked(values, of, out):
    for i in range(len(of)):
        out[natural(i)] = values[natural(of[i])]


def test_an_index_that_is_not_negative_is_itself():
    expected = same_in_both(picked, MANY, PLACES, out=np.zeros(len(PLACES)))
    np.testing.assert_array_equal(expected, MANY[PLACES])
