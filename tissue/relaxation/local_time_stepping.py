"""Local time stepping: small elements take substeps, their neighbours do not (heir of section 5.2).

Leap-frog with steps of H for the whole body, and p substeps for the fine nodes: those whose
frequency bound exceeds what H bears, and those in rings around the blade. It differs from the
paper's hierarchy in that both ends of a spring see each other at the same times: linear momentum is
kept to rounding, the equilibrium is that of all nodes moved together, the order is 2.

    V <- V + 2 e_p / H,   x <- x + H V                       V: velocity half a step ago

where e is found by the recursion of `chebyshev` for the fine nodes and those that share a force
with one; for the others 2 e_p = H^2 r(0).

Drag acts exactly, half before the kick and half after. Dampers between nodes that are not fine are
evaluated once a step with the velocities of half a step ago; those at a fine node, where such a
damper could be unstable, follow the kick one by one (Shardlow 2003): each takes from the relative
velocity of its two ends what it would in that time if it were alone, by equal and opposite
impulses.

Within a step the blade is where it is at its begin: the recursion stands for a motion that runs to
both sides of that instant alike, so that a steady motion of the blade cancels.
"""

import math

import numpy as np

from tissue.anchors import ANCHORED, Anchors, Edge, clear_forces, pull
from tissue.arrays import Arrays
from tissue.body import Body, grown
from tissue.jit import kernel
from tissue.relaxation.activity import AWAKE, N_LISTED, Activity, wake
from tissue.relaxation.breadth_first import (
    N_FOUND,
    UNREACHED,
    Rings,
    add_focus,
    begin_search,
    new_rings,
    ring_of,
    search,
)
from tissue.relaxation.chebyshev import Chebyshev
from tissue.springs import Springs
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3, add, axpy, dot, scale, store, sub, vec3

LEAP_FROG_LIMIT = 2.0
"""Largest stable angular frequency times step, undamped."""

OVERLAP = 1
"""Rings beyond the fine nodes that share a force with one: springs join neighbours."""


class Zone(Arrays):
    """The fine nodes and what they touch; scratch of shape (capacity, 3) each."""

    rings: Rings
    """Ring 0: fine nodes; ring 1: nodes that share a force with one."""
    fine: IntArray
    """Scratch for the list of fine nodes, shape (capacity,)."""
    start: FloatArray
    """Positions of the fine nodes at the begin of the step [m]."""
    way: FloatArray
    """e_m [m]."""
    way_before: FloatArray
    """e_{m-1} [m]."""
    steady: FloatArray
    """Share of the acceleration that is the same in all substeps [m/s2]."""
    accelerations: FloatArray
    """At the begin of the step [m/s2], of every listed node."""


def new_zone(n_nodes: int) -> Zone:
    """Return a zone without nodes, with room for that many."""
    of_nodes = ("start", "way", "way_before", "steady", "accelerations")
    return Zone(
        rings=new_rings(n_nodes),
        fine=np.zeros(n_nodes, np.int64),
        **{name: np.zeros((n_nodes, 3)) for name in of_nodes},
    )


@kernel
def macro_step(
    body: Body,
    springs: Springs,
    anchors: Anchors,
    edge: Edge,
    activity: Activity,
    zone: Zone,
    chebyshev: Chebyshev,
    external: FloatArray,
    gravity: FloatArray,
    retardation_time: float,
    viscous_damping: float,
    toughness: float,
    dt: float,
    at: float,
    share: float,
    kick: float,
) -> None:
    """Advance the listed nodes from fraction `at` of the time step by `share` of it.

    Args:
        body: Positions and velocities are written.
        springs: The rows.
        anchors: Pull in every substep; all nodes that they pull on should be fine.
        edge: The cutting edge over the whole time step of length `dt` [s].
        activity: Only awake nodes move.
        zone: Of `find_zone`.
        chebyshev: Coefficients for the substeps.
        external: Scratch for the forces of the anchors [N], shape (capacity, 3).
        gravity: [m/s2], shape (3,).
        retardation_time: Damping along springs [s].
        viscous_damping: Drag [1/s].
        toughness: [J/m2].
        dt: Length of the time step [s].
        at: Where in the time step the macro step begins.
        share: Which share of it the macro step is.
        kick: 1, or 0.5 where the velocities are those of this instant: the first step of all.
    """
    h = share * dt
    _accelerate_coarse(body, springs, activity, zone, gravity, retardation_time)
    _begin_fine(body, springs, zone, gravity, retardation_time)
    for m in range(len(chebyshev.push)):
        seconds_share = kick * share * chebyshev.weight[m]
        pull(
            anchors, body, edge, body.positions, at, seconds_share, dt, toughness, external
        )
        _substep(body, springs, activity, zone, chebyshev, external, h, m)
    clear_forces(anchors, body, external)
    _kick(body, activity, zone, viscous_damping, h, kick)
    if retardation_time > 0.0:
        _damp_fine(body, springs, activity, zone.rings, retardation_time * h)
    _drift(body, activity, zone, h)


@kernel
def _accelerate_coarse(
    body: Body,
    springs: Springs,
    activity: Activity,
    zone: Zone,
    gravity: FloatArray,
    retardation_time: float,
) -> None:
    for k in range(activity.counts[N_LISTED]):
        node = activity.listed[k]
        if body.fixed[node] or ring_of(zone.rings, node) != UNREACHED:
            continue
        f = axpy(
            retardation_time,
            _damping(springs, body, zone.rings, node),
            _elastic(springs, body.positions, node),
        )
        store(zone.accelerations, node, axpy(1.0 / body.masses[node], f, Vec3(gravity[0], gravity[1], gravity[2])))


@kernel
def _begin_fine(
    body: Body, springs: Springs, zone: Zone, gravity: FloatArray, retardation_time: float
) -> None:
    rings = zone.rings
    for k in range(rings.state[N_FOUND]):
        node = rings.order[k]
        a = Vec3(gravity[0], gravity[1], gravity[2])
        if rings.ring[node] == 0:
            store(zone.start, node, vec3(body.positions, node))
        else:
            f = _damping(springs, body, rings, node)
            a = axpy(retardation_time / body.masses[node], f, a)
        store(zone.steady, node, a)
        for c in range(3):
            zone.way[node, c] = zone.way_before[node, c] = 0.0


@kernel
def _substep(
    body: Body,
    springs: Springs,
    activity: Activity,
    zone: Zone,
    chebyshev: Chebyshev,
    external: FloatArray,
    h: float,
    m: int,
) -> None:
    """From e_m to e_{m+1}."""
    rings, way, way_before = zone.rings, zone.way, zone.way_before
    for k in range(rings.state[N_FOUND]):
        node = rings.order[k]
        if body.fixed[node]:
            continue
        per_mass = 1.0 / body.masses[node]
        f = _elastic(springs, body.positions, node)
        r = axpy(per_mass, add(f, vec3(external, node)), vec3(zone.steady, node))
        if m == 0:
            store(zone.accelerations, node, r)
        if activity.state[node] != AWAKE:
            continue
        e = vec3(way, node)
        before = vec3(way_before, node)
        store(way_before, node, e)
        onward = axpy(-chebyshev.back[m], before, scale(chebyshev.onward[m], e))
        store(way, node, axpy(chebyshev.push[m] * h * h, r, onward))
    # Only now: until here the nodes saw each other at e_m.
    for k in range(rings.state[N_FOUND]):
        node = rings.order[k]
        if rings.ring[node] > 0:
            break
        store(body.positions, node, add(vec3(zone.start, node), vec3(way, node)))


@kernel
def _kick(
    body: Body, activity: Activity, zone: Zone, viscous_damping: float, h: float, kick: float
) -> None:
    half = math.exp(-0.5 * viscous_damping * h)
    for k in range(activity.counts[N_LISTED]):
        node = activity.listed[k]
        if activity.state[node] != AWAKE:
            continue
        if ring_of(zone.rings, node) == UNREACHED:
            gain = scale(kick * h, vec3(zone.accelerations, node))
        else:
            gain = scale(2.0 * kick / h, vec3(zone.way, node))
        v = axpy(half, vec3(body.velocities, node), gain)
        store(body.velocities, node, scale(half, v))


@kernel
def _damp_fine(
    body: Body, springs: Springs, activity: Activity, rings: Rings, seconds: float
) -> None:
    """Let the dampers at fine nodes act one after the other; `seconds` is h times retardation."""
    x, v = body.positions, body.velocities
    for i in range(rings.state[N_FOUND]):
        a = rings.order[i]
        if rings.ring[a] > 0:
            break
        inverse_a = 1.0 / body.masses[a]
        for slot in range(springs.first[a], springs.first[a] + springs.count[a]):
            b = springs.neighbour[slot]
            if b < a and ring_of(rings, b) == 0:
                continue  # its turn was, or will be, in the row of b
            is_free = activity.state[b] == AWAKE
            inverse_b = 1.0 / body.masses[b] if is_free else 0.0
            d = sub(vec3(x, b), vec3(x, a))
            inverse = inverse_a + inverse_b
            decay = -math.expm1(-seconds * springs.stiffness[slot] * inverse)
            approach = dot(sub(vec3(v, b), vec3(v, a)), d)
            impulse = decay * approach / (inverse * dot(d, d))
            store(v, a, axpy(impulse * inverse_a, d, vec3(v, a)))
            if is_free:
                store(v, b, axpy(-impulse * inverse_b, d, vec3(v, b)))


@kernel
def _drift(body: Body, activity: Activity, zone: Zone, h: float) -> None:
    for k in range(activity.counts[N_LISTED]):
        node = activity.listed[k]
        if activity.state[node] == AWAKE:
            is_fine = ring_of(zone.rings, node) == 0
            x = vec3(zone.start, node) if is_fine else vec3(body.positions, node)
            store(body.positions, node, axpy(h, vec3(body.velocities, node), x))


@kernel
def _elastic(springs: Springs, positions: FloatArray, node: int) -> Vec3:
    """Pull of the springs on a node [N]."""
    here = vec3(positions, node)
    fx = fy = fz = 0.0
    first = springs.first[node]
    for slot in range(first, first + springs.count[node]):
        d = sub(vec3(positions, springs.neighbour[slot]), here)
        along = springs.stiffness[slot] - springs.rest_pull[slot] / math.sqrt(dot(d, d))
        fx += along * d.x
        fy += along * d.y
        fz += along * d.z
    return Vec3(fx, fy, fz)


@kernel
def _damping(springs: Springs, body: Body, rings: Rings, node: int) -> Vec3:
    """Pull of the dampers on a node that is not fine, per retardation time [N/s]; see above."""
    x, v = body.positions, body.velocities
    here, speed = vec3(x, node), vec3(v, node)
    fx = fy = fz = 0.0
    first = springs.first[node]
    for slot in range(first, first + springs.count[node]):
        other = springs.neighbour[slot]
        if ring_of(rings, other) == 0:
            continue
        d = sub(vec3(x, other), here)
        along = springs.stiffness[slot] * dot(sub(vec3(v, other), speed), d) / dot(d, d)
        fx += along * d.x
        fy += along * d.y
        fz += along * d.z
    return Vec3(fx, fy, fz)
