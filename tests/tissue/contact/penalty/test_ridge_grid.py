"""What grids of ridges find is what overlaps, less what faces alike and what finds the other."""

import math

import numpy as np
import pytest

from tissue.contact.penalty.ridge_grid import (
    arrange_ridges,
    enter_ridge,
    find_near_ridges,
    new_ridge_grid,
)
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3
from tissue.geometry.aabb import Aabb, box_at

pytestmark = pytest.mark.kernel

SIZE = 0.05
ALIKE = 0.5
NOW = 3


@kernel
def fill(grid, low, high, outward, asked_at):
    """Enter ridges and arrange them."""
    grid.short.n_items = grid.long.n_items = 0
    for i in range(len(low)):
        enter_ridge(grid, i, box_at(low, high, i), SIZE)
    arrange_ridges(grid, low, high, outward, asked_at, NOW, SIZE)


def on_two_lips(random, n):
    """Return boxes and directions of ridges on two bent lips, some at rims without a direction."""
    side = np.where(random.random(n) < 0.5, 1.0, -1.0)
    middle = random.uniform(size=(n, 3)) * [1.0, 1.0, 0.02]
    direction = np.stack([0.4 * middle[:, 0], np.zeros(n), side], axis=1)
    direction += random.normal(scale=0.1, size=(n, 3))
    direction *= random.uniform(0.1, 3.0, size=(n, 1))
    direction[random.random(n) < 0.02] = 0.0
    reach = random.uniform(0.2, 0.5, size=(n, 3)) * SIZE
    reach[random.random(n) < 0.1] *= 4.0
    return middle - reach, middle + reach, direction


@pytest.mark.parametrize("n", [0, 1, 8, 9, 70, 700])
def test_the_grid_finds_what_testing_all_finds(n):
    random, grid = np.random.default_rng(n), new_ridge_grid(700)
    fill(grid, *on_two_lips(random, 700), np.zeros(700, np.int64))  # of which nothing is left
    low, high, outward = on_two_lips(random, n)
    asked_at = np.where(random.random(n) < 0.3, NOW, NOW - 1)
    fill(grid, low, high, outward, asked_at)
    unit = outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None]
    numbers, n_found = np.arange(n), 0
    for a, b, asking in zip(*on_two_lips(random, 60), strict=True):
        ridge = int(random.integers(700))
        furthest = ALIKE * float(np.linalg.norm(asking))
        overlaps = ((low <= b) & (high >= a)).all(axis=1)
        overlaps &= (asked_at != NOW) | (numbers < ridge)
        box, towards = Aabb(Vec3(*a), Vec3(*b)), Vec3(*asking)
        found = grid.found[: find_near_ridges(grid, ridge, box, towards, furthest)]
        assert sorted(found) == list(np.flatnonzero(overlaps & ~(unit @ asking > furthest)))
        n_found += len(found)
        everywhere = grid.found[: find_near_ridges(grid, ridge, box, towards, math.inf)]
        assert sorted(everywhere) == list(np.flatnonzero(overlaps))
    assert n < 700 or n_found > 60


def test_ridges_far_from_all_others_are_found_where_they_are():
    low = np.array([[0.0, 0.0, 0.0], [1e3, 0.0, 0.0], [0.0, -1e3, 1e3]])
    outward = np.zeros((3, 3))
    grid = new_ridge_grid(3)
    fill(grid, low, low + SIZE, outward, np.zeros(3, np.int64))
    for i in range(3):
        box = box_at(low, low + SIZE, i)
        assert find_near_ridges(grid, 5, box, Vec3(0.0, 0.0, 1.0), 0.5) == 1
        assert grid.found[0] == i
