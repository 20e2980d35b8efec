"""Which edges of the boundary are ridges.

Of two bodies that come to touch, first a node meets a face, or a ridge a ridge: an edge that is
flat, or in a valley, meets nothing before the faces beside it do. Lips of one cut lie on each
other, flat on flat and ridge in valley; so nearly all of their pairs of edges need no test.

An edge is judged by the body at rest. Where lips bend by a few degrees from face to face, edges
that count as flat may overlap by the height of that bend.
"""

import math

from tissue.core.jit import kernel
from tissue.core.vec3 import axpy, cross, dot, norm, sub, vec3
from tissue.mesh.body import Body, is_open
from tissue.mesh.faces import OUTWARD

_FLAT = 0.05
"""Sine of the angle up to which an edge counts as flat. Two such, crossed at their middles, overlap
by a hundredth of their length before their ends meet faces."""

_LONGEST_FAN = 64
"""Tetrahedra around an edge that are searched at most."""


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
def is_ridge(body: Body, t: int, f: int, k: int) -> bool:
    """Whether edge `k` of boundary face `f` of tetrahedron `t` is a ridge, or may be one."""
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
