"""Distance of a point from a rigid geom: negative inside, and the direction out of it.

All geoms are convex, and so is each of these functions of the point.
"""

import math
from typing import Final, NamedTuple

from tissue.contact.geoms.geom import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    PLANE,
    SPHERE,
)
from tissue.contact.geoms.geom_arrays import Geoms, to_geom, turned_from_geom
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, dot, lerp, norm, scale, sub

_OFF_CENTRE: Final = 1e-9
"""Distance from its axis from which a point of a capsule has a direction, per radius; and from a
plane of symmetry a point of an ellipsoid is taken to be, per half its size: there the nearest point
of the surface is one alone. Larger: distances near the middle are wrong by as much; 0: a division
by zero there."""

_NEWTON_STEPS: Final = 30
"""Newton steps to the nearest point of an ellipsoid at most. Far from round, 1 : 10 : 100, the most
that 10,000 random points took was 14."""

_NEWTON_END: Final = 1e-14
"""Relative change at which they end: rounding."""

_GOLDEN: Final = 0.6180339887498949
"""Share that a section leaves of an interval."""

_SECTIONS: Final = 11
"""Sections of an interval: 0.5 % of an edge is left, which is how far the deepest point may be from
the true one. More: time; fewer: contacts of faces wander."""

_SAME_DIRECTION: Final = 1.0 - 1e-12
"""Cosine between the normals at the three corners above which they are one: the geom is flat
there, and no point of the triangle is deeper than the deepest corner."""


class Distance(NamedTuple):
    """Where a point is with respect to a geom."""

    distance: float
    """Distance outside; negative inside [m]."""
    normal: Vec3
    """Unit vector in which that grows fastest: out of the geom."""


class Deepest(NamedTuple):
    """The deepest point of a triangle."""

    weights: Vec3
    """Barycentric weights of the corners."""
    distance: float
    """Distance outside; negative inside [m]."""
    normal: Vec3
    """Unit vector out of the geom there."""


@kernel
def distance_to(geoms: Geoms, g: int, x: Vec3) -> Distance:
    """Return the distance of a point of the tissue frame [m], where geom `g` was placed last.

    Outside a mesh it is that from the farthest of the planes of its sides, which is less than that
    from the mesh where an edge is nearest.
    """
    p, shape = to_geom(geoms, g, x), geoms.shape[g]
    if shape == PLANE:
        found = Distance(p.z, Vec3(0.0, 0.0, 1.0))
    elif shape == SPHERE:
        found = _to_capsule(p, geoms.size[g, 0], 0.0)
    elif shape == CAPSULE:
        found = _to_capsule(p, geoms.size[g, 0], geoms.size[g, 1])
    elif shape == CYLINDER:
        found = _to_cylinder(p, geoms.size[g, 0], geoms.size[g, 1])
    elif shape == ELLIPSOID:
        found = _to_ellipsoid(p, Vec3(geoms.size[g, 0], geoms.size[g, 1], geoms.size[g, 2]))
    elif shape == BOX:
        found = _to_box(p, Vec3(geoms.size[g, 0], geoms.size[g, 1], geoms.size[g, 2]))
    else:
        found = _to_planes(p, geoms.plane, geoms.first_plane[g], geoms.first_plane[g + 1])
    return Distance(found.distance, turned_from_geom(geoms.axes, g, found.normal))


@kernel
def _to_capsule(p: Vec3, radius: float, half: float) -> Distance:
    across = Vec3(p.x, p.y, p.z - min(max(p.z, -half), half))
    length = norm(across)
    if length < _OFF_CENTRE * radius:
        return Distance(length - radius, Vec3(1.0, 0.0, 0.0))
    return Distance(length - radius, scale(1.0 / length, across))


@kernel
def _to_cylinder(p: Vec3, radius: float, half: float) -> Distance:
    r = math.hypot(p.x, p.y)
    across, along = r - radius, abs(p.z) - half
    radial = Vec3(p.x / r, p.y / r, 0.0) if r > 0.0 else Vec3(1.0, 0.0, 0.0)
    axial = Vec3(0.0, 0.0, 1.0 if p.z >= 0.0 else -1.0)
    if across > 0.0 and along > 0.0:
        distance = math.hypot(across, along)
        a, b = across / distance, along / distance
        return Distance(distance, Vec3(a * radial.x, a * radial.y, b * axial.z))
    return Distance(across, radial) if across > along else Distance(along, axial)


@kernel
def _to_box(p: Vec3, half: Vec3) -> Distance:
    x, y, z = abs(p.x) - half.x, abs(p.y) - half.y, abs(p.z) - half.z
    sx = 1.0 if p.x >= 0.0 else -1.0
    sy = 1.0 if p.y >= 0.0 else -1.0
    sz = 1.0 if p.z >= 0.0 else -1.0
    if x <= 0.0 and y <= 0.0 and z <= 0.0:
        if x >= y and x >= z:
            return Distance(x, Vec3(sx, 0.0, 0.0))
        return Distance(y, Vec3(0.0, sy, 0.0)) if y >= z else Distance(z, Vec3(0.0, 0.0, sz))
    outside = Vec3(max(x, 0.0), max(y, 0.0), max(z, 0.0))
    distance = norm(outside)
    normal = Vec3(sx * outside.x / distance, sy * outside.y / distance, sz * outside.z / distance)
    return Distance(distance, normal)


@kernel
def _to_ellipsoid(p: Vec3, half: Vec3) -> Distance:
    """Return the distance of a point from an ellipsoid.

    The nearest point is q_i = s_i^2 p_i / (t + s_i^2), with the largest t for which it is on the
    surface. From a t below it Newton's method rises to it, since the function is convex. Source:
    Eberly (2013), Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid.
    """
    x = _off_centre(p.x, half.x)
    y = _off_centre(p.y, half.y)
    z = _off_centre(p.z, half.z)
    a, b, c = half.x * half.x, half.y * half.y, half.z * half.z
    t = max(half.x * abs(x) - a, half.y * abs(y) - b, half.z * abs(z) - c)
    for _ in range(_NEWTON_STEPS):
        u, v, w = half.x * x / (t + a), half.y * y / (t + b), half.z * z / (t + c)
        excess = u * u + v * v + w * w - 1.0
        slope = 2.0 * (u * u / (t + a) + v * v / (t + b) + w * w / (t + c))
        step = excess / slope
        t += step
        if abs(step) <= _NEWTON_END * (abs(t) + a + b + c):
            break
    q = Vec3(a * x / (t + a), b * y / (t + b), c * z / (t + c))
    across = Vec3(q.x / a, q.y / b, q.z / c)
    normal = scale(1.0 / norm(across), across)
    return Distance(dot(sub(p, q), normal), normal)


@kernel
def _off_centre(x: float, half: float) -> float:
    least = _OFF_CENTRE * half
    return max(x, least) if x >= 0.0 else min(x, -least)


@kernel
def _to_planes(p: Vec3, plane: FloatArray, first: int, end: int) -> Distance:
    farthest, best = -math.inf, first
    for k in range(first, end):
        distance = plane[k, 0] * p.x + plane[k, 1] * p.y + plane[k, 2] * p.z + plane[k, 3]
        if distance > farthest:
            farthest, best = distance, k
    return Distance(farthest, Vec3(plane[best, 0], plane[best, 1], plane[best, 2]))


@kernel
def is_flat_at(a: Distance, b: Distance, c: Distance) -> bool:
    """Whether a geom is flat from corner to corner of a triangle."""
    return bool(
        dot(a.normal, b.normal) > _SAME_DIRECTION and dot(a.normal, c.normal) > _SAME_DIRECTION
    )


@kernel
def deepest_point(geoms: Geoms, g: int, a: Vec3, b: Vec3, c: Vec3) -> Deepest:
    """Return the point of triangle abc that is deepest in geom `g`, or nearest to it.

    Lines are parallel to ab, at a share `u` of the distance from c.

    Args:
        geoms: Where they were placed last.
        g: The geom.
        a: First corner [m].
        b: Second corner [m].
        c: Third corner [m].
    """
    low, high = 0.0, 1.0
    u1, u2 = high - _GOLDEN, _GOLDEN
    t1, d1 = _deepest_on_line(geoms, g, lerp(u1, c, a), lerp(u1, c, b))
    t2, d2 = _deepest_on_line(geoms, g, lerp(u2, c, a), lerp(u2, c, b))
    for _ in range(_SECTIONS):
        if d1 <= d2:
            high, u2, t2, d2 = u2, u1, t1, d1
            u1 = high - _GOLDEN * (high - low)
            t1, d1 = _deepest_on_line(geoms, g, lerp(u1, c, a), lerp(u1, c, b))
        else:
            low, u1, t1, d1 = u1, u2, t2, d2
            u2 = low + _GOLDEN * (high - low)
            t2, d2 = _deepest_on_line(geoms, g, lerp(u2, c, a), lerp(u2, c, b))
    u, t = (u1, t1) if d1 <= d2 else (u2, t2)
    weights = Vec3(u * (1.0 - t), u * t, 1.0 - u)
    x = add(add(scale(weights.x, a), scale(weights.y, b)), scale(weights.z, c))
    found = distance_to(geoms, g, x)
    return Deepest(weights, found.distance, found.normal)


@kernel
def _deepest_on_line(geoms: Geoms, g: int, p: Vec3, q: Vec3) -> tuple[float, float]:
    """Return the share of the line from p to q where the distance is least, and that [m]."""
    low, high = 0.0, 1.0
    t1, t2 = high - _GOLDEN, _GOLDEN
    d1 = distance_to(geoms, g, lerp(t1, p, q)).distance
    d2 = distance_to(geoms, g, lerp(t2, p, q)).distance
    for _ in range(_SECTIONS):
        if d1 <= d2:
            high, t2, d2 = t2, t1, d1
            t1 = high - _GOLDEN * (high - low)
            d1 = distance_to(geoms, g, lerp(t1, p, q)).distance
        else:
            low, t1, d1 = t1, t2, d2
            t2 = low + _GOLDEN * (high - low)
            d2 = distance_to(geoms, g, lerp(t2, p, q)).distance
    return (t1, d1) if d1 <= d2 else (t2, d2)
