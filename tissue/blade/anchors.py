"""Elasto-plastic edge anchors: what the blade holds, what slips, and the force that this costs.

The cutting edge is sampled at points b_k, each for a length l_k of edge. A sample in the tissue is
anchored at a material point a_k, and a spring K (b_k - a_k) pulls the two together: the tissue
dents first. Where the pull exceeds toughness times length, the anchor slips forward through the
material until it does not. What the anchors cut is what the cutter cuts, and the work done in
slipping is the toughness times the area, exactly.
"""

from typing import NamedTuple

import numpy as np

from tissue.blade.impulse_totals import keep_tally, new_totals, push_blade, push_node, tally_of
from tissue.blade.toughness import Resistance, toughness_at
from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, Vectors
from tissue.core.vec3 import Vec3, axpy, cross, dot, lerp, norm, scale, sub
from tissue.geometry.tetrahedron import (
    Weights,
    interpolate,
)
from tissue.mesh.body import Body

ANCHOR_STIFFNESS = 4.0
"""Stiffness of an anchor per Young's modulus and length of edge. It stands for the tissue closer to
the edge than the mesh resolves; between 4 and 12 the cutting force does not change."""

FREE, ANCHORED, RETRACTED, LEFT = 0, 1, 2, 3
"""State of a sample: out of the tissue; pulling on it; backed off from where it cut last; just
gone out through the skin ahead, in this step."""


class Edge(Vectors):
    """The cutting edge over one step."""

    tip_t0: Vec3
    """Tip at the start of the step [m]."""
    heel_t0: Vec3
    """Heel at the start of the step [m]."""
    forward_t0: Vec3
    """Direction in which the edge cuts at the start of the step, of any length."""
    tip_t1: Vec3
    """Tip at the end of the step [m]."""
    heel_t1: Vec3
    """Heel at the end of the step [m]."""
    forward_t1: Vec3
    """Direction in which the edge cuts at the end of the step, of any length."""


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
    slipped: BoolArray
    """Whether it has cut since it came to hold the tissue, shape (n,)."""
    at_skin: BoolArray
    """Whether it holds the skin, which the edge has yet to break; shape (n,)."""
    speed: FloatArray
    """How fast its sample of the edge goes forward in this step [m/s], shape (n,). The toughness
    that it meets is that of a crack as fast: a crack's own speed, from one short step to the next,
    would make the anchor stick and slip by turns."""
    slips: BoolArray
    """Whether it slipped when it was looked at last, shape (n,)."""
    cut: FloatArray
    """Area that it has cut in this step [m2], shape (n,)."""
    length: FloatArray
    """Length of edge that the sample stands for [m], shape (n,)."""
    stiffness: FloatArray
    """[N/m], shape (n,)."""
    totals: FloatArray
    """What was counted, of the faces of the blade too: see `tissue.blade.impulse_totals`; shape
    (N_TOTALS,)."""


def new_anchors(n: int, edge_length: float, young_modulus: float) -> Anchors:
    """Return `n` free samples, equally spaced along an edge of that length [m]."""
    length = np.full(n, edge_length / (n - 1))
    length[[0, -1]] *= 0.5
    return Anchors(
        state=np.zeros(n, dtype=np.int64),
        tetrahedron=np.zeros(n, dtype=np.int64),
        rest=np.zeros((n, 3)),
        weights=np.zeros((n, 4)),
        slipped=np.zeros(n, dtype=np.bool_),
        at_skin=np.zeros(n, dtype=np.bool_),
        speed=np.zeros(n),
        slips=np.zeros(n, dtype=np.bool_),
        cut=np.zeros(n),
        length=length,
        stiffness=ANCHOR_STIFFNESS * young_modulus * length,
        totals=new_totals(),
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
def measure_speeds(anchors: Anchors, edge: Edge, dt: float) -> None:
    """Write how fast each sample goes forward in a time step of `dt` [s]."""
    n = len(anchors.state)
    forward = edge_frame(edge, 0.5)[1]
    for k in range(n):
        way = sub(sample_point(edge, k, n, 1.0), sample_point(edge, k, n, 0.0))
        anchors.speed[k] = max(dot(way, forward), 0.0) / dt if dt > 0.0 else 0.0


@kernel
def edge_frame(edge: Edge, when: float) -> tuple[Vec3, Vec3, Vec3]:
    """Unit vectors along the edge (tip to heel), forward across it, and normal to the flat."""
    along = sub(lerp(when, edge.heel_t0, edge.heel_t1), lerp(when, edge.tip_t0, edge.tip_t1))
    along = scale(1.0 / norm(along), along)
    forward = lerp(when, edge.forward_t0, edge.forward_t1)
    forward = axpy(-dot(forward, along), along, forward)
    forward = scale(1.0 / norm(forward), forward)
    return along, forward, cross(forward, along)


class Turning(NamedTuple):
    """Where the blade is and how it stands at an instant, and at both ends of the step."""

    tip: Vec3
    now: tuple[Vec3, Vec3, Vec3]
    t0: tuple[Vec3, Vec3, Vec3]
    t1: tuple[Vec3, Vec3, Vec3]


@kernel
def turning_at(edge: Edge, when: float) -> Turning:
    """See `Turning`; the frames are those of `edge_frame`."""
    tip = lerp(when, edge.tip_t0, edge.tip_t1)
    return Turning(tip, edge_frame(edge, when), edge_frame(edge, 0.0), edge_frame(edge, 1.0))


@kernel
def travel_of(edge: Edge, turning: Turning, at: Vec3) -> Vec3:
    """How far the point of the blade that is at `at` at that instant goes in the step [m]."""
    r = sub(at, turning.tip)
    travel = sub(edge.tip_t1, edge.tip_t0)
    travel = axpy(dot(r, turning.now[0]), sub(turning.t1[0], turning.t0[0]), travel)
    travel = axpy(dot(r, turning.now[1]), sub(turning.t1[1], turning.t0[1]), travel)
    return axpy(dot(r, turning.now[2]), sub(turning.t1[2], turning.t0[2]), travel)


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
    resistance: Resistance,
    external: FloatArray,
) -> None:
    """Add the anchors' forces on the nodes to `external` [N] and count impulse and work.

    Args:
        anchors: The samples.
        body: For the nodes of their tetrahedra.
        edge: The cutting edge over the step.
        positions: Where the nodes are [m].
        when: Instant, as a fraction of the step.
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the step [s].
        resistance: No anchor pulls harder than it holds, within a Runge-Kutta step either.
        external: Forces on the nodes.
    """
    n = len(anchors.state)
    seconds = share * dt
    tally = tally_of(anchors.totals)
    turning = turning_at(edge, when)
    frame = turning.now
    for k in range(n):
        if anchors.state[k] != ANCHORED:
            continue
        b = sample_point(edge, k, n, when)
        d = sub(b, anchor_position(anchors, body, positions, k))
        if dot(d, frame[1]) < 0.0:
            continue  # backed off: an edge pushes, and does not pull
        surplus = surplus_of(anchors, k, d, frame, resistance)
        force = scale(anchors.stiffness[k], sub(d, surplus))
        for q in range(4):
            node = body.tetrahedra[anchors.tetrahedron[k], q]
            tally = push_node(external, tally, node, anchors.weights[k, q], force, seconds)
        # The surplus is about to slip and holds nothing: without it the force points along the way
        # from anchor to blade, so that the torques on the two cancel as well.
        at = sub(b, surplus)
        tally = push_blade(tally, at, force, travel_of(edge, turning, at), share, seconds)
    keep_tally(anchors.totals, tally)


@kernel
def held_toughness(anchors: Anchors, k: int, resistance: Resistance) -> float:
    """What anchor `k` holds per area before it slips [J/m2]."""
    if anchors.at_skin[k]:
        return resistance.skin_toughness
    return toughness_at(resistance, anchors.speed[k])


@kernel
def surplus_of(
    anchors: Anchors, k: int, d: Vec3, frame: tuple[Vec3, Vec3, Vec3], resistance: Resistance
) -> Vec3:
    """Return by how much the pull `d` [m] is longer than what the tissue holds.

    In the plane of the blade, along the pull; zero where it holds.
    """
    _, forward, normal = frame
    in_plane = axpy(-dot(d, normal), normal, d)
    distance = norm(in_plane)
    if distance == 0.0 or dot(d, forward) < 0.0:
        return scale(0.0, d)
    across = dot(in_plane, forward) / distance
    force = held_toughness(anchors, k, resistance) * anchors.length[k] * across
    surplus = distance - force / anchors.stiffness[k]
    return scale(max(surplus, 0.0) / distance, in_plane)


@kernel
def stored_energy(
    anchors: Anchors, k: int, d: Vec3, frame: tuple[Vec3, Vec3, Vec3], resistance: Resistance
) -> float:
    """Energy of anchor `k` [J], whose pull is `d` [m].

    Of its spring as far as the tissue holds; and of the surplus, at the force that it holds. That
    is taken when the anchor slips, and until then the tissue can give it back.
    """
    surplus = surplus_of(anchors, k, d, frame, resistance)
    held = sub(d, surplus)
    return anchors.stiffness[k] * (0.5 * dot(held, held) + dot(held, surplus))


@kernel
def add_stiffness(anchors: Anchors, body: Body, stiffness: FloatArray) -> None:
    """Add the anchors' rows to `stiffness` [N/m], shape (capacity, 3), of which x is used.

    Gershgorin's bound: anchor K adds K w_q (w_a + w_b + w_c + w_d) = K w_q to the row of node q.
    """
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for q in range(4):
                node = body.tetrahedra[anchors.tetrahedron[k], q]
                stiffness[node, 0] += anchors.stiffness[k] * abs(anchors.weights[k, q])


@kernel
def highest_frequency(
    anchors: Anchors, body: Body, frequency_squared: FloatArray, stiffness: FloatArray
) -> float:
    """Bound on w^2 [1/s2] over the nodes that anchors pull on: body and `stiffness` together."""
    worst = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for q in range(4):
                node = body.tetrahedra[anchors.tetrahedron[k], q]
                if not body.fixed[node]:
                    own = frequency_squared[node] + stiffness[node, 0] / body.masses[node]
                    worst = max(worst, own)
    return worst


@kernel
def anchored_length(anchors: Anchors) -> float:
    """Length of edge that pulls on the tissue [m]."""
    length = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            length += anchors.length[k]
    return length


@kernel
def is_engaged(anchors: Anchors) -> bool:
    """Whether any sample is in the tissue, pulling or backed off."""
    engaged = False
    for k in range(len(anchors.state)):
        engaged = engaged or anchors.state[k] != FREE
    return engaged


@kernel
def anchors_energy(
    anchors: Anchors, body: Body, edge: Edge, when: float, resistance: Resistance
) -> float:
    """Stored in what the edge holds at an instant of the time step [J]."""
    n = len(anchors.state)
    frame = edge_frame(edge, when)
    energy = 0.0
    for k in range(n):
        if anchors.state[k] == ANCHORED:
            a = anchor_position(anchors, body, body.positions, k)
            d = sub(sample_point(edge, k, n, when), a)
            if dot(d, frame[1]) >= 0.0:
                energy += stored_energy(anchors, k, d, frame, resistance)
    return energy
