"""Bounding boxes contain their points, and overlap where they share a point."""

import itertools

import numpy as np
import pytest

from tissue.core.vec3 import Vec3
from tissue.geometry.aabb import (
    Aabb,
    box_at,
    empty_box,
    overlap,
    overlap_within,
    store_box,
    widened,
    with_point,
)

pytestmark = pytest.mark.kernel

UNIT = Aabb(Vec3(0.0, 0.0, 0.0), Vec3(1.0, 1.0, 1.0))


def moved(box, x, y, z):
    d = Vec3(x, y, z)
    return Aabb(
        *(Vec3(*(p + q for p, q in zip(corner, d, strict=True))) for corner in (box.low, box.high))
    )


def test_a_box_of_points_is_the_smallest_that_contains_them():
    points = np.random.default_rng(0).normal(size=(20, 3))
    box = empty_box()
    for row in points.tolist():
        box = with_point(box, Vec3(*row))
    assert box.low == tuple(points.min(axis=0)) and box.high == tuple(points.max(axis=0))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_boxes_overlap_until_their_sides_separate(axis, sign):
    for distance, overlaps in ((0.5, True), (1.0, True), (1.001, False)):
        d = [0.2, -0.3, 0.1]
        d[axis] = sign * distance
        other = moved(UNIT, *d)
        assert overlap(UNIT, other) == overlap(other, UNIT) == overlaps


def test_boxes_that_share_a_corner_or_are_nested_overlap():
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        assert overlap(UNIT, moved(UNIT, *signs))
    assert overlap(UNIT, Aabb(Vec3(0.4, 0.4, 0.4), Vec3(0.5, 0.5, 0.5)))


def test_overlap_within_a_margin_is_overlap_with_a_widened_box():
    for distance, overlaps in ((1.2, True), (1.3, False)):
        other = moved(UNIT, 0.0, distance, 0.0)
        assert overlap_within(UNIT, other, 0.25) == overlaps
        assert overlap(UNIT, widened(other, 0.25)) == overlaps


def test_an_empty_box_overlaps_nothing():
    assert not overlap(empty_box(), UNIT)
    assert not overlap(UNIT, widened(empty_box(), 1.0))


def test_a_box_is_stored_in_rows_of_two_arrays():
    low, high = np.zeros((2, 3)), np.zeros((2, 3))
    store_box(low, high, 1, UNIT)
    assert box_at(low, high, 1) == UNIT
    assert not low.any() and not high[0].any()
