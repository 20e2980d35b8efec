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
from tissue.forces.step_context import Stages
from tissue.integrators.bielser_1998.kernels import new_local_clocks
from tissue.mesh.body import grown

pytestmark = pytest.mark.kernel

VALUES = np.random.default_rng(0).uniform(0.5, 2.0, 24)
POINTS = np.random.default_rng(1).normal(size=(12, 3))
OF = np.array([3, 1, 4, 1, 5, 9, 2, 6, 5, 3], dtype=np.int32)


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
    out, expected = np.zeros((2, 24))
    kernel(spread_out)(POINTS, out)
    spread_out(POINTS, expected)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(out, np.repeat(POINTS[2], 8))


def test_arithmetic_is_done_lane_by_lane():
    out, expected = np.zeros((2, 16))
    kernel(arithmetic)(VALUES, out)
    arithmetic(VALUES, expected)
    np.testing.assert_array_equal(out, expected)
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
    out, expected = np.zeros((2, 2, 3))
    kernel(of_points)(POINTS, OF, out)
    of_points(POINTS, OF, expected)
    np.testing.assert_array_equal(out, expected)
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
