"""The paper's hierarchical relaxation (section 5.2): near the blade nodes are moved more often.

In a frame of length T a node of ring s takes i(s) = I 2^-s steps of T / i(s) (equations 7 and 8).
Each step moves one node alone, in place, by the two-level Runge-Kutta method; its neighbours are
seen where their own last position and velocity put them at that instant.

What was reconstructed, and is not in the paper: a node that comes into the rings takes the clock of
the frame; with the time stamp of when it was moved last, a node frozen for ten seconds would take
a single step of ten seconds. Nodes are moved in place (Gauss-Seidel): with the positions of one
instant for all (Jacobi) the scheme gains energy.

The two ends of a spring see each other at different times, so that action is not quite reaction:
momentum drifts by parts in a thousand, the order is 2 without damping along springs and 1 with it.
At rest all that is gone: the equilibrium is that of all nodes moved together.
"""

import math

import numpy as np

from tissue.anchors import Anchors, Edge, clear_forces, pull
from tissue.arrays import Arrays
from tissue.body import NODES, Body, grown
from tissue.jit import kernel
from tissue.relaxation.breadth_first import N_FOUND, Rings, ring_of
from tissue.springs import Springs
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3, add, axpy, store, vec3

STATE = 8
"""Numbers in a row of `Trails.states`: one cache line, which is all that a neighbour costs."""


class Trails(Arrays):
    """How a neighbour sees each node: on a straight line since the node was moved last."""

    states: FloatArray
    """Position that the line has at the begin of the frame [m], velocity [m/s], and two spare
    numbers; shape (capacity, STATE)."""
    clocks: FloatArray
    """When the node was moved last, since the begin of the frame [s]; shape (capacity,)."""
    frames: IntArray
    """Number of the frame that moved it last, shape (capacity,)."""
    counts: IntArray
    """Number of the last frame, and of the nodes that there were; shape (2,)."""


FRAME, N_KNOWN = 0, 1
"""Places in `Trails.counts`."""


def new_trails(n_nodes: int) -> Trails:
    """Return trails of that many nodes."""
    return Trails(
        states=np.zeros((n_nodes, STATE)),
        clocks=np.zeros(n_nodes),
        frames=np.zeros(n_nodes, np.int64),
        counts=np.zeros(2, np.int64),
    )


def grown_trails(trails: Trails, n_nodes: int) -> Trails:
    """Return the trails with room for that many nodes."""
    of_nodes = ("states", "clocks", "frames")
    return trails.replaced(**{name: grown(getattr(trails, name), n_nodes) for name in of_nodes})


@kernel
def hierarchical_frame(
    body: Body,
    springs: Springs,
    anchors: Anchors,
    edge: Edge,
    rings: Rings,
    trails: Trails,
    external: FloatArray,
    gravity: FloatArray,
    retardation_time: float,
    viscous_damping: float,
    toughness: float,
    dt: float,
    at: float,
    share: float,
    updates: int,
    last_ring: int,
    is_far_frozen: bool,
) -> None:
    """Advance the body by one frame, from fraction `at` of the time step by `share` of it.

    Args:
        body: Positions and velocities are written.
        springs: The rows.
        anchors: Pull in every micro step; all nodes that they pull on should be in ring 0.
        edge: The cutting edge over the whole time step of length `dt` [s].
        rings: Searched up to `last_ring + 1`: the ring beyond the last is seen, but not moved.
        trails: Scratch.
        external: Scratch for the forces of the anchors [N], shape (capacity, 3).
        gravity: [m/s2], shape (3,).
        retardation_time: Damping along springs [s].
        viscous_damping: Drag [1/s].
        toughness: [J/m2].
        dt: Length of the time step [s].
        at: Where in the time step the frame begins.
        share: Which share of it the frame is.
        updates: I, steps of the focus; a multiple of 2^last_ring.
        last_ring: s_max.
        is_far_frozen: Whether nodes beyond the last ring stay where they are (the paper's rule);
            else each is moved once.
    """
    _lay_trails(body, rings, trails, last_ring, is_far_frozen)
    damping = (retardation_time, viscous_damping, gravity)
    span = share * dt
    for j in range(1, updates + 1):
        begin = at + share * (j - 1) / updates
        pull(
            anchors, body, edge, body.positions, begin, share / updates, dt, toughness, external
        )
        t1 = span * j / updates
        for k in range(rings.state[N_FOUND]):
            node = rings.order[k]
            ring = rings.ring[node]
            # The rings come in order, so that none further out is due either.
            if ring > last_ring or j % (1 << ring) != 0:
                break
            _move(body, springs, trails, external, *damping, node, t1)
    if not is_far_frozen:
        for node in range(body.counts[NODES]):
            if not 0 <= ring_of(rings, node) <= last_ring:
                _move(body, springs, trails, external, *damping, node, span)
    clear_forces(anchors, body, external)


@kernel
def _lay_trails(
    body: Body, rings: Rings, trails: Trails, last_ring: int, is_far_frozen: bool
) -> None:
    """Give every node that takes part, or is seen by one that does, the clock of the frame."""
    counts = trails.counts
    if is_far_frozen:
        for k in range(rings.state[N_FOUND]):
            node = rings.order[k]
            was_frozen = node < counts[N_KNOWN] and trails.frames[node] != counts[FRAME]
            if was_frozen or rings.ring[node] > last_ring:
                for c in range(3):
                    body.velocities[node, c] = 0.0
            _lay_trail(trails, node, 0.0, vec3(body.positions, node), vec3(body.velocities, node))
            if rings.ring[node] <= last_ring:
                trails.frames[node] = counts[FRAME] + 1
    else:
        for node in range(body.counts[NODES]):
            _lay_trail(trails, node, 0.0, vec3(body.positions, node), vec3(body.velocities, node))
    counts[FRAME] += 1
    counts[N_KNOWN] = body.counts[NODES]


@kernel
def _lay_trail(trails: Trails, node: int, clock: float, x: Vec3, v: Vec3) -> None:
    states = trails.states
    trails.clocks[node] = clock
    states[node, 0] = x.x - clock * v.x
    states[node, 1] = x.y - clock * v.y
    states[node, 2] = x.z - clock * v.z
    states[node, 3] = v.x
    states[node, 4] = v.y
    states[node, 5] = v.z


@kernel
def _move(
    body: Body,
    springs: Springs,
    trails: Trails,
    external: FloatArray,
    retardation_time: float,
    viscous_damping: float,
    gravity: FloatArray,
    node: int,
    t1: float,
) -> None:
    """Move one node alone, from its own clock to `t1` [s] since the begin of the frame."""
    if body.fixed[node]:
        trails.clocks[node] = t1
        return
    t0 = trails.clocks[node]
    h = t1 - t0
    x = vec3(body.positions, node)
    v = vec3(body.velocities, node)
    per_mass = 1.0 / body.masses[node]
    constant = Vec3(
        external[node, 0] * per_mass + gravity[0],
        external[node, 1] * per_mass + gravity[1],
        external[node, 2] * per_mass + gravity[2],
    )
    forces = (springs, trails, node, per_mass, constant, retardation_time, viscous_damping)

    a1 = _acceleration(*forces, t0, x, v)
    middle = axpy(0.125 * h * h, a1, axpy(0.5 * h, v, x))
    a2 = _acceleration(*forces, t0 + 0.5 * h, middle, axpy(0.5 * h, a1, v))
    a3 = _acceleration(*forces, t0 + 0.5 * h, middle, axpy(0.5 * h, a2, v))
    ahead = axpy(0.5 * h * h, a3, axpy(h, v, x))
    a4 = _acceleration(*forces, t1, ahead, axpy(h, a3, v))

    both = add(a2, a3)
    x = axpy(h * h / 6.0, add(a1, both), axpy(h, v, x))
    v = axpy(h / 6.0, axpy(2.0, both, add(a1, a4)), v)
    store(body.positions, node, x)
    store(body.velocities, node, v)
    _lay_trail(trails, node, t1, x, v)


@kernel
def _acceleration(
    springs: Springs,
    trails: Trails,
    node: int,
    per_mass: float,
    constant: Vec3,
    retardation_time: float,
    viscous_damping: float,
    t: float,
    x: Vec3,
    v: Vec3,
) -> Vec3:
    """Acceleration [m/s2] of a node at `x`, moving at `v`, among its neighbours at time `t`."""
    states = trails.states
    fx = fy = fz = 0.0
    first = springs.first[node]
    for slot in range(first, first + springs.count[node]):
        j = springs.neighbour[slot]
        dx = states[j, 0] + t * states[j, 3] - x.x
        dy = states[j, 1] + t * states[j, 4] - x.y
        dz = states[j, 2] + t * states[j, 5] - x.z
        inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
        k = springs.stiffness[slot]
        approach = (states[j, 3] - v.x) * dx + (states[j, 4] - v.y) * dy + (states[j, 5] - v.z) * dz
        along = k - springs.rest_pull[slot] * inverse
        along += retardation_time * k * approach * inverse * inverse
        fx += along * dx
        fy += along * dy
        fz += along * dz
    return Vec3(
        fx * per_mass + constant.x - viscous_damping * v.x,
        fy * per_mass + constant.y - viscous_damping * v.y,
        fz * per_mass + constant.z - viscous_damping * v.z,
    )


@kernel
def ring_frequencies(
    body: Body, springs: Springs, rings: Rings, last_ring: int, is_far_frozen: bool, out: FloatArray
) -> None:
    """Write the largest bound on w^2 [1/s2] of the nodes in each ring to `out`.

    Shape (last_ring + 2,); last that of all nodes beyond, 0 where they are frozen.
    """
    for s in range(last_ring + 2):
        out[s] = 0.0
    for k in range(rings.state[N_FOUND]):
        node = rings.order[k]
        ring = rings.ring[node]
        if ring <= last_ring and not body.fixed[node]:
            out[ring] = max(out[ring], springs.frequency_squared[node])
    if is_far_frozen:
        return
    for node in range(body.counts[NODES]):
        if not (0 <= ring_of(rings, node) <= last_ring or body.fixed[node]):
            out[last_ring + 1] = max(out[last_ring + 1], springs.frequency_squared[node])
