"""The test whether a node passes through a triangle from outside to inside."""

import numpy as np
import pytest

from tests import naive
from tissue.contact.point_triangle import Corners, point_triangle
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""A triangle whose outside is above: counter-clockwise seen from there."""


def corners(p, triangle=TRIANGLE):
    return Corners(*(Vec3(*map(float, row)) for row in [p, *triangle]))


def passage(p_t0, p_t1, residual=0.0, triangle_t1=TRIANGLE):
    return point_triangle(corners(p_t0), corners(p_t1, triangle_t1), residual, 1e-9)


def test_a_node_that_moves_from_above_to_below_passes_through():
    found = passage([0.2, 0.3, 0.1], [0.2, 0.3, -0.05])
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
    ids=["stays above", "passes beside", "comes out", "lies below", "moves below", "moves around"],
)
def test_other_nodes_do_not_pass_through(p_t0, p_t1):
    assert not passage(p_t0, p_t1).is_through


def test_a_node_left_below_is_found_again_within_its_residual():
    assert not passage([0.2, 0.3, -0.01], [0.2, 0.3, -0.01]).is_through
    assert passage([0.2, 0.3, -0.01], [0.2, 0.3, -0.01], residual=0.02).is_through


def test_a_node_that_passes_through_and_out_at_the_side_gets_a_contact_on_the_boundary():
    found = passage([0.5, 0.2, 0.1], [0.5, -1.0, -2.0])
    assert found.is_through
    assert found.c == 0.0 and 0.0 <= found.b <= 1.0


def test_a_triangle_that_moves_up_past_a_node_counts_too():
    moved = TRIANGLE + np.array([0.0, 0.0, 0.2])
    assert passage([0.2, 0.3, 0.1], [0.2, 0.3, 0.1], triangle_t1=moved).is_through


@pytest.mark.parametrize("seed", range(3))
def test_no_passage_that_sampling_the_motion_shows_is_missed(seed):
    """And no node is found that is above the triangle, or deeper than it can have moved."""
    random = np.random.default_rng(seed)
    n_through = 0
    for _ in range(100):
        triangle_t0 = TRIANGLE + random.normal(scale=0.2, size=(3, 3))
        triangle_t1 = triangle_t0 + random.normal(scale=0.02, size=(3, 3))
        w = random.dirichlet([1.0, 1.0, 1.0])
        p_t0 = w @ triangle_t0 + [0.0, 0.0, 0.1]
        p_t1 = p_t0 + random.normal(scale=0.2, size=3) - [0.0, 0.0, 0.1]
        expected = naive.passes_through(p_t0, p_t1, triangle_t0, triangle_t1)
        if expected is None:  # too close to the boundary, or to the plane, to decide by sampling
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
