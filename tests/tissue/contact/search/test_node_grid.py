"""What a grid finds for a face are the nodes that testing all finds."""

import numpy as np
import pytest

from tissue.contact.search.node_grid import (
    DEEPEST,
    SAME_SHEET,
    FaceQuery,
    arrange_grid,
    enter_node,
    find_in_box,
    find_near_face,
    new_node_grid,
)
from tissue.contact.search.node_motion import BALL, new_node_motion
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3
from tissue.geometry.aabb import Aabb

pytestmark = pytest.mark.kernel

SIZE = 0.1


@kernel
def fill(grid, motion, normal, nodes, edge):
    """Enter nodes and arrange them."""
    grid.n_items = 0
    for i in range(len(nodes)):
        enter_node(grid, nodes[i])
    arrange_grid(grid, motion, normal, edge)


def at_random(random, n, extent):
    """Return nodes in their balls and their normals, of which some are 0."""
    motion, normal = new_node_motion(n, SIZE), random.normal(size=(n, 3))
    motion.reference[:] = random.uniform(size=(n, 3)) * extent
    motion.radius[:] = BALL * SIZE * np.where(random.random(n) < 0.7, 1.0, 3.0)
    normal[random.random(n) < 0.05] = 0.0
    return motion, normal


def a_face(random, extent):
    """Return the query of a triangle somewhere."""
    corners = random.uniform(size=3) * extent + random.normal(scale=0.1, size=(3, 3))
    area, reach = np.cross(corners[1] - corners[0], corners[2] - corners[0]), 0.2 * SIZE
    around = reach + BALL * SIZE
    box = Aabb(Vec3(*(corners.min(0) - around)), Vec3(*(corners.max(0) + around)))
    length = float(np.linalg.norm(area))
    return FaceQuery(0, (0, 1, 2), Vec3(*corners[0]), Vec3(*area), length, reach, box)


def in_box(motion, nodes, box):
    """Return of which nodes the ball reaches into a box."""
    more = np.maximum(motion.radius[nodes] - BALL * SIZE, 0.0)[:, None]
    low, high = motion.reference[nodes] - more, motion.reference[nodes] + more
    return ((low <= box.high) & (high >= box.low)).all(axis=1)


def at_face(motion, normal, nodes, face):
    """Return which nodes are near the plane of a face and do not face the same side."""
    height = (motion.reference[nodes] - face.corner) @ face.area / face.length
    reach = face.reach + motion.radius[nodes]
    length = np.maximum(np.linalg.norm(normal[nodes], axis=1), 1e-300)
    is_same_side = normal[nodes] @ face.area > SAME_SHEET * face.length * length
    return (height <= reach) & (-height <= reach + DEEPEST * SIZE) & ~is_same_side


@pytest.mark.parametrize(("n", "extent"), [(1, 1.0), (9, 1.0), (300, 1.0), (300, 30.0)])
def test_the_grid_finds_what_testing_all_finds(n, extent):
    random, grid, n_found = np.random.default_rng(n), new_node_grid(400), 0
    extent = np.array([extent, 1.0, 1.0])
    fill(grid, *at_random(random, 400, extent), np.arange(400), 0.3 * SIZE)  # nothing is left of it
    motion, normal = at_random(random, 400, extent)
    nodes = random.permutation(400)[:n]
    fill(grid, motion, normal, nodes, 1.4 * SIZE)
    for _ in range(100):
        face = a_face(random, extent)
        wanted = in_box(motion, nodes, face.box)
        found = grid.found[: find_in_box(grid, face.box, SIZE)]
        assert sorted(found) == sorted(nodes[wanted])
        wanted &= at_face(motion, normal, nodes, face)
        found = grid.found[: find_near_face(grid, face, SIZE)]
        assert sorted(found) == sorted(nodes[wanted])
        n_found += len(found)
    assert n < 300 or n_found > 0


def test_an_empty_grid_finds_nothing():
    random, grid = np.random.default_rng(0), new_node_grid(20)
    fill(grid, *at_random(random, 20, np.ones(3)), np.zeros(0, np.int64), SIZE)
    assert find_in_box(grid, Aabb(Vec3(-1e9, -1e9, -1e9), Vec3(1e9, 1e9, 1e9)), SIZE) == 0
