"""How far a point is from a rigid geom: negative inside, and in which direction it gets out.

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
from tissue.contact.geoms.geom_arrays import Geoms
from tissue.contact.geoms.geom_motion import to_geom, turned_from_geom
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, dot, norm, scale, sub

_OFF_CENTRE: Final = 1e-9
"""How far from its axis a point of a capsule has a direction, per radius; and from a plane of
symmetry a point of an ellipsoid is taken to be, per half its size: there the nearest point of the
surface is one alone. Larger: distances near the middle are wrong by as much; 0: a division by zero
there."""

_NEWTON_STEPS: Final = 30
"""Newton steps to the nearest point of an ellipsoid at most. Far from round, 1 : 10 : 100, the most
that 10,000 random points took was 14."""

_NEWTON_END: Final = 1e-14
"""Relative change at which they end: rounding."""


class Distance(NamedTuple):
    """Where a point is with respect to a geom."""

    distance: float
    """How far it is outside; negative inside [m]."""
    normal: Vec3
    """Unit vector in which that grows fastest: out of the geom."""


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
