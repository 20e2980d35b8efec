"""The z-buffer: every pixel shows the nearest triangle, whatever the order."""

import itertools

import numpy as np
import pytest

from scalpel_sim.figures.rasterise import draw_segments, rasterise

pytestmark = pytest.mark.kernel

NEAR, FAR = 2.0, 1.0
SQUARE = np.array([[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]])


def at(nearness, *places):
    """Return a triangle whose corners have the same nearness."""
    return [[x, y, nearness] for x, y in places]


def halves(nearness):
    """Return the two triangles of a square of 8 x 8 pixels."""
    a, b, c, d = SQUARE
    return [at(nearness, a, b, c), at(nearness, a, c, d)]


def test_two_halves_of_a_square_leave_no_gap():
    raster = rasterise(np.array(halves(FAR)), 10, 10)
    assert (raster.triangle[1:9, 1:9] >= 0).all()
    assert (raster.triangle >= 0).sum() == 64


def test_the_nearer_triangle_is_seen_in_any_order_and_orientation():
    behind, in_front = halves(FAR)[0], at(NEAR, (2.0, 1.0), (8.0, 1.0), (8.0, 6.0))
    for permuted in itertools.permutations(in_front):
        for triangles, number in (([behind, permuted], 1), ([permuted, behind], 0)):
            raster = rasterise(np.array(triangles), 10, 10)
            assert raster.triangle[2, 6] == number
            assert raster.triangle[4, 8] == 1 - number


def test_triangles_that_pierce_each_other_are_each_seen_where_they_are_nearer():
    flat = at(1.5, (0.0, 0.0), (20.0, 0.0), (0.0, 20.0))
    rising = [[0.0, 0.0, 1.0], [20.0, 0.0, 2.0], [0.0, 20.0, 1.0]]
    row = rasterise(np.array([flat, rising]), 10, 1).triangle[0]
    assert row.tolist() == [0] * 10  # 1.5 is reached at x = 10
    wider = rasterise(np.array([flat, rising]), 18, 1).triangle[0]
    assert wider.tolist() == [0] * 10 + [1] * 8


def test_the_weights_are_those_of_the_corners():
    raster = rasterise(np.array([at(FAR, (0.0, 0.0), (10.0, 0.0), (0.0, 10.0))]), 10, 10)
    assert raster.weights[2, 4] == pytest.approx([0.3, 0.45, 0.25])


def test_a_triangle_seen_edge_on_or_off_the_picture_shows_nothing():
    edge_on = at(FAR, (1.0, 1.0), (5.0, 5.0), (9.0, 9.0))
    outside = at(FAR, (-9.0, 1.0), (-1.0, 1.0), (-5.0, 8.0))
    assert (rasterise(np.array([edge_on, outside]), 10, 10).triangle == -1).all()


def test_a_line_is_hidden_where_a_face_is_before_it():
    nearness = rasterise(np.array(halves(1.5)), 10, 10).nearness
    visible, hidden = np.zeros((10, 10)), np.zeros((10, 10))
    line = np.array([[[0.0, 4.5, FAR], [10.0, 4.5, FAR]], [[0.0, 6.5, NEAR], [10.0, 6.5, NEAR]]])
    draw_segments(line, nearness, 1.0, 1e-3, visible, hidden)
    assert visible[4].tolist() == [1.0] + [0.0] * 8 + [1.0]
    assert hidden[4].tolist() == [0.0] + [1.0] * 8 + [0.0]
    assert visible[6].all() and not hidden[6].any()
