"""How anchors slip through the material, and how their tetrahedra are found (return mapping)."""

from typing import NamedTuple

import numpy as np

from tissue.blade.anchors import (
    ANCHORED,
    FREE,
    LEFT,
    RETRACTED,
    Anchors,
    Edge,
    anchor_position,
    edge_frame,
    held_toughness,
    sample_point,
    stored_energy,
    surplus_of,
)
from tissue.blade.impulse_totals import (
    RELEASED,
    WORK_OF_BREAKING,
    WORK_OF_CUTTING,
)
from tissue.blade.material_frame import to_material
from tissue.blade.toughness import Resistance
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, store, sub, vec3
from tissue.geometry.tetrahedron import (
    Weights,
    barycentric_in,
    interpolate,
    smallest_weight,
)
from tissue.mesh.body import INSIDE_TOLERANCE, OUTER, Body, walk
from tissue.mesh.nonconforming import behind, is_open, n_behind
from tissue.mesh.star import Visits

SEARCH = 512
"""Tetrahedra that the search beyond a cut face looks at, at most."""


class Place(NamedTuple):
    """Where a material point is."""

    tetrahedron: int
    """Which holds it, or the one nearest by."""
    inside: bool
    """Whether it holds the point."""
    beyond_skin: bool
    """Where it does not: whether the skin is between them, or the lip of an earlier cut."""


@kernel
def find(body: Body, visits: Visits, p: Vec3, start: int, queue: IntArray) -> Place:
    """Find the tetrahedron that holds the rest point `p` [m], searching from `start`.

    Walks through faces; where a cut face stops the walk, the tetrahedra around are searched, since
    the other lip hangs together with this one around the rim of the cut.
    """
    at = walk(body, p, start)
    if at.inside or at.link == OUTER:
        return Place(at.tetrahedron, at.inside, not at.inside)
    visits.epoch += 1
    epoch = visits.epoch
    queue[0] = at.tetrahedron
    visits.tetrahedra[at.tetrahedron] = epoch
    n = 1
    i = 0
    closest = at.tetrahedron
    closest_weight = -np.inf
    while i < n:
        t = queue[i]
        i += 1
        weight = smallest_weight(barycentric_in(p, body.rest, body.tetrahedra, t))
        if weight > closest_weight:
            closest_weight = weight
            closest = t
        for f in range(4):
            link = body.links[t, f]
            for k in range(n_behind(body.hanging, t, link)):
                other = behind(body.hanging, t, link, k)
                if visits.tetrahedra[other] != epoch and n < SEARCH:
                    visits.tetrahedra[other] = epoch
                    queue[n] = other
                    n += 1
    if closest_weight >= -INSIDE_TOLERANCE:
        return Place(closest, True, False)
    w = barycentric_in(p, body.rest, body.tetrahedra, closest)
    for f in range(4):
        if w[f] == closest_weight:
            return Place(closest, False, is_open(body.links[closest, f]))
    return Place(closest, False, False)


@kernel
def put(anchors: Anchors, body: Body, k: int, t: int, p: Vec3) -> None:
    """Anchor sample `k` at rest point `p` [m] in tetrahedron `t`, or at a point of it nearby."""
    w = barycentric_in(p, body.rest, body.tetrahedra, t)
    total = max(w.a, 0.0) + max(w.b, 0.0) + max(w.c, 0.0) + max(w.d, 0.0)
    w = Weights(
        max(w.a, 0.0) / total, max(w.b, 0.0) / total, max(w.c, 0.0) / total, max(w.d, 0.0) / total
    )
    anchors.tetrahedron[k] = t
    anchors.weights[k, 0] = w.a
    anchors.weights[k, 1] = w.b
    anchors.weights[k, 2] = w.c
    anchors.weights[k, 3] = w.d
    store(anchors.rest, k, interpolate(w, body.rest, body.tetrahedra, t))
    anchors.state[k] = ANCHORED


@kernel
def relocate(anchors: Anchors, body: Body, visits: Visits, queue: IntArray) -> None:
    """Find the anchors' tetrahedra again after the mesh changed. Material points do not move."""
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED or anchors.state[k] == RETRACTED:
            state = anchors.state[k]
            p = vec3(anchors.rest, k)
            put(
                anchors,
                body,
                k,
                find(body, visits, p, anchors.tetrahedron[k], queue).tetrahedron,
                p,
            )
            anchors.state[k] = state


@kernel
def slip(
    anchors: Anchors,
    body: Body,
    visits: Visits,
    edge: Edge,
    when: float,
    resistance: Resistance,
    reach: float,
    queue: IntArray,
) -> None:
    """Let every anchor slip whose pull exceeds toughness times length (return mapping).

    Args:
        anchors: The samples.
        body: The tissue.
        visits: For searches.
        edge: The cutting edge over the step.
        when: Instant, as a fraction of the step.
        resistance: Of the tissue.
        reach: How far beside its anchor a blade that backed off still belongs to it [m].
        queue: Scratch, shape (SEARCH,) or longer.
    """
    n = len(anchors.state)
    frame = edge_frame(edge, when)
    along, forward, flat = frame
    for k in range(n):
        if anchors.state[k] != ANCHORED and anchors.state[k] != RETRACTED:
            continue
        d = sub(sample_point(edge, k, n, when), anchor_position(anchors, body, body.positions, k))
        if dot(d, forward) < 0.0:
            if anchors.state[k] == ANCHORED:
                anchors.totals[RELEASED] += 0.5 * anchors.stiffness[k] * dot(d, d)
            anchors.state[k] = FREE if abs(dot(d, flat)) > reach else RETRACTED
            continue
        if anchors.state[k] == RETRACTED:
            if abs(dot(d, along)) > reach:  # it comes back elsewhere
                anchors.state[k] = FREE
                continue
            anchors.totals[RELEASED] -= stored_energy(anchors, k, d, frame, resistance)
            anchors.state[k] = ANCHORED
        _slip_anchor(anchors, body, visits, k, d, frame, resistance, queue)


@kernel
def _slip_anchor(
    anchors: Anchors,
    body: Body,
    visits: Visits,
    k: int,
    d: Vec3,
    frame: tuple[Vec3, Vec3, Vec3],
    resistance: Resistance,
    queue: IntArray,
) -> None:
    """Let anchor `k` slip along its pull `d` [m], as far as it does not hold; count the work."""
    _, forward, flat = frame
    in_plane = axpy(-dot(d, flat), flat, d)
    stretch = norm(in_plane)
    if stretch == 0.0:
        return
    across = anchors.length[k] * dot(in_plane, forward) / stretch
    surplus = norm(surplus_of(anchors, k, d, frame, resistance))
    anchors.slips[k] = surplus > 0.0
    if surplus == 0.0:
        return
    before = stored_energy(anchors, k, d, frame, resistance)
    spent = held_toughness(anchors, k, resistance) * across * surplus
    anchors.at_skin[k] = False  # what is broken holds no more than the rest of the tissue
    way = norm(surplus_of(anchors, k, d, frame, resistance))
    a = anchor_position(anchors, body, body.positions, k)
    _slip_by(anchors, body, visits, k, scale(way / stretch, in_plane), queue)
    if anchors.state[k] == LEFT:
        anchors.cut[k] += surplus * across
        anchors.totals[WORK_OF_CUTTING] += spent
        anchors.totals[RELEASED] += before - spent
        return
    # Where the tissue is very distorted an anchor slips less far than it was told to.
    slipped = sub(anchor_position(anchors, body, body.positions, k), a)
    area = across * dot(slipped, in_plane) / stretch
    cost = held_toughness(anchors, k, resistance) * area
    anchors.cut[k] += area
    left = stored_energy(anchors, k, sub(d, slipped), frame, resistance)
    anchors.totals[WORK_OF_CUTTING] += cost
    anchors.totals[WORK_OF_BREAKING] += before - left - cost


@kernel
def _slip_by(
    anchors: Anchors, body: Body, visits: Visits, k: int, step: Vec3, queue: IntArray
) -> None:
    """Move anchor `k` by `step` [m], a vector in the body as it is, through the material."""
    anchors.slipped[k] = True
    t = anchors.tetrahedron[k]
    p = add(vec3(anchors.rest, k), to_material(body, t, step))
    place = find(body, visits, p, t, queue)
    if place.beyond_skin:
        anchors.state[k] = LEFT
        store(anchors.rest, k, p)
        anchors.tetrahedron[k] = place.tetrahedron
        return
    put(anchors, body, k, place.tetrahedron, p)
