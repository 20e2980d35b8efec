"""Whether two edges of the skin went through each other during a step."""

from typing import NamedTuple

from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, cross, dot, lerp, norm, scale, sub

NEARLY_PARALLEL = 1e-3
"""Sine of the angle between edges below which they have no crossing to speak of. Their nodes meet
the triangles beside them instead."""

END = 1e-3
"""Share of an edge at each end that is left to the node there, which meets triangles."""


_SAME_WAY = 0.5
"""Cosine between the normals of two edges above which they cannot face each other. Contact needs
a direction within a right angle of one normal and of the other's opposite: between edges of one lip
that is one along the lip."""


class EdgeEdge(NamedTuple):
    """Two edges that went through each other, seen at the end of the step."""

    is_through: bool
    normal: Vec3
    """Unit vector from the second to the first, as they should lie."""
    s: float
    """Where along the first edge."""
    t: float
    """Where along the second."""


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
    """From the second to the first along it [m]."""
    s: float
    t: float


@kernel
def crossing_of(at: Edges) -> Crossing:
    """Find where the lines ab and cd are closest."""
    u = sub(at.b, at.a)
    v = sub(at.d, at.c)
    n = cross(u, v)
    square = dot(n, n)
    if square <= NEARLY_PARALLEL * NEARLY_PARALLEL * dot(u, u) * dot(v, v):
        return Crossing(False, n, 0.0, 0.0, 0.0)
    w = sub(at.c, at.a)
    s = dot(cross(w, v), n) / square
    t = dot(cross(w, u), n) / square
    length = norm(n)
    return Crossing(True, scale(1.0 / length, n), -dot(w, n) / length, s, t)


@inlined
def do_overlap(at: Edges, outward: Vec3, other_outward: Vec3) -> bool:
    """Whether the lines ab and cd face each other and overlap: the first thing to look at.

    Signs alone: cross(ab, cd) leads along one edge's normal and against the other's, and along it
    the edges lie the wrong way round. No branches, for nobody could foretell them.
    """
    normal = cross(sub(at.b, at.a), sub(at.d, at.c))
    towards = dot(normal, outward)
    away = dot(normal, other_outward)
    apart = dot(normal, sub(at.a, at.c))
    return ((away > 0.0) & (towards < 0.0) & (apart < 0.0)) | (
        (away < 0.0) & (towards > 0.0) & (apart > 0.0)
    )


@kernel
def face_the_same_way(outward: Vec3, other_outward: Vec3) -> bool:
    """Whether two edges cannot face each other; see `_SAME_WAY`."""
    same = dot(outward, other_outward)
    squares = dot(outward, outward) * dot(other_outward, other_outward)
    return same > 0.0 and same * same > _SAME_WAY * _SAME_WAY * squares


@kernel
def edge_edge(
    t0: Edges, t1: Edges, outward: Vec3, other_outward: Vec3, slack: float, nothing_yet: float
) -> EdgeEdge:
    """Tell whether ab went through cd, from outside to inside, between t0 and t1.

    They did if they now overlap and did not before, at the same places and along the same normal.
    What overlapped then has always done so: two edges of one body on either side of it.

    Args:
        t0: Before the step.
        t1: After it.
        outward: Out of the body at ab; any length.
        other_outward: The same at cd.
        slack: How deep they may have been at t0 [m]: where they could not be pushed apart.
        nothing_yet: Depth that is none [m].
    """
    outside = EdgeEdge(False, outward, 0.0, 0.0)
    if not do_overlap(t1, outward, other_outward):
        return outside
    now = crossing_of(t1)
    way = 1.0 if dot(now.normal, other_outward) > 0.0 else -1.0
    if not (now.is_one and is_inner(now.s) and is_inner(now.t)):
        return outside
    depth = -way * now.gap
    if not depth > nothing_yet:
        return outside
    normal = scale(way, now.normal)
    if not dot(normal, between(t0, now.s, now.t)) >= -slack:
        return outside
    return EdgeEdge(True, normal, now.s, now.t)


@kernel
def between(at: Edges, s: float, t: float) -> Vec3:
    """Vector from a point of the second edge to one of the first [m]."""
    return sub(lerp(s, at.a, at.b), lerp(t, at.c, at.d))


@kernel
def is_inner(s: float) -> bool:
    """Whether a place along an edge is not at its ends."""
    return END <= s <= 1.0 - END
