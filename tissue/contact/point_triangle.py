"""Whether a node went through a triangle during a step, and where it now is under it."""

import math
from typing import NamedTuple

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, lerp, norm, scale, sub

RIM = 0.01
"""How far outside a triangle, as a barycentric weight, a node still meets it. Between triangles
that meet in an edge nothing slips through; larger, and a node beside a ridge is stopped by it."""


class PointTriangle(NamedTuple):
    """A node that went through a triangle, seen at the end of the step."""

    is_through: bool
    normal: Vec3
    """Unit vector outwards."""
    b: float
    """Weight of the triangle's second corner at the point under the node."""
    c: float
    """Weight of the triangle's third corner at the point under the node."""


class Corners(NamedTuple):
    """A point and the corners of a triangle, at one instant."""

    p: Vec3
    a: Vec3
    b: Vec3
    c: Vec3


@kernel
def rim_width(a: Vec3, b: Vec3, c: Vec3) -> float:
    """Return how far outside a triangle a node may be that still meets it, at most [m]."""
    ab, ac = sub(b, a), sub(c, a)
    return RIM * (math.sqrt(dot(ab, ab)) + math.sqrt(dot(ac, ac)))


@kernel
def weights_below(at: Corners, area: Vec3) -> tuple[float, float]:
    """Return the weights of b and c at the point of the plane under p; `area` is its normal."""
    square = dot(area, area)
    d = sub(at.p, at.a)
    b = dot(cross(d, sub(at.c, at.a)), area) / square
    c = dot(cross(sub(at.b, at.a), d), area) / square
    return b, c


class PlanePoint(NamedTuple):
    """The point of a triangle's plane under a node."""

    b: float
    """Weight of the triangle's second corner at the point under the node."""
    c: float
    """Weight of the triangle's third corner at the point under the node."""
    normal: Vec3
    """Unit vector outwards."""


@kernel
def project_to_plane(at: Corners) -> PlanePoint:
    """Return the point of the triangle's plane under p."""
    area = cross(sub(at.b, at.a), sub(at.c, at.a))
    b, c = weights_below(at, area)
    return PlanePoint(b, c, scale(1.0 / norm(area), area))


@kernel
def is_within(b: float, c: float) -> bool:
    """Whether weights belong to a point in the triangle, or on its rim."""
    return b >= -RIM and c >= -RIM and b + c <= 1.0 + RIM


@kernel
def point_triangle(t0: Corners, t1: Corners, residual: float, tolerance: float) -> PointTriangle:
    """Test whether p went through abc, from outside to inside, between t0 and t1.

    It did if it was above the triangle's plane and is now under the triangle; or if it went through
    and out again beside it. A node that was under the plane before went round the triangle, or is
    one of the same body that lies behind a corner or in a thin wedge: that is no contact.

    Args:
        t0: Node and triangle before the step.
        t1: Node and triangle after the step.
        residual: How far inside p may have been at t0 [m]: where it could not be pushed out.
        tolerance: Depth that counts as none [m].
    """
    outside = PointTriangle(False, t1.p, 0.0, 0.0)
    area = cross(sub(t1.b, t1.a), sub(t1.c, t1.a))
    height = dot(area, sub(t1.p, t1.a))
    if height >= 0.0:
        return outside
    double_area = norm(area)
    depth = -height / double_area
    if not depth > tolerance:
        return outside
    b, c = weights_below(t1, area)
    before = cross(sub(t0.b, t0.a), sub(t0.c, t0.a))
    gap = dot(before, sub(t0.p, t0.a)) / norm(before)
    if is_within(b, c):
        if not gap >= -residual:
            return outside
    elif not gap > 0.0:
        return outside
    else:
        when = gap / (gap + depth)
        then = Corners(
            lerp(when, t0.p, t1.p),
            lerp(when, t0.a, t1.a),
            lerp(when, t0.b, t1.b),
            lerp(when, t0.c, t1.c),
        )
        b_then, c_then = weights_below(then, cross(sub(then.b, then.a), sub(then.c, then.a)))
        if not is_within(b_then, c_then):
            return outside
        b, c = into_triangle(b, c)
    return PointTriangle(True, scale(1.0 / double_area, area), b, c)


@kernel
def into_triangle(b: float, c: float) -> tuple[float, float]:
    """Return the weights of a point of the triangle near a point outside."""
    a = max(1.0 - b - c, 0.0)
    b = max(b, 0.0)
    c = max(c, 0.0)
    return b / (a + b + c), c / (a + b + c)
