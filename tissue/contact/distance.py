"""Distances of a node from a triangle, and of an edge from an edge.

Source: Ericson (2005), Real-Time Collision Detection, sections 5.1.5 and 5.1.9.
"""

import math

from tissue.contact.edge_edge import Edges
from tissue.contact.point_triangle import Corners
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, sub


@kernel
def distance_to_triangle(at: Corners) -> float:
    """Return the distance of p from the triangle abc [m]."""
    ab, ac, ap = sub(at.b, at.a), sub(at.c, at.a), sub(at.p, at.a)
    area = cross(ab, ac)
    square = dot(area, area)
    v = dot(cross(ap, ac), area)
    w = dot(cross(ab, ap), area)
    if v >= 0.0 and w >= 0.0 and v + w <= square and square > 0.0:
        return abs(dot(area, ap)) / math.sqrt(square)
    bc, bp = sub(at.c, at.b), sub(at.p, at.b)
    nearest = min(_to_segment(ap, ab), _to_segment(ap, ac))
    return math.sqrt(min(nearest, _to_segment(bp, bc)))


@inlined
def _to_segment(from_a: Vec3, along: Vec3) -> float:
    """Return the squared distance of a point from a segment [m2], both given from its start."""
    length = dot(along, along)
    at = dot(from_a, along)
    if at <= 0.0 or length == 0.0:
        return dot(from_a, from_a)
    if at >= length:
        rest = sub(from_a, along)
        return dot(rest, rest)
    rest = axpy(-at / length, along, from_a)
    return dot(rest, rest)


@kernel
def distance_of_edges(at: Edges) -> float:
    """Return the distance of the segments ab and cd [m]."""
    u, v, r = sub(at.b, at.a), sub(at.d, at.c), sub(at.a, at.c)
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    ur, vr = dot(u, r), dot(v, r)
    square = uu * vv - uv * uv
    s = 0.0
    if square > 0.0:
        s = min(max((uv * vr - ur * vv) / square, 0.0), 1.0)
    along = uv * s + vr
    if along <= 0.0 or vv == 0.0:
        t = 0.0
        s = min(max(-ur / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    elif along >= vv:
        t = 1.0
        s = min(max((uv - ur) / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    else:
        t = along / vv
    return norm(axpy(-t, v, axpy(s, u, r)))
