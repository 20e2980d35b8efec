"""The ends of a cut make good what their crack fronts opened beyond the paths of the edge."""

import itertools

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import average_directions
from tissue.cutting.end_depth import (
    LARGEST_SHIFT,
    MADE_GOOD_OVER,
    SHIFTED_SAMPLES,
    count_front,
    shift_ends,
    take_back_shifts,
)

pytestmark = pytest.mark.kernel

N, SIZE, NODE_SIZE = 25, 1.0, 0.2
LOW, TOP = 0.4, 1.36
X = 0.5


@pytest.fixture
def drawn():
    """Return a cube in which an upright edge with its tip at LOW was drawn along y, by 0.5."""
    cut = cut_of(bodies.jittered(3, 2, size=SIZE), n_samples=N)
    path = cut.path
    path.forward[:] = [0.0, 1.0, 0.0]
    path.sideways[:] = [1.0, 0.0, 0.0]
    path.member[:] = path.known[:] = True
    path.linked[:-1] = True
    path.seed[:] = 0
    for y in np.arange(0.1, 0.6, 0.1):
        draw_on(path, y)
    return cut


def draw_on(path, y: float) -> None:
    path.t0[:] = np.stack([np.full(N, X), np.full(N, y - 0.1), np.linspace(LOW, TOP, N)], axis=1)
    path.t1[:] = path.t0 + np.array([0.0, 0.1, 0.0])
    average_directions(path, NODE_SIZE)


def front(cut, *points: tuple[float, float]) -> None:
    """Count the front of the tip through these points (y, z)."""
    for (y0, z0), (y1, z1) in itertools.pairwise(points):
        count_front(cut.path, 0, Vec3(X, y0, z0), Vec3(X, y1, z1))


@pytest.mark.parametrize(
    ("points", "excess"),
    [
        (((0.1, LOW), (0.5, LOW)), 0.0),
        (((0.1, 0.3), (0.5, 0.3)), 0.04),  # deeper than the edge
        (((0.1, 0.5), (0.5, 0.5)), -0.04),
        (((0.1, 0.3), (0.3, 0.5), (0.5, 0.3)), 0.0),  # as deep in the mean
        (((0.1, 0.3), (0.5, 0.3), (0.1, 0.3)), 0.0),  # there and back
    ],
)
def test_area_beyond_the_path_of_an_end_is_counted(drawn, points, excess):
    front(drawn, *points)
    assert drawn.path.excess[0] == pytest.approx(excess, abs=1e-12)


def test_an_end_is_shifted_to_the_other_side_of_its_path(drawn):
    path = drawn.path
    path.excess[0] = 1e-3
    traced = path.t1.copy()
    shift_ends(path, drawn.body, NODE_SIZE)
    moved = path.t1 - traced
    shift = 1e-3 / (MADE_GOOD_OVER * NODE_SIZE)
    assert moved[0] == pytest.approx([0.0, 0.0, shift])
    assert (np.diff(moved[: SHIFTED_SAMPLES + 1, 2]) < 0.0).all()
    assert not moved[SHIFTED_SAMPLES:].any()


def test_a_shift_is_limited(drawn):
    path = drawn.path
    for y in np.arange(0.5, 0.9, 0.1):
        path.excess[0] = 1.0
        take_back_shifts(path)
        draw_on(path, y)
        shift_ends(path, drawn.body, NODE_SIZE)
    assert path.shift[0, 2] == pytest.approx(LARGEST_SHIFT * NODE_SIZE)


def test_a_shift_is_taken_back_before_the_path_goes_on(drawn):
    path = drawn.path
    path.excess[0] = 1e-3
    traced = path.t1.copy()
    shift_ends(path, drawn.body, NODE_SIZE)
    take_back_shifts(path)
    assert path.t1 == pytest.approx(traced, abs=1e-15)
    assert path.shift_t0[0] == pytest.approx(path.shift[0])


def test_an_end_outside_the_tissue_is_not_shifted(drawn):
    path = drawn.path
    path.excess[1] = 1e-3
    shift_ends(path, drawn.body, NODE_SIZE)
    assert not path.shift[-1].any()
