"""The path of the edge: where it has been, and where it has not."""

import numpy as np
import pytest

from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import Path, average_directions, is_unswept, new_path

pytestmark = pytest.mark.kernel

MARGIN = 0.1
N = 4
"""Samples of the edge, from the tip at z = 0 to the heel at z = 3."""


def path_to(y: float, rise: float = 0.0) -> Path:
    """Return the path of an upright edge that went along y, up by `rise` per distance, to `y`."""
    path = new_path(N)
    path.forward[:] = [0.0, 1.0, 0.0]
    path.sideways[:] = [1.0, 0.0, 0.0]
    path.member[:] = True
    path.linked[:-1] = True
    for at in np.arange(0.0, y, 0.5) + 0.5:
        path.t1[:] = [[0.0, at, k + rise * at] for k in range(N)]
        path.t0[:] = path.t1 - [0.0, 0.5, 0.5 * rise]
        average_directions(path, 0.5)
    return path


@pytest.mark.parametrize(
    ("y", "z", "unswept"),
    [
        (1.5, 1.5, False),  # behind the edge
        (2.05, 1.5, False),  # ahead, and nearer than the margin
        (2.2, 1.5, True),  # ahead
        (1.5, -0.2, True),  # below the way of the tip
        (1.5, 3.2, True),  # above the way of the heel
        (1.5, -0.05, False),  # below, and nearer than the margin
    ],
)
def test_what_is_ahead_of_the_edge_or_beyond_its_ends_is_unswept(y, z, unswept):
    assert is_unswept(path_to(2.0), Vec3(0.0, y, z), MARGIN, MARGIN) == unswept


@pytest.mark.parametrize("y", [0.0, 1.0, 1.9])
def test_the_way_of_a_tip_that_rises_was_lower_before(y):
    path = path_to(2.0, rise=0.5)
    assert not is_unswept(path, Vec3(0.0, y, 0.5 * y), MARGIN, MARGIN)
    assert is_unswept(path, Vec3(0.0, y, 0.5 * y - 1.5 * MARGIN), MARGIN, MARGIN)


def test_a_tip_outside_the_tissue_has_no_way():
    path = path_to(2.0)
    path.member[0] = path.linked[0] = False
    average_directions(path, 0.5)
    assert not path.direction[0].any()
    assert path.direction[1] == pytest.approx([0.0, 1.0, 0.0])


def test_a_tip_in_another_wall_says_nothing_of_this_one():
    path = path_to(2.0)
    path.linked[1] = False  # tip and sample 1 hold one wall, samples 2 and 3 another
    assert not is_unswept(path, Vec3(0.0, 1.9, 1.8), MARGIN, MARGIN)
    path.t1[:2] += [0.0, 0.0, 10.0]  # the way of the tip is above that of the other wall
    assert not is_unswept(path, Vec3(0.0, 1.9, 1.8), MARGIN, MARGIN)


def test_of_an_edge_that_spans_nothing_nothing_is_unswept():
    assert not is_unswept(new_path(N), Vec3(0.0, 1.0, 1.0), MARGIN, MARGIN)
