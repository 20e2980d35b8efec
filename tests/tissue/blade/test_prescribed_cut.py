"""The prescribed path of an edge: samples advance or wait, and find their tetrahedra."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue import block
from tissue.blade.prescribed_cut import begin_path, prescribe_path
from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import resampled
from tissue.mesh.tetrahedron_grid import build_grid

pytestmark = pytest.mark.kernel

AHEAD = Vec3(0.0, 1.0, 0.0)


def at(y: float) -> np.ndarray:
    """Return an upright edge with its tip and middle in the unit cube, and its heel above."""
    return np.array([[0.5, y, 0.2], [0.5, y, 0.5], [0.5, y, 1.5]])


@pytest.fixture
def started():
    """Return a unit cube with an edge at the start of its path, and the grid of the cube."""
    cut = cut_of(block((2, 2, 2), (1.0, 1.0, 1.0)), n_samples=3)
    begin_path(cut.path, at(0.2))
    return cut, build_grid(cut.body, cut.body.rest, 0.0)


def test_samples_move_to_the_given_points(started):
    cut, cells = started
    there = at(0.3)
    prescribe_path(cut.path, cut.body, cells, there, AHEAD, 0.5)
    np.testing.assert_array_equal(cut.path.t0, at(0.2))
    np.testing.assert_array_equal(cut.path.t1, there)
    np.testing.assert_array_equal(cut.path.linked, [True, True, False])


def test_a_sample_that_moves_back_waits_until_it_is_ahead_of_its_earlier_path(started):
    cut, cells = started
    for y in (0.3, 0.1, 0.25, 0.4):
        prescribe_path(cut.path, cut.body, cells, at(y), AHEAD, 0.5)
        assert cut.path.t1[0, 1] == pytest.approx(max(y, 0.3))


def test_an_edge_is_divided_into_pieces_no_longer_than_the_spacing():
    rows = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0], [1.0, 0.0, 2.0]]])
    finer = resampled(rows, 0.25, 100)
    assert finer.shape == (2, 9, 3)
    np.testing.assert_allclose(finer[1, :, 2], np.linspace(0.0, 2.0, 9))


def test_an_edge_is_divided_into_no_more_samples_than_allowed():
    rows = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]] * 2)
    assert resampled(rows, 1e-6, 50).shape[1] == 50


def test_the_corners_of_a_bent_edge_stay_where_they_are():
    rows = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.5, 1.0]]])
    finer = resampled(rows, 0.5, 100)[0]
    assert finer.tolist() == [[0, 0, 0], [0, 0, 0.5], [0, 0, 1], [0, 0.5, 1]]


def test_a_jittered_body_gives_every_sample_inside_a_seed():
    mesh = bodies.jittered(3, 0, size=1.0)
    cut = cut_of(mesh, n_samples=20)
    points = np.random.default_rng(0).uniform(0.01, 0.99, (20, 3))
    begin_path(cut.path, points - [0.0, 1e-3, 0.0])
    prescribe_path(cut.path, cut.body, build_grid(cut.body, cut.body.rest, 0.0), points, AHEAD, 0.5)
    assert (cut.path.seed >= 0).all()
