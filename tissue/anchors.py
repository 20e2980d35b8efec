"""Elasto-plastic edge anchors: what the blade holds, what slips, and the force that this costs.

The cutting edge is sampled at points b_k, each for a length l_k of edge. A sample in the tissue is
anchored at a material point a_k, and a spring K (b_k - a_k) pulls the two together: the tissue
dents first. Where the pull exceeds toughness times length, the anchor slips forward through the
material until it does not. What the anchors cut is what the cutter cuts, and the work done in
slipping is the toughness times the area, exactly (algorithms.md 5.3).
"""

from typing import NamedTuple

import numpy as np

from tissue.arrays import Arrays
from tissue.body import INSIDE_TOLERANCE, OUTER, TETRAHEDRA, Body, walk
from tissue.geometry import (
    Matrix3,
    Weights,
    apply,
    barycentric_in,
    determinant,
    edge_matrix,
    interpolate,
    smallest_weight,
    solve,
)
from tissue.jit import kernel
from tissue.star import Visits
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3, add, axpy, cross, dot, lerp, norm, scale, store, sub, vec3

ANCHOR_STIFFNESS = 4.0
"""Stiffness of an anchor per Young's modulus and length of edge. It stands for the tissue closer to
the edge than the mesh resolves; between 4 and 12 the cutting force does not change."""

FREE, ANCHORED, RETRACTED, LEFT = 0, 1, 2, 3
"""State of a sample: out of the tissue; pulling on it; backed off from where it cut last; just
gone out through the skin ahead, in this step."""

FLATTEST = 0.05
"""Determinant of the deformation gradient below which a tetrahedron is too squashed to say which
way is forward in the material; the current direction is taken instead."""

MOST_STRAIN = 2.0
"""Factor by which a length in the body at rest may differ from the length now. Tissue about to part
is stretched far more over an element; without the bound the path of the cut would leap there."""

IDENTITY = Matrix3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))

SEARCH = 512
"""Tetrahedra that the search beyond a cut face looks at, at most."""


class Edge(NamedTuple):
    """The cutting edge over one step."""

    tip_t0: Vec3
    heel_t0: Vec3
    forward_t0: Vec3
    tip_t1: Vec3
    heel_t1: Vec3
    forward_t1: Vec3


class Anchors(Arrays):
    """The samples of the edge, from the tip to the heel."""

    state: IntArray
    """FREE, ANCHORED, RETRACTED or LEFT, shape (n,)."""
    tetrahedron: IntArray
    """Which holds the anchor, shape (n,)."""
    rest: FloatArray
    """The anchor's material point: its position in the body at rest [m], shape (n, 3)."""
    weights: FloatArray
    """Its barycentric weights, shape (n, 4)."""
    length: FloatArray
    """Length of edge that the sample stands for [m], shape (n,)."""
    stiffness: FloatArray
    """[N/m], shape (n,)."""
    totals: FloatArray
    """What has been counted, shape (N_TOTALS,): see the places below."""


IMPULSE, IMPULSE_TORQUE, TISSUE_IMPULSE = 0, 3, 6
"""Of the tissue on the blade [N s] and [N m s] about the origin, and on the tissue; three each."""
WORK_OF_BLADE, WORK_OF_CUTTING, RELEASED = 9, 10, 11
"""[J], [J], and the energy of anchors that let go, less that of new ones [J]."""
N_TOTALS = 12


def new_anchors(n: int, edge_length: float, young_modulus: float) -> Anchors:
    """Return `n` free samples, equally spaced along an edge of that length [m]."""
    length = np.full(n, edge_length / (n - 1))
    length[[0, -1]] *= 0.5
    return Anchors(
        state=np.zeros(n, dtype=np.int64),
        tetrahedron=np.zeros(n, dtype=np.int64),
        rest=np.zeros((n, 3)),
        weights=np.zeros((n, 4)),
        length=length,
        stiffness=ANCHOR_STIFFNESS * young_modulus * length,
        totals=np.zeros(N_TOTALS),
    )


@kernel
def edge_point(edge: Edge, along: float, when: float) -> Vec3:
    """Point of the edge, at fraction `along` from tip to heel and `when` from t0 to t1."""
    tip = lerp(when, edge.tip_t0, edge.tip_t1)
    return lerp(along, tip, lerp(when, edge.heel_t0, edge.heel_t1))


@kernel
def sample_point(edge: Edge, k: int, n: int, when: float) -> Vec3:
    """Where sample `k` of `n` is [m]."""
    return edge_point(edge, k / (n - 1.0), when)


@kernel
def edge_frame(edge: Edge, when: float) -> tuple[Vec3, Vec3, Vec3]:
    """Unit vectors along the edge (tip to heel), forward across it, and normal to the flat."""
    along = sub(
        lerp(when, edge.heel_t0, edge.heel_t1), lerp(when, edge.tip_t0, edge.tip_t1)
    )
    along = scale(1.0 / norm(along), along)
    forward = lerp(when, edge.forward_t0, edge.forward_t1)
    forward = axpy(-dot(forward, along), along, forward)
    forward = scale(1.0 / norm(forward), forward)
    return along, forward, cross(forward, along)


@kernel
def anchor_position(anchors: Anchors, body: Body, positions: FloatArray, k: int) -> Vec3:
    """Where the material point of anchor `k` is now [m]."""
    w = Weights(
        anchors.weights[k, 0], anchors.weights[k, 1], anchors.weights[k, 2], anchors.weights[k, 3]
    )
    return interpolate(w, positions, body.tetrahedra, anchors.tetrahedron[k])


@kernel
def clear_forces(anchors: Anchors, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that anchors pull on to zero: the others are zero anyway."""
    for k in range(len(anchors.state)):
        for q in range(4):
            node = body.tetrahedra[anchors.tetrahedron[k], q]
            external[node, 0] = external[node, 1] = external[node, 2] = 0.0


@kernel
def pull(
    anchors: Anchors,
    body: Body,
    edge: Edge,
    positions: FloatArray,
    when: float,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Write the anchors' forces on the nodes to `external` [N] and count impulse and work.

    Args:
        anchors: The samples.
        body: For the nodes of their tetrahedra.
        edge: The cutting edge over the step.
        positions: Where the nodes are [m].
        when: Instant, as a fraction of the step.
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the step [s].
        external: Forces on the nodes; cleared first.
    """
    clear_forces(anchors, body, external)
    n = len(anchors.state)
    seconds = share * dt
    totals = anchors.totals
    for k in range(n):
        if anchors.state[k] != ANCHORED:
            continue
        b = sample_point(edge, k, n, when)
        force = scale(
            anchors.stiffness[k], sub(b, anchor_position(anchors, body, positions, k))
        )
        for q in range(4):
            node = body.tetrahedra[anchors.tetrahedron[k], q]
            w = anchors.weights[k, q]
            external[node, 0] += w * force.x
            external[node, 1] += w * force.y
            external[node, 2] += w * force.z
            totals[TISSUE_IMPULSE] += seconds * w * force.x
            totals[TISSUE_IMPULSE + 1] += seconds * w * force.y
            totals[TISSUE_IMPULSE + 2] += seconds * w * force.z
        totals[IMPULSE] -= seconds * force.x
        totals[IMPULSE + 1] -= seconds * force.y
        totals[IMPULSE + 2] -= seconds * force.z
        travel = sub(sample_point(edge, k, n, 1.0), sample_point(edge, k, n, 0.0))
        totals[WORK_OF_BLADE] += share * dot(force, travel)
        torque = cross(b, force)
        totals[IMPULSE_TORQUE] -= seconds * torque.x
        totals[IMPULSE_TORQUE + 1] -= seconds * torque.y
        totals[IMPULSE_TORQUE + 2] -= seconds * torque.z


@kernel
def frequency_with_anchors(
    anchors: Anchors, body: Body, frequency_squared: FloatArray, scratch: FloatArray
) -> float:
    """Bound on w^2 [1/s2] over the nodes that anchors pull on: springs and anchors together.

    Gershgorin again: anchor K adds K w_q (w_a + w_b + w_c + w_d) = K w_q to the row of node q.
    `scratch`, shape (capacity, 3), must be zero at those nodes and is so again afterwards.
    """
    worst = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for q in range(4):
                node = body.tetrahedra[anchors.tetrahedron[k], q]
                scratch[node, 0] += anchors.stiffness[k] * abs(anchors.weights[k, q])
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for q in range(4):
                node = body.tetrahedra[anchors.tetrahedron[k], q]
                if not body.fixed[node]:
                    own = frequency_squared[node] + scratch[node, 0] / body.masses[node]
                    worst = max(worst, own)
    clear_forces(anchors, body, scratch)
    return worst


@kernel
def to_material(body: Body, t: int, direction: Vec3) -> Vec3:
    """Map a vector from the body as it is to the body at rest, in tetrahedron `t`."""
    now = edge_matrix(body.positions, body.tetrahedra, t)
    rest = edge_matrix(body.rest, body.tetrahedra, t)
    if determinant(now) < FLATTEST * determinant(rest):
        return direction
    mapped = apply(rest, solve(now, direction))
    length = norm(mapped)
    if length == 0.0:
        return direction
    wanted = norm(direction)
    return scale(min(max(length, wanted / MOST_STRAIN), wanted * MOST_STRAIN) / length, mapped)


class Place(NamedTuple):
    """Where a material point is."""

    tetrahedron: int
    """Which holds it, or the one nearest by."""
    inside: bool
    """Whether it holds the point."""
    beyond_skin: bool
    """Where it does not: whether the skin is between them, rather than a cut."""


@kernel
def find(body: Body, visits: Visits, p: Vec3, start: int, queue: IntArray) -> Place:
    """Find the tetrahedron that holds the rest point `p` [m], searching from `start`.

    Walks through faces; where a cut face stops the walk, the tetrahedra around are searched, since
    the other lip hangs together with this one around the rim of the cut.
    """
    at = walk(body, p, start)
    if at.inside or at.link == OUTER:
        return Place(at.tetrahedron, at.inside, not at.inside)
    visits.epoch[0] += 1
    epoch = visits.epoch[0]
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
            if link >= 0 and visits.tetrahedra[link // 4] != epoch and n < SEARCH:
                visits.tetrahedra[link // 4] = epoch
                queue[n] = link // 4
                n += 1
    if closest_weight >= -INSIDE_TOLERANCE:
        return Place(closest, True, False)
    w = barycentric_in(p, body.rest, body.tetrahedra, closest)
    for f in range(4):
        if w[f] == closest_weight:
            return Place(closest, False, body.links[closest, f] == OUTER)
    return Place(closest, False, False)


@kernel
def put(anchors: Anchors, body: Body, k: int, t: int, p: Vec3) -> None:
    """Anchor sample `k` at rest point `p` [m] in tetrahedron `t`, or at the point of it nearest by."""
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
            put(anchors, body, k, find(body, visits, p, anchors.tetrahedron[k], queue).tetrahedron, p)
            anchors.state[k] = state


@kernel
def slip(
    anchors: Anchors,
    body: Body,
    visits: Visits,
    edge: Edge,
    when: float,
    toughness: float,
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
        toughness: [J/m2].
        reach: Distance at which a blade that backed off has let go of its anchor [m].
        queue: Scratch, shape (SEARCH,) or longer.
    """
    n = len(anchors.state)
    _, forward, normal = edge_frame(edge, when)
    for k in range(n):
        if anchors.state[k] != ANCHORED and anchors.state[k] != RETRACTED:
            continue
        a = anchor_position(anchors, body, body.positions, k)
        d = sub(sample_point(edge, k, n, when), a)
        ahead = dot(d, forward)
        if ahead < 0.0:
            if anchors.state[k] == ANCHORED:
                anchors.totals[RELEASED] += 0.5 * anchors.stiffness[k] * dot(d, d)
            anchors.state[k] = FREE if norm(d) > reach else RETRACTED
            continue
        if anchors.state[k] == RETRACTED:
            anchors.totals[RELEASED] -= 0.5 * anchors.stiffness[k] * dot(d, d)
            anchors.state[k] = ANCHORED
        in_plane = axpy(-dot(d, normal), normal, d)
        distance = norm(in_plane)
        if distance == 0.0:
            continue
        direction = scale(1.0 / distance, in_plane)
        across = max(dot(direction, forward), 0.0)
        surplus = distance - toughness * anchors.length[k] * across / anchors.stiffness[k]
        if surplus <= 0.0:
            continue
        _slip_by(anchors, body, visits, k, scale(surplus, direction), queue)
        energy = 0.5 * anchors.stiffness[k] * dot(d, d)
        if anchors.state[k] == LEFT:
            anchors.totals[RELEASED] += energy
            continue
        left = sub(
            sample_point(edge, k, n, when), anchor_position(anchors, body, body.positions, k)
        )
        anchors.totals[WORK_OF_CUTTING] += energy - 0.5 * anchors.stiffness[k] * dot(left, left)


@kernel
def _slip_by(
    anchors: Anchors, body: Body, visits: Visits, k: int, step: Vec3, queue: IntArray
) -> None:
    """Move anchor `k` by `step` [m], a vector in the body as it is, through the material."""
    t = anchors.tetrahedron[k]
    p = add(vec3(anchors.rest, k), to_material(body, t, step))
    place = find(body, visits, p, t, queue)
    if place.beyond_skin:
        anchors.state[k] = LEFT
        store(anchors.rest, k, p)
        anchors.tetrahedron[k] = place.tetrahedron
        return
    put(anchors, body, k, place.tetrahedron, p)


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
            d = sub(
                sample_point(edge, k, n, when), anchor_position(anchors, body, body.positions, k)
            )
            anchors.totals[RELEASED] -= 0.5 * anchors.stiffness[k] * dot(d, d)


POLAR_ITERATIONS = 8
"""Steps of the iteration for the rotation in a deformation; it doubles the digits in each."""


@kernel
def mean_rotation(anchors: Anchors, body: Body) -> Matrix3:
    """The rotation of the tissue along the edge, from the body at rest to the body as it is.

    It is that of the mean deformation gradient of the tetrahedra that the edge holds. A single one
    is dented and sheared by the blade, and says little of how the blade lies to the body.
    """
    c0 = Vec3(0.0, 0.0, 0.0)
    c1 = Vec3(0.0, 0.0, 0.0)
    c2 = Vec3(0.0, 0.0, 0.0)
    for k in range(len(anchors.state)):
        if anchors.state[k] != FREE:
            t = anchors.tetrahedron[k]
            now = edge_matrix(body.positions, body.tetrahedra, t)
            rest = edge_matrix(body.rest, body.tetrahedra, t)
            c0 = add(c0, apply(now, solve(rest, Vec3(1.0, 0.0, 0.0))))
            c1 = add(c1, apply(now, solve(rest, Vec3(0.0, 1.0, 0.0))))
            c2 = add(c2, apply(now, solve(rest, Vec3(0.0, 0.0, 1.0))))
    return rotation_of(Matrix3(c0, c1, c2))


@kernel
def rotation_of(m: Matrix3) -> Matrix3:
    """The rotation nearest to `m`, up to scale; the identity where `m` is not near any.

    Higham's iteration for the polar decomposition: R <- (R + R^-T) / 2.
    """
    size = norm(m.c0) + norm(m.c1) + norm(m.c2)
    if size == 0.0:
        return IDENTITY
    r = Matrix3(scale(3.0 / size, m.c0), scale(3.0 / size, m.c1), scale(3.0 / size, m.c2))
    for _ in range(POLAR_ITERATIONS):
        d = determinant(r)
        if d < FLATTEST:
            return IDENTITY
        half = 0.5 / d  # the columns of R^-T are cross products of those of R, over det R
        r = Matrix3(
            add(scale(0.5, r.c0), scale(half, cross(r.c1, r.c2))),
            add(scale(0.5, r.c1), scale(half, cross(r.c2, r.c0))),
            add(scale(0.5, r.c2), scale(half, cross(r.c0, r.c1))),
        )
    return r


@kernel
def turned_back(rotation: Matrix3, v: Vec3) -> Vec3:
    """Return R^T v."""
    return Vec3(dot(rotation.c0, v), dot(rotation.c1, v), dot(rotation.c2, v))


@kernel
def offset_from(
    edge: Edge, rotation: Matrix3, when: float, n: int, k: int, beside: int
) -> Vec3:
    """The way from sample `beside` to sample `k` of `n` [m], in the body at rest."""
    offset = sub(sample_point(edge, k, n, when), sample_point(edge, beside, n, when))
    return turned_back(rotation, offset)


@kernel
def meet(
    anchors: Anchors, body: Body, edge: Edge, when: float
) -> None:
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


@kernel
def anchored_length(anchors: Anchors) -> float:
    """Length of edge that pulls on the tissue [m]."""
    length = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            length += anchors.length[k]
    return length


def is_engaged(anchors: Anchors) -> bool:
    """Whether any sample is in the tissue, pulling or backed off."""
    return bool((anchors.state != FREE).any())
