"""How samples of the edge come to hold the tissue: by meeting it, or beside one that does."""

import numpy as np

from tissue.anchors import ANCHORED, FREE, RELEASED, Anchors, Edge, anchor_position, sample_point
from tissue.body import TETRAHEDRA, Body
from tissue.geometry import (
    Matrix3,
    barycentric_in,
    interpolate,
    smallest_weight,
)
from tissue.jit import kernel
from tissue.rotation import mean_rotation, turned_back
from tissue.slipping import find, put
from tissue.star import Visits
from tissue.types import IntArray
from tissue.vec3 import Vec3, add, dot, sub, vec3


@kernel
def offset_from(edge: Edge, rotation: Matrix3, when: float, n: int, k: int, beside: int) -> Vec3:
    """The way from sample `beside` to sample `k` of `n` [m], in the body at rest."""
    offset = sub(sample_point(edge, k, n, when), sample_point(edge, beside, n, when))
    return turned_back(rotation, offset)


@kernel
def seize(
    anchors: Anchors, body: Body, visits: Visits, edge: Edge, when: float, queue: IntArray
) -> None:
    """Anchor the free samples beside an anchored one that are in the tissue too.

    The edge trails behind the blade by the same distance along its length: a sample is in the
    tissue if the point that far behind it is.
    """
    n = len(anchors.state)
    rotation = mean_rotation(anchors, body)
    for sweep in range(2):
        for i in range(n):
            k = i if sweep == 0 else n - 1 - i
            beside = k - 1 if sweep == 0 else k + 1
            if anchors.state[k] != FREE or not 0 <= beside < n:
                continue
            if anchors.state[beside] != ANCHORED:
                continue
            offset = offset_from(edge, rotation, when, n, k, beside)
            p = add(vec3(anchors.rest, beside), offset)
            place = find(body, visits, p, anchors.tetrahedron[beside], queue)
            if not place.inside:
                continue
            put(anchors, body, k, place.tetrahedron, p)
            anchors.slipped[k] = False
            d = sub(
                sample_point(edge, k, n, when), anchor_position(anchors, body, body.positions, k)
            )
            anchors.totals[RELEASED] -= 0.5 * anchors.stiffness[k] * dot(d, d)


@kernel
def meet(anchors: Anchors, body: Body, edge: Edge, when: float) -> None:
    """Anchor the free samples that have come into the tissue by themselves."""
    n = len(anchors.state)
    low = Vec3(np.inf, np.inf, np.inf)
    high = Vec3(-np.inf, -np.inf, -np.inf)
    n_free = 0
    for k in range(n):
        if anchors.state[k] == FREE:
            b = sample_point(edge, k, n, when)
            low = Vec3(min(low.x, b.x), min(low.y, b.y), min(low.z, b.z))
            high = Vec3(max(high.x, b.x), max(high.y, b.y), max(high.z, b.z))
            n_free += 1
    if n_free == 0:
        return
    x = body.positions
    for t in range(body.counts[TETRAHEDRA]):
        a = body.tetrahedra[t, 0]
        b = body.tetrahedra[t, 1]
        c = body.tetrahedra[t, 2]
        d = body.tetrahedra[t, 3]
        if min(min(x[a, 0], x[b, 0]), min(x[c, 0], x[d, 0])) > high.x:
            continue
        if max(max(x[a, 0], x[b, 0]), max(x[c, 0], x[d, 0])) < low.x:
            continue
        if min(min(x[a, 1], x[b, 1]), min(x[c, 1], x[d, 1])) > high.y:
            continue
        if max(max(x[a, 1], x[b, 1]), max(x[c, 1], x[d, 1])) < low.y:
            continue
        if min(min(x[a, 2], x[b, 2]), min(x[c, 2], x[d, 2])) > high.z:
            continue
        if max(max(x[a, 2], x[b, 2]), max(x[c, 2], x[d, 2])) < low.z:
            continue
        for k in range(n):
            if anchors.state[k] == FREE:
                w = barycentric_in(sample_point(edge, k, n, when), x, body.tetrahedra, t)
                if smallest_weight(w) >= 0.0:
                    p = interpolate(w, body.rest, body.tetrahedra, t)
                    put(anchors, body, k, t, p)
                    anchors.slipped[k] = False
