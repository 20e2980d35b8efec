"""The point of a triangle that is deepest in a rigid geom.

The distance from a convex geom is a convex function of the point, and so is the least one on a line
as the line is moved: a golden-section search for the line, and one on each line that it asks for,
end at the one deepest point. Walking downhill would not: the distance from a box has ridges, along
which no steepest direction leads. Source: Kiefer (1953), Sequential minimax search for a maximum.
"""

from typing import Final, NamedTuple

from tissue.contact.geoms.geom_arrays import Geoms
from tissue.contact.geoms.signed_distance import Distance, distance_to
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, dot, lerp, scale

_GOLDEN: Final = 0.6180339887498949
"""Share that a section leaves of an interval."""

_SECTIONS: Final = 11
"""Sections of an interval: 0.5 % of an edge is left, which is what the deepest point may be beside
the true one. More: time; fewer: contacts of faces wander."""

_SAME_DIRECTION: Final = 1.0 - 1e-12
"""Cosine between the normals at the three corners above which they are one: the geom is flat
there, and no point of the triangle is deeper than the deepest corner."""


class Deepest(NamedTuple):
    """The deepest point of a triangle."""

    weights: Vec3
    """Barycentric weights of the corners."""
    distance: float
    """How far outside it is; negative inside [m]."""
    normal: Vec3
    """Unit vector out of the geom there."""


@kernel
def is_flat_at(a: Distance, b: Distance, c: Distance) -> bool:
    """Whether a geom is flat from corner to corner of a triangle."""
    return bool(
        dot(a.normal, b.normal) > _SAME_DIRECTION and dot(a.normal, c.normal) > _SAME_DIRECTION
    )


@kernel
def deepest_point(geoms: Geoms, g: int, a: Vec3, b: Vec3, c: Vec3) -> Deepest:
    """Return the point of triangle abc that is deepest in geom `g`, or nearest to it.

    Lines are parallel to ab, at a share `u` of the way from c.

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
    """Return at which share of the way from p to q the distance is least, and that distance [m]."""
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
