"""`Aabb`: a box whose sides are parallel to the axes.

Lengths are in metres, or in units of the lattice where boxes are made of whole numbers.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, store, vec3


class Aabb(NamedTuple):
    """An axis-aligned box."""

    low: Vec3
    """Lowest corner."""
    high: Vec3
    """Highest corner."""


@kernel
def empty_box() -> Aabb:
    """Return the box that holds no point and overlaps none."""
    return Aabb(Vec3(math.inf, math.inf, math.inf), Vec3(-math.inf, -math.inf, -math.inf))


@inlined
def with_point(box: Aabb, p: Vec3) -> Aabb:
    """Return the smallest box that holds a box and a point."""
    low, high = box.low, box.high
    return Aabb(
        Vec3(min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)),
        Vec3(max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)),
    )


@inlined
def widened(box: Aabb, margin: float) -> Aabb:
    """Return a box that is larger by `margin` on each side."""
    low, high = box.low, box.high
    return Aabb(
        Vec3(low.x - margin, low.y - margin, low.z - margin),
        Vec3(high.x + margin, high.y + margin, high.z + margin),
    )


@inlined
def overlap(one: Aabb, other: Aabb) -> bool:
    """Whether two boxes have a point in common, if only on their sides."""
    if one.low.x > other.high.x or one.high.x < other.low.x:
        return False
    if one.low.y > other.high.y or one.high.y < other.low.y:
        return False
    return not (one.low.z > other.high.z or one.high.z < other.low.z)


@kernel
def overlap_within(one: Aabb, other: Aabb, margin: float) -> bool:
    """Whether a box overlaps the other once that is larger by `margin` on each side."""
    return overlap(one, widened(other, margin))


@kernel
def box_at(low: FloatArray, high: FloatArray, i: int) -> Aabb:
    """Return the box between rows `i` of two arrays of corners, shape (n, 3)."""
    return Aabb(vec3(low, i), vec3(high, i))


@kernel
def box_between(corners: FloatArray) -> Aabb:
    """Return the box between two corners, shape (2, 3)."""
    return Aabb(vec3(corners, 0), vec3(corners, 1))


@kernel
def store_box(low: FloatArray, high: FloatArray, i: int, box: Aabb) -> None:
    """Write the corners of a box to rows `i` of two arrays, shape (n, 3)."""
    store(low, i, box.low)
    store(high, i, box.high)


@kernel
def segment_box(points: FloatArray | IntArray, a: int, b: int) -> Aabb:
    """Return the box around rows `a` and `b` of an array of points, shape (n, 3)."""
    return Aabb(
        Vec3(
            min(points[a, 0], points[b, 0]),
            min(points[a, 1], points[b, 1]),
            min(points[a, 2], points[b, 2]),
        ),
        Vec3(
            max(points[a, 0], points[b, 0]),
            max(points[a, 1], points[b, 1]),
            max(points[a, 2], points[b, 2]),
        ),
    )


@kernel
def tetrahedron_box(points: FloatArray | IntArray, tetrahedra: IntArray, t: int) -> Aabb:
    """Return the box around tetrahedron `t`, whose nodes are rows of an array of points."""
    x_low, x_high = _extent(points, tetrahedra, t, 0)
    y_low, y_high = _extent(points, tetrahedra, t, 1)
    z_low, z_high = _extent(points, tetrahedra, t, 2)
    return Aabb(Vec3(x_low, y_low, z_low), Vec3(x_high, y_high, z_high))


@kernel
def _extent(
    points: FloatArray | IntArray, tetrahedra: IntArray, t: int, axis: int
) -> tuple[float, float]:
    """Return the least and the greatest coordinate of tetrahedron `t` along an axis."""
    p = points[tetrahedra[t, 0], axis]
    q = points[tetrahedra[t, 1], axis]
    r = points[tetrahedra[t, 2], axis]
    s = points[tetrahedra[t, 3], axis]
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))
