"""The deepest point of a triangle in a geom, against the deepest of many points of it."""

import numpy as np
import pytest

from tests.tissue.contact.geoms.test_signed_distance import GEOMS
from tissue.contact.geoms.deepest_point import deepest_point
from tissue.contact.geoms.geom_arrays import new_geoms
from tissue.contact.geoms.signed_distance import distance_to
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel

N = 24
WEIGHTS = np.array([(i, j, N - i - j) for i in range(N + 1) for j in range(N + 1 - i)]) / N


def triangles(seed, n):
    """Triangles with edges of some centimetres around the geoms."""
    return np.random.default_rng(seed).uniform(-0.03, 0.03, (n, 3, 3))


@pytest.mark.parametrize("shape", GEOMS)
def test_no_point_of_the_triangle_is_deeper_by_more_than_half_a_percent_of_an_edge(shape):
    geoms = new_geoms([GEOMS[shape]])
    for corners in triangles(1, 25):
        found = deepest_point(geoms, 0, *(Vec3(*corner) for corner in corners))
        weights = np.array(found.weights)
        others = [distance_to(geoms, 0, Vec3(*x)).distance for x in WEIGHTS @ corners]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
        assert found.distance <= min(others) + 0.005 * longest
        assert weights.sum() == pytest.approx(1.0)
        assert weights.min() >= -1e-12
        at = distance_to(geoms, 0, Vec3(*(weights @ corners)))
        assert at.distance == pytest.approx(found.distance, abs=1e-12)


def test_a_ball_above_the_middle_of_a_face_touches_it_there():
    geoms = new_geoms([GEOMS["sphere"]])
    geoms.origin[0] = (0.0, 0.0, 0.015)
    corners = 0.05 * np.array([[1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
    found = deepest_point(geoms, 0, *(Vec3(*corner) for corner in corners))
    assert np.array(found.weights) == pytest.approx([1 / 3] * 3, abs=0.02)
    assert found.distance == pytest.approx(-0.005, abs=2e-5)
