"""Whether two edges of the skin went through each other during a step."""

from typing import NamedTuple

from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, cross, dot, lerp, norm, scale, sub

_NEARLY_PARALLEL = 1e-3
"""Sine of the angle between edges below which they count as parallel and have no crossing. Their
nodes meet the triangles beside them instead."""

EDGE_END = 1e-3
"""Share of an edge at each end that is left to the node there, which meets triangles."""

SAME_SIDE = 0.5
"""Cosine between the normals of two edges above which they cannot face each other. Contact needs
a direction within a right angle of one normal and of the other's opposite: between edges of one lip
that is one along the lip."""


class EdgeEdge(NamedTuple):
    """Two edges that went through each other, seen at the end of the step."""

    is_through: bool
    normal: Vec3
    """Unit vector from the second to the first, as they should lie."""
    s: float
    """Where along the first edge, as a fraction."""
    t: float
    """Where along the second edge, as a fraction."""


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


@inlined
def lines_overlap(at: Edges, outward: Vec3, other_outward: Vec3) -> bool:
    """Whether the lines ab and cd face each other and overlap: the cheapest test, done first.

    By signs alone: cross(ab, cd) points along one edge's normal and against the other's, and along
    it the edges lie in the wrong order. No branches, for none could be predicted.

    Args:
        at: The edges at the end of the step.
        outward: Normal out of the body at ab; any length.
        other_outward: Normal out of the body at cd; any length.
    """
    normal = cross(sub(at.b, at.a), sub(at.d, at.c))
    towards = dot(normal, outward)
    away = dot(normal, other_outward)
    apart = dot(normal, sub(at.a, at.c))
    return ((away > 0.0) & (towards < 0.0) & (apart < 0.0)) | (
        (away < 0.0) & (towards > 0.0) & (apart > 0.0)
    )


@kernel
def face_the_same_side(outward: Vec3, other_outward: Vec3) -> bool:
    """Whether the normals of two edges show that they cannot face each other, see `SAME_SIDE`."""
    same = dot(outward, other_outward)
    squares = dot(outward, outward) * dot(other_outward, other_outward)
    return same > 0.0 and same * same > SAME_SIDE * SAME_SIDE * squares


@kernel
def edge_edge(
    t0: Edges, t1: Edges, outward: Vec3, other_outward: Vec3, residual: float, tolerance: float
) -> EdgeEdge:
    """Test whether ab went through cd, from outside to inside, between t0 and t1.

    They did if they now overlap and did not before, at the same places and along the same normal.
    What overlapped then has always done so: two edges of one body on either side of it.

    Args:
        t0: Edges before the step.
        t1: Edges after the step.
        outward: Normal out of the body at ab; any length.
        other_outward: Normal out of the body at cd; any length.
        residual: How deep they may have been at t0 [m]: where they could not be pushed apart.
        tolerance: Depth that counts as none [m].
    """
    outside = EdgeEdge(False, outward, 0.0, 0.0)
    if not lines_overlap(t1, outward, other_outward):
        return outside
    now = crossing_of(t1)
    sign = 1.0 if dot(now.normal, other_outward) > 0.0 else -1.0
    if not (now.is_one and is_inner(now.s) and is_inner(now.t)):
        return outside
    depth = -sign * now.gap
    if not depth > tolerance:
        return outside
    normal = scale(sign, now.normal)
    if not dot(normal, separation(t0, now.s, now.t)) >= -residual:
        return outside
    return EdgeEdge(True, normal, now.s, now.t)


@kernel
def separation(at: Edges, s: float, t: float) -> Vec3:
    """Return the vector from a point of the second edge to a point of the first [m]."""
    return sub(lerp(s, at.a, at.b), lerp(t, at.c, at.d))


@kernel
def is_inner(s: float) -> bool:
    """Whether a place along an edge is not at its ends."""
    return EDGE_END <= s <= 1.0 - EDGE_END
