"""`Aabb`: a box whose sides are parallel to the axes."""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, store, vec3


class Aabb(NamedTuple):
    """An axis-aligned box."""

    low: Vec3
    """Lowest corner [m]."""
    high: Vec3
    """Highest corner [m]."""


@kernel
def empty_box() -> Aabb:
    """Return the box that holds no point and overlaps none."""
    return Aabb(Vec3(math.inf, math.inf, math.inf), Vec3(-math.inf, -math.inf, -math.inf))


@kernel
def with_point(box: Aabb, p: Vec3) -> Aabb:
    """Return the smallest box that holds a box and a point."""
    low, high = box.low, box.high
    return Aabb(
        Vec3(min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)),
        Vec3(max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)),
    )


@kernel
def widened(box: Aabb, margin: float) -> Aabb:
    """Return a box that is larger by `margin` [m] on each side."""
    low, high = box.low, box.high
    return Aabb(
        Vec3(low.x - margin, low.y - margin, low.z - margin),
        Vec3(high.x + margin, high.y + margin, high.z + margin),
    )


@kernel
def overlap(one: Aabb, other: Aabb) -> bool:
    """Whether two boxes have a point in common, if only on their sides."""
    return (
        one.low.x <= other.high.x
        and other.low.x <= one.high.x
        and one.low.y <= other.high.y
        and other.low.y <= one.high.y
        and one.low.z <= other.high.z
        and other.low.z <= one.high.z
    )


@kernel
def overlap_within(one: Aabb, other: Aabb, margin: float) -> bool:
    """Whether a box overlaps the other once that is larger by `margin` [m] on each side."""
    return overlap(one, widened(other, margin))


@kernel
def box_at(low: FloatArray, high: FloatArray, i: int) -> Aabb:
    """Return the box between rows `i` of two arrays of corners, shape (n, 3)."""
    return Aabb(vec3(low, i), vec3(high, i))


@kernel
def store_box(low: FloatArray, high: FloatArray, i: int, box: Aabb) -> None:
    """Write the corners of a box to rows `i` of two arrays, shape (n, 3)."""
    store(low, i, box.low)
    store(high, i, box.high)
