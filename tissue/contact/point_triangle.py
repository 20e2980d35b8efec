"""Whether a node went through a triangle during a step, and where it now is under it."""

from typing import NamedTuple

from tissue.core.jit import inlined, kernel
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
    """Weight of its third corner."""


class Corners(NamedTuple):
    """A point and the corners of a triangle, at one instant."""

    p: Vec3
    a: Vec3
    b: Vec3
    c: Vec3


@kernel
def weights_below(at: Corners, area: Vec3) -> tuple[float, float]:
    """Weights of b and c at the point of the triangle's plane under p; `area` is its normal."""
    square = dot(area, area)
    d = sub(at.p, at.a)
    b = dot(cross(d, sub(at.c, at.a)), area) / square
    c = dot(cross(sub(at.b, at.a), d), area) / square
    return b, c


class Below(NamedTuple):
    """The point of a triangle's plane under p."""

    b: float
    """Weight of the triangle's second corner."""
    c: float
    """Weight of its third corner."""
    normal: Vec3
    """Unit vector outwards."""


@kernel
def under(at: Corners) -> Below:
    """Find the point of the triangle's plane under p."""
    area = cross(sub(at.b, at.a), sub(at.c, at.a))
    b, c = weights_below(at, area)
    return Below(b, c, scale(1.0 / norm(area), area))


@kernel
def is_within(b: float, c: float) -> bool:
    """Whether weights belong to a point in the triangle, or on its rim."""
    return b >= -RIM and c >= -RIM and b + c <= 1.0 + RIM


@inlined
def is_under(at: Corners) -> bool:
    """Whether p is on the inner side of the triangle's plane: the first thing to look at."""
    return dot(cross(sub(at.b, at.a), sub(at.c, at.a)), sub(at.p, at.a)) < 0.0


@kernel
def point_triangle(t0: Corners, t1: Corners, slack: float, nothing_yet: float) -> PointTriangle:
    """Tell whether p went through abc, from outside to inside, between t0 and t1.

    It did if it was above the triangle's plane and is now under the triangle; or if it went through
    and out again beside it. A node that was under the plane before went round the triangle, or is
    one of the same body that lies behind a corner or in a thin wedge: it is left alone.

    Args:
        t0: Before the step.
        t1: After it.
        slack: How far inside p may have been at t0 [m]: where it could not be pushed out.
        nothing_yet: Depth that is none [m].
    """
    outside = PointTriangle(False, t1.p, 0.0, 0.0)
    area = cross(sub(t1.b, t1.a), sub(t1.c, t1.a))
    height = dot(area, sub(t1.p, t1.a))
    if height >= 0.0:
        return outside
    double_area = norm(area)
    depth = -height / double_area
    if not depth > nothing_yet:
        return outside
    b, c = weights_below(t1, area)
    before = cross(sub(t0.b, t0.a), sub(t0.c, t0.a))
    gap = dot(before, sub(t0.p, t0.a)) / norm(before)
    if is_within(b, c):
        if not gap >= -slack:
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
    """Weights of a point of the triangle near one outside."""
    a = max(1.0 - b - c, 0.0)
    b = max(b, 0.0)
    c = max(c, 0.0)
    return b / (a + b + c), c / (a + b + c)
