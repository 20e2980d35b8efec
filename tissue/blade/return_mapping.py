"""Plastic slip of the anchors: where the pull exceeds the toughness (return mapping).

Toughness is an energy per area at rest (Rivlin and Thomas 1953, J. Polym. Sci. 10:291). Tissue
ahead of an edge is squeezed, so that more of it is cut than is swept: `update_rest_share`.
"""

from typing import NamedTuple

import numpy as np

from tissue.blade.blade_state import SEARCH, BladeState, count_cutting
from tissue.blade.coarse_hold import (
    begin_coarse_hold,
    fade_coarse_hold,
    move_coarse_hold,
    store_weights,
)
from tissue.blade.core_wall import hold_at_core
from tissue.blade.edge import BladePose, Edge, pose_at, sample_point
from tissue.blade.edge_anchors import (
    ANCHORED,
    FREE,
    LEFT,
    RETRACTED,
    Anchors,
    anchor_position,
    begin_account,
    energy_given,
    energy_of_spring,
    held_toughness,
    pulling_point,
    stored_energy,
    surplus_stretch,
)
from tissue.blade.material_frame import MOST_STRAIN, displacement_at_rest
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.tetrahedron import (
    Weights,
    barycentric_in,
    clipped,
    interpolate,
    smallest_weight,
)
from tissue.mesh.body import (
    INSIDE_TOLERANCE,
    OUTER,
    Body,
    behind,
    is_open,
    local_index,
    n_behind,
    walk,
)
from tissue.mesh.star import Visits

MOST_STORED = 1.1
"""Energy of an anchor after a slip over that before, at most. In sheared tissue a lip drags it
aside as it slips, which stores some percent; without the limit jumps across gaps stored up to 1 mJ
each, a sixth of the work of the stroke."""

AVERAGED_OVER = 2.0
"""Distance over which the share is averaged, per `BladeState.reach`: strain jumps from tetrahedron
to tetrahedron. Over four or five node sizes muscle pays for 92 % of the section of its specimen,
over two for 96 %; the ripple at 160 J/m2 and 30 kPa is then 2 and 3 %."""

LARGEST_SHARE = MOST_STRAIN**2
"""Area at rest over area as it is, and the reverse, at most: an anchor slips at rest as if no
tetrahedron were strained by more than `MOST_STRAIN`."""


class Location(NamedTuple):
    """Where a material point is."""

    tetrahedron: int
    """Tetrahedron that holds the point, or else the nearest one found."""
    inside: bool
    """Whether the tetrahedron holds the point."""
    beyond_skin: bool
    """Whether the point is outside the body or across an earlier cut from the tetrahedron."""


@kernel
def locate(body: Body, visits: Visits, p: Vec3, start: int, queue: IntArray) -> Location:
    """Find the tetrahedron that holds a point of the body at rest.

    The search walks through faces. Where a cut face stops it, the tetrahedra around are searched,
    since the other lip is connected to this one around the rim of the cut.

    Args:
        body: The tissue.
        visits: For searches.
        p: The point [m].
        start: Tetrahedron to begin with.
        queue: Scratch, shape (SEARCH,) or longer.
    """
    at = walk(body, p, start)
    if at.inside or at.link == OUTER:
        return Location(at.tetrahedron, at.inside, not at.inside)
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
            for k in range(n_behind(body, t, link)):
                other = behind(body, t, link, k)
                if visits.tetrahedra[other] != epoch and n < SEARCH:
                    visits.tetrahedra[other] = epoch
                    queue[n] = other
                    n += 1
    if closest_weight >= -INSIDE_TOLERANCE:
        return Location(closest, True, False)
    w = barycentric_in(p, body.rest, body.tetrahedra, closest)
    for f in range(4):
        if w[f] == closest_weight:
            return Location(closest, False, is_open(body.links[closest, f]))
    return Location(closest, False, False)


@kernel
def set_anchor(anchors: Anchors, body: Body, k: int, t: int, p: Vec3) -> None:
    """Anchor a sample at a point of the body at rest.

    Args:
        anchors: The samples.
        body: The tissue.
        k: The sample.
        t: Tetrahedron that holds the point, or is near it.
        p: The point [m]; outside the tetrahedron, a point of the tetrahedron nearby is taken.
    """
    _hold(anchors, body, k, t, barycentric_in(p, body.rest, body.tetrahedra, t))


@kernel
def _hold(anchors: Anchors, body: Body, k: int, t: int, weights: Weights) -> None:
    """Anchor sample `k` at the point of these weights in tetrahedron `t`, or one nearby in it."""
    w = clipped(weights)
    anchors.tetrahedron[k] = t
    for q in range(4):
        anchors.nodes[k, q] = body.tetrahedra[t, q]
    store_weights(anchors.weights, k, w)
    p = interpolate(w, body.rest, body.tetrahedra, t)
    store(anchors.rest, k, p)
    move_coarse_hold(anchors.coarse, body, k, p)
    anchors.state[k] = ANCHORED


@kernel
def relocate(blade: BladeState, body: Body, visits: Visits, edge: Edge, when: float) -> None:
    """Find the anchors' tetrahedra again after the mesh changed. Material points do not move.

    Args:
        blade: The anchors are written.
        body: The tissue.
        visits: For searches.
        edge: The cutting edge over the time step.
        when: Instant of the change, as a fraction of the time step.
    """
    anchors, pose = blade.anchors, pose_at(edge, when)
    n = len(anchors.state)
    for k in range(n):
        if anchors.state[k] == ANCHORED or anchors.state[k] == RETRACTED:
            state = anchors.state[k]
            p = vec3(anchors.rest, k)
            location = locate(body, visits, p, anchors.tetrahedron[k], blade.queue)
            if not _has_nodes(body, location.tetrahedron, anchors.nodes, k):
                begin_coarse_hold(anchors.coarse, k, anchors.nodes, anchors.weights)
            set_anchor(anchors, body, k, location.tetrahedron, p)
            anchors.state[k] = state
            if state == ANCHORED:  # what the change of the mesh did to its energy is no work
                a = anchor_position(anchors, body, body.positions, k)
                stretch = sub(pulling_point(anchors, pose, k), a)
                begin_account(anchors, k, stretch, pose)


@kernel
def _has_nodes(body: Body, t: int, nodes: IntArray, k: int) -> bool:
    """Return whether the nodes of tetrahedron `t` are those of row `k`."""
    n = 0
    for q in range(4):
        n += local_index(body, t, nodes[k, q]) >= 0
    return n == 4


@kernel
def slip_anchors(
    blade: BladeState, body: Body, visits: Visits, pose: BladePose, seconds: float
) -> None:
    """Slip every anchor whose pull exceeds toughness times length (return mapping).

    An anchor from which the blade backs off is retracted, and lets it move aside; when the blade
    comes back, the anchor pulls again.

    Args:
        blade: Anchors and totals are written.
        body: The tissue.
        visits: For searches.
        pose: Pose of the blade.
        seconds: Time since the last call [s].
    """
    anchors, totals, law = blade.anchors, blade.totals, blade.toughness
    n = len(anchors.state)
    for k in range(n):
        if anchors.state[k] != ANCHORED and anchors.state[k] != RETRACTED:
            continue
        a = anchor_position(anchors, body, body.positions, k)
        stretch = sub(pulling_point(anchors, pose, k), a)
        if dot(stretch, pose.forward) < 0.0:
            if anchors.pulls[k]:
                totals.released += energy_given(anchors, k, stretch, pose, law, seconds)
            _end_slip(blade, body, k, pose)
            is_far = abs(anchors.offset[k]) > blade.reach
            anchors.state[k] = FREE if is_far else RETRACTED
            continue
        if anchors.state[k] == RETRACTED:
            if abs(dot(stretch, pose.along)) > blade.reach:  # the blade came back elsewhere
                anchors.state[k] = FREE
                continue
            anchors.state[k] = ANCHORED
        if not anchors.pulls[k]:
            totals.released += energy_given(anchors, k, stretch, pose, law, seconds)
            totals.released -= stored_energy(anchors, k, stretch, pose, law)
        if body.n_rigid > 0:
            hold_at_core(blade, body, k, stretch, pose)
        _slip_anchor(blade, body, visits, k, a, stretch, pose)
        if not anchors.slips[k]:
            begin_account(anchors, k, stretch, pose)
        elif anchors.state[k] == ANCHORED:
            _end_slip(blade, body, k, pose)


@kernel
def _end_slip(blade: BladeState, body: Body, k: int, pose: BladePose) -> None:
    """Begin the account of an anchor again; one behind the edge lets that move aside."""
    anchors = blade.anchors
    a = anchor_position(anchors, body, body.positions, k)
    stretch = sub(pulling_point(anchors, pose, k), a)
    if dot(stretch, pose.forward) < 0.0:
        aside = dot(stretch, pose.normal)
        anchors.offset[k] += aside
        stretch = axpy(-aside, pose.normal, stretch)
    begin_account(anchors, k, stretch, pose)


@kernel
def _slip_anchor(
    blade: BladeState, body: Body, visits: Visits, k: int, a: Vec3, stretch: Vec3, pose: BladePose
) -> None:
    """Slip an anchor back to the yield limit; count the work.

    Slip takes energy from the spring of the anchor. Where it would store much, the search has come
    to the other lip of a cut that gapes, and the anchor is released instead.

    Args:
        blade: Anchors and totals are written.
        body: The tissue.
        visits: For searches.
        k: The anchor.
        a: Where it is in the deformed body [m].
        stretch: Vector from there to the point of the blade that pulls on it [m].
        pose: Pose of the blade.
    """
    anchors, totals, law = blade.anchors, blade.totals, blade.toughness
    in_plane = axpy(-dot(stretch, pose.normal), pose.normal, stretch)
    distance = norm(in_plane)
    if distance == 0.0:
        return
    across = anchors.length[k] * dot(in_plane, pose.forward) / distance
    beyond = surplus_stretch(anchors, k, stretch, pose, law)
    surplus = norm(beyond)
    anchors.slips[k] = surplus > 0.0
    if surplus == 0.0:
        return
    before = energy_of_spring(anchors.stiffness[k], stretch, beyond)
    share, rest, t = anchors.rest_share[k], vec3(anchors.rest, k), anchors.tetrahedron[k]
    spent = held_toughness(anchors, k, law) * across * surplus
    slip = surplus
    if anchors.at_skin[k]:
        anchors.at_skin[k] = False  # once broken, the skin is no tougher than the rest
        slip = norm(surplus_stretch(anchors, k, stretch, pose, law))
    _move_anchor(blade, body, visits, k, scale(slip / distance, in_plane), pose)
    if anchors.state[k] == LEFT:
        anchors.cut[k] += share * surplus * across
        count_cutting(blade, body, t, spent)
        totals.released += before - spent
        return
    if anchors.coarse.share[k] > 0.0:  # as a part of the slip: the blade pays for that too
        fade_coarse_hold(anchors.coarse, k)
    # Where the tissue is very distorted an anchor slips less than was planned.
    slipped = sub(anchor_position(anchors, body, body.positions, k), a)
    left = stored_energy(anchors, k, sub(stretch, slipped), pose, law)
    if left > MOST_STORED * before:
        store(anchors.rest, k, rest)
        anchors.tetrahedron[k] = t
        anchors.state[k] = LEFT
        totals.released += before
        return
    area = across * dot(slipped, in_plane) / distance
    cost = held_toughness(anchors, k, law) * area
    anchors.cut[k] += share * area
    count_cutting(blade, body, t, cost)
    totals.work_of_breaking += before - left - cost
    displacement = sub(vec3(anchors.rest, k), rest)
    update_rest_share(anchors, k, displacement, slipped, pose, blade.reach)
    at = anchor_position(anchors, body, body.positions, k)
    stretch = sub(add(a, stretch), at)
    totals.released += left
    if dot(stretch, pose.forward) >= 0.0:
        totals.released -= stored_energy(anchors, k, stretch, pose, law)


@kernel
def _move_anchor(
    blade: BladeState, body: Body, visits: Visits, k: int, step: Vec3, pose: BladePose
) -> None:
    """Move anchor `k` through the material by `step` [m], a vector in the deformed body."""
    anchors = blade.anchors
    anchors.slipped[k] = True
    t = anchors.tetrahedron[k]
    displacement = displacement_at_rest(anchors, body, k, step, pose.normal, blade.reach)
    p = add(vec3(anchors.rest, k), displacement)
    weights = barycentric_in(p, body.rest, body.tetrahedra, t)
    if smallest_weight(weights) >= -INSIDE_TOLERANCE:  # most often it stays in its tetrahedron
        _hold(anchors, body, k, t, weights)
        return
    location = locate(body, visits, p, t, blade.queue)
    if location.beyond_skin:
        anchors.state[k] = LEFT
        store(anchors.rest, k, p)
        anchors.tetrahedron[k] = location.tetrahedron
        return
    set_anchor(anchors, body, k, location.tetrahedron, p)


@kernel
def update_rest_share(
    anchors: Anchors, k: int, displacement: Vec3, slipped: Vec3, pose: BladePose, reach: float
) -> None:
    """Move the share of area at rest towards what it was where anchor `k` slipped.

    The length of edge at rest is that between the anchors on either side: these draw the surface
    that opens, and a single tetrahedron says less of it.

    Args:
        anchors: The share is written.
        k: The anchor.
        displacement: Slip at rest [m].
        slipped: How far it slipped in the body as it is [m].
        pose: Pose of the blade.
        reach: `BladeState.reach` [m].
    """
    n = len(anchors.state)
    low, high = max(k - 1, 0), min(k + 1, n - 1)
    low = low if anchors.state[low] == ANCHORED else k
    high = high if anchors.state[high] == ANCHORED else k
    swept = norm(cross(slipped, pose.along))
    if low == high or swept == 0.0:
        return
    spacing = norm(sub(sample_point(pose, high, n), sample_point(pose, low, n)))
    beside = sub(vec3(anchors.rest, high), vec3(anchors.rest, low))
    area = scale(1.0 / (swept * spacing), cross(displacement, beside))
    size = norm(area)
    if size == 0.0:
        return
    mean = vec3(anchors.rest_area, k)
    if dot(mean, mean) == 0.0:
        mean = scale(anchors.rest_share[k] / size, area)
    # Averaged as a vector: where an anchor is dragged to and fro sideways, no more opens.
    bounded = scale(min(max(size, 1.0 / LARGEST_SHARE), LARGEST_SHARE) / size, area)
    weight = min(norm(slipped) / (AVERAGED_OVER * reach), 1.0)
    mean = axpy(weight, sub(bounded, mean), mean)
    store(anchors.rest_area, k, mean)
    anchors.rest_share[k] = max(norm(mean), 1.0 / LARGEST_SHARE)
