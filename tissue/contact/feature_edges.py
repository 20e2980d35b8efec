"""Which edges of the boundary are ridges.

Of two bodies that come to touch, first a node meets a face, or a ridge a ridge: an edge that is
flat, or in a valley, meets nothing before the faces beside it do. Lips of one cut lie on each
other, flat on flat and ridge in valley; so nearly all of their pairs of edges need no look.

An edge is judged by the body at rest. Where lips bend by a few degrees from face to face, edges
that count as flat may overlap by the height of that bend.
"""

import math

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import axpy, cross, dot, norm, sub, vec3
from tissue.mesh.body import Body, is_open

_FLAT = 0.05
"""Sine of the angle up to which an edge counts as flat. Two such, crossed at their middles, overlap
by a hundredth of their length before their ends meet faces."""

LONGEST_FAN = 64
"""Tetrahedra around an edge that are looked at, at most."""


@kernel
def across(body: Body, t: int, f: int, k: int, outward: IntArray) -> tuple[int, int]:
    """Find the boundary face beyond edge `k` of boundary face `f` of tetrahedron `t`.

    Return it, as 4 * tetrahedron + face, and its third node; -1 twice where tetrahedra that hang
    together with smaller ones are in between. `outward` is `surface.OUTWARD`.
    """
    turn = outward[f, (k + 2) % 3]
    tip = body.tetrahedra[t, f]
    for _ in range(LONGEST_FAN):
        link = body.links[t, turn]
        if is_open(link):
            return 4 * t + turn, tip
        if link < 0:
            return -1, -1
        t = link // 4
        for q in range(4):
            if body.tetrahedra[t, q] == tip:
                turn = q
        tip = body.tetrahedra[t, link % 4]
    return -1, -1


@kernel
def is_ridge(body: Body, t: int, f: int, k: int, outward: IntArray) -> bool:
    """Whether edge `k` of boundary face `f` of tetrahedron `t` is a ridge, or may be one."""
    tip = across(body, t, f, k, outward)[1]
    if tip < 0:
        return True
    x, nodes = body.rest, body.tetrahedra
    a = vec3(x, nodes[t, outward[f, k]])
    ab = sub(vec3(x, nodes[t, outward[f, (k + 1) % 3]]), a)
    ac = sub(vec3(x, nodes[t, outward[f, (k + 2) % 3]]), a)
    ad = sub(vec3(x, tip), a)
    square = dot(ab, ab)
    here = axpy(-dot(ac, ab) / square, ab, ac)
    there = axpy(-dot(ad, ab) / square, ab, ad)
    area = cross(ab, ac)
    flat = _FLAT * math.sqrt(dot(there, there))
    height = dot(area, there) / norm(area)
    return height < (flat if dot(here, there) > 0.0 else -flat)
