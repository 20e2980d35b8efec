"""Geometry of two edges of the skin: their distance, and where their lines are closest."""

from typing import NamedTuple

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, lerp, norm, scale, sub

_NEARLY_PARALLEL = 1e-3
"""Sine of the angle between edges below which they count as parallel and have no crossing. Their
nodes meet the triangles beside them instead."""

EDGE_END = 1e-3
"""Share of an edge at each end that is left to the node there, which meets triangles."""

SAME_SIDE = 0.5
"""Cosine between the normals of two edges above which they cannot face each other. Contact needs
a direction within a right angle of one normal and of the other's opposite: between edges of one lip
that is one along the lip."""


class Edges(NamedTuple):
    """The ends of two edges at one instant."""

    a: Vec3
    b: Vec3
    c: Vec3
    d: Vec3


class Crossing(NamedTuple):
    """Where two lines are closest."""

    is_one: bool
    """Whether they are not parallel."""
    normal: Vec3
    """Unit vector across both."""
    gap: float
    """Distance from the second to the first along the normal [m]."""
    s: float
    """Where along the first line, as a fraction of its edge."""
    t: float
    """Where along the second line, as a fraction of its edge."""


@kernel
def crossing_of(at: Edges) -> Crossing:
    """Find where the lines ab and cd are closest."""
    u = sub(at.b, at.a)
    v = sub(at.d, at.c)
    n = cross(u, v)
    square = dot(n, n)
    if square <= _NEARLY_PARALLEL * _NEARLY_PARALLEL * dot(u, u) * dot(v, v):
        return Crossing(False, n, 0.0, 0.0, 0.0)
    w = sub(at.c, at.a)
    s = dot(cross(w, v), n) / square
    t = dot(cross(w, u), n) / square
    length = norm(n)
    return Crossing(True, scale(1.0 / length, n), -dot(w, n) / length, s, t)


@kernel
def face_the_same_side(outward: Vec3, other_outward: Vec3) -> bool:
    """Whether the normals of two edges show that they cannot face each other, see `SAME_SIDE`."""
    same = dot(outward, other_outward)
    squares = dot(outward, outward) * dot(other_outward, other_outward)
    return same > 0.0 and same * same > SAME_SIDE * SAME_SIDE * squares


@kernel
def separation(at: Edges, s: float, t: float) -> Vec3:
    """Return the vector from a point of the second edge to a point of the first [m]."""
    return sub(lerp(s, at.a, at.b), lerp(t, at.c, at.d))


@kernel
def is_inner(s: float) -> bool:
    """Whether a place along an edge is not at its ends."""
    return EDGE_END <= s <= 1.0 - EDGE_END


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
