"""What a tree of blocks finds is what overlaps, less what faces alike."""

import math

import numpy as np
import pytest

from tissue.contact.penalty.block_tree import arrange, enter, find_near, new_block_tree
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, vec3
from tissue.geometry.aabb import Aabb, box_at

pytestmark = pytest.mark.kernel

ALIKE = 0.17


@kernel
def fill(tree, low, high, direction):
    """Enter things and arrange them."""
    tree.n_items = 0
    for i in range(len(low)):
        enter(tree, 100 + i, box_at(low, high, i), vec3(direction, i))
    arrange(tree, ALIKE)


def on_two_lips(random, n):
    """Return boxes and directions of things on two bent lips, some at rims without a direction."""
    side = np.where(random.random(n) < 0.5, 1.0, -1.0)
    middle = random.uniform(size=(n, 3)) * [1.0, 1.0, 0.02]
    direction = np.stack([0.4 * middle[:, 0], np.zeros(n), side], axis=1)
    direction += random.normal(scale=0.1, size=(n, 3))
    direction *= random.uniform(0.1, 3.0, size=(n, 1))
    direction[random.random(n) < 0.02] = 0.0
    reach = random.uniform(0.01, 0.1, size=(n, 1))
    return middle - reach, middle + reach, direction


@pytest.mark.parametrize("n", [1, 8, 9, 70, 700])
def test_the_tree_finds_what_testing_all_finds(n):
    random, tree = np.random.default_rng(n), new_block_tree(700)
    fill(tree, *on_two_lips(random, 700))  # of which nothing is left
    low, high, direction = on_two_lips(random, n)
    fill(tree, low, high, direction)
    cosine = direction / np.maximum(np.linalg.norm(direction, axis=1), 1e-300)[:, None]
    n_found = 0
    for a, b, asking in zip(*on_two_lips(random, 60), strict=True):
        length = float(np.linalg.norm(asking))
        overlaps = ((low <= b) & (high >= a)).all(axis=1)
        faces_alike = (cosine @ asking > ALIKE * length) & (length > 0.0)
        box, towards = Aabb(Vec3(*a), Vec3(*b)), Vec3(*asking)
        found = find_near(tree, box, towards, length)
        assert set(tree.found[:found] - 100) == set(np.flatnonzero(overlaps & ~faces_alike))
        assert len(set(tree.found[:found])) == found
        n_found += found
        everywhere = find_near(tree, box, towards, math.inf)
        assert set(tree.found[:everywhere] - 100) == set(np.flatnonzero(overlaps))
    assert n < 70 or n_found > 60
