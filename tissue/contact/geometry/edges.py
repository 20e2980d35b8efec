"""Edges of the boundary: which are feature edges; distance and crossing of two.

Of two bodies that come to touch, first a node meets a face, or a feature edge a feature edge: an
edge that is flat, or in a valley, meets nothing before the faces at it do. Lips of one cut lie on
each other, flat on flat and edge in valley; so nearly all of their pairs of edges need no test.

An edge is judged by the body at rest. Where lips bend by a few degrees from face to face, edges
that count as flat may overlap by the height of that bend.
"""

import math
from typing import NamedTuple

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, lerp, norm, scale, sub, vec3
from tissue.mesh.body import Body, is_open
from tissue.mesh.faces import OUTWARD

_FLAT = 0.05
"""Sine of the angle up to which an edge counts as flat. Two such, crossed at their middles, overlap
by a hundredth of their length before their ends meet faces."""

_LONGEST_FAN = 64
"""Tetrahedra around an edge that are searched at most."""

_NEARLY_PARALLEL = 1e-3
"""Sine of the angle between edges below which they count as parallel and have no crossing. Their
nodes meet the triangles next to them instead."""

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

    is_feature: bool
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
def face_across(body: Body, t: int, f: int, k: int) -> tuple[int, int]:
    """Find the boundary face beyond edge `k` of boundary face `f` of tetrahedron `t`.

    Return it, as 4 * tetrahedron + face, and its third node; -1 twice where tetrahedra that share
    faces with smaller ones are in between.
    """
    next_face = OUTWARD[f, (k + 2) % 3]
    tip = body.tetrahedra[t, f]
    for _ in range(_LONGEST_FAN):
        link = body.links[t, next_face]
        if is_open(link):
            return 4 * t + next_face, tip
        if link < 0:
            return -1, -1
        t = link // 4
        for q in range(4):
            if body.tetrahedra[t, q] == tip:
                next_face = q
        tip = body.tetrahedra[t, link % 4]
    return -1, -1


@kernel
def is_feature_edge(body: Body, t: int, f: int, k: int) -> bool:
    """Whether edge `k` of boundary face `f` of tetrahedron `t` is a feature edge, or may be one."""
    tip = face_across(body, t, f, k)[1]
    if tip < 0:
        return True
    x, nodes = body.rest, body.tetrahedra
    a = vec3(x, nodes[t, OUTWARD[f, k]])
    ab = sub(vec3(x, nodes[t, OUTWARD[f, (k + 1) % 3]]), a)
    ac = sub(vec3(x, nodes[t, OUTWARD[f, (k + 2) % 3]]), a)
    ad = sub(vec3(x, tip), a)
    square = dot(ab, ab)
    here = axpy(-dot(ac, ab) / square, ab, ac)
    there = axpy(-dot(ad, ab) / square, ab, ad)
    area = cross(ab, ac)
    flat = _FLAT * math.sqrt(dot(there, there))
    height = dot(area, there) / norm(area)
    return height < (flat if dot(here, there) > 0.0 else -flat)


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
