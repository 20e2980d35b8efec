"""Does a node go through a triangle, from outside to inside?"""

import numpy as np
import pytest

from tests import naive
from tissue.contact.point_triangle import Corners, point_triangle
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Seen from outside, from above, it turns left."""


def corners(p, triangle=TRIANGLE):
    return Corners(*(Vec3(*map(float, row)) for row in [p, *triangle]))


def met(p_t0, p_t1, residual=0.0, triangle_t1=TRIANGLE):
    return point_triangle(corners(p_t0), corners(p_t1, triangle_t1), residual, 1e-9)


def test_a_node_that_comes_from_above_and_is_now_below_went_through():
    found = met([0.2, 0.3, 0.1], [0.2, 0.3, -0.05])
    assert found.is_through
    assert found.normal == (0.0, 0.0, 1.0)
    assert (found.b, found.c) == pytest.approx((0.2, 0.3))


@pytest.mark.parametrize(
    ("p_t0", "p_t1"),
    [
        ([0.2, 0.3, 0.1], [0.2, 0.3, 0.02]),
        ([1.2, 0.3, 0.1], [1.2, 0.3, -0.1]),
        ([0.2, 0.3, -0.1], [0.2, 0.3, 0.1]),
        ([0.2, 0.3, -0.1], [0.2, 0.3, -0.1]),
        ([0.2, 0.3, -0.1], [0.21, 0.3, -0.11]),
        ([-0.3, 0.3, -0.1], [0.2, 0.3, -0.1]),
    ],
    ids=["stays above", "passes beside", "comes out", "lies below", "moves below", "goes round"],
)
def test_any_other_node_did_not(p_t0, p_t1):
    assert not met(p_t0, p_t1).is_through


def test_a_node_left_below_is_found_again_within_its_slack():
    assert not met([0.2, 0.3, -0.01], [0.2, 0.3, -0.01]).is_through
    assert met([0.2, 0.3, -0.01], [0.2, 0.3, -0.01], residual=0.02).is_through


def test_a_node_that_goes_through_and_out_at_the_side_is_held_at_the_rim():
    found = met([0.5, 0.2, 0.1], [0.5, -1.0, -2.0])
    assert found.is_through
    assert found.c == 0.0 and 0.0 <= found.b <= 1.0


def test_a_triangle_that_moves_up_over_a_node_goes_through_it_too():
    moved = TRIANGLE + np.array([0.0, 0.0, 0.2])
    assert met([0.2, 0.3, 0.1], [0.2, 0.3, 0.1], triangle_t1=moved).is_through


@pytest.mark.parametrize("seed", range(3))
def test_nothing_that_a_film_of_the_motion_shows_going_through_is_missed(seed):
    """And nothing is found that is above the triangle, or too deep below it to have come now."""
    random = np.random.default_rng(seed)
    n_through = 0
    for _ in range(100):
        triangle_t0 = TRIANGLE + random.normal(scale=0.2, size=(3, 3))
        triangle_t1 = triangle_t0 + random.normal(scale=0.02, size=(3, 3))
        w = random.dirichlet([1.0, 1.0, 1.0])
        p_t0 = w @ triangle_t0 + [0.0, 0.0, 0.1]
        p_t1 = p_t0 + random.normal(scale=0.2, size=3) - [0.0, 0.0, 0.1]
        expected = naive.goes_through(p_t0, p_t1, triangle_t0, triangle_t1)
        if expected is None:  # too close to the rim, or to the plane, for a film to tell
            continue
        t0, t1 = corners(p_t0, triangle_t0), corners(p_t1, triangle_t1)
        found = point_triangle(t0, t1, 0.0, 1e-9).is_through
        n_through += expected
        assert found or not expected
        if found:
            area = np.cross(triangle_t1[1] - triangle_t1[0], triangle_t1[2] - triangle_t1[0])
            depth = -(p_t1 - triangle_t1[0]) @ area / np.linalg.norm(area)
            farthest = np.linalg.norm(p_t1 - p_t0) + np.abs(triangle_t1 - triangle_t0).max() * 2
            assert 0.0 < depth < farthest
    assert n_through > 5
