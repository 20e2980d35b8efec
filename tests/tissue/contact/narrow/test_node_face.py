"""Eight nodes over a face each are measured to the bit as one is by scalars."""

import math

import numpy as np
import pytest

from tissue.contact.narrow.node_face import over_faces, points_of_tests
from tissue.core.jit import kernel
from tissue.core.simd import room_for_points, store_lanes
from tissue.core.vec3 import cross, dot, scale, sub, vec3

pytestmark = pytest.mark.kernel


def measure(x, nodes, out):
    over = over_faces(points_of_tests(x, nodes, 0))
    store_lanes(out, 0, over.height)
    store_lanes(out, 8, over.weights.x)
    store_lanes(out, 16, over.weights.y)
    store_lanes(out, 24, over.weights.z)


@pytest.mark.parametrize("seed", range(3))
def test_height_and_weights_are_those_of_scalars(seed):
    random = np.random.default_rng(seed)
    x = room_for_points(20)
    x[:] = random.normal(size=(20, 3))
    nodes = np.array([random.choice(20, 4, replace=False) for _ in range(8)])
    out = np.zeros(32)
    kernel(measure)(x, nodes, out)
    for k, (node, a, b, c) in enumerate(nodes):
        corner = vec3(x, a)
        ab, ac = sub(vec3(x, b), corner), sub(vec3(x, c), corner)
        ap, area = sub(vec3(x, node), corner), cross(ab, ac)
        square = dot(area, area)
        wb, wc = dot(cross(ap, ac), area) / square, dot(cross(ab, ap), area) / square
        assert out[k] == dot(ap, scale(1.0 / math.sqrt(square), area))
        assert (out[8 + k], out[16 + k], out[24 + k]) == (1.0 - wb - wc, wb, wc)
