"""The paper's hierarchical relaxation (section 5.2): near the blade nodes are moved more often.

In a frame of length T a node of ring s takes i(s) = I 2^-s steps of T / i(s) (equations 7 and 8);
in rings that would be unstable so, twice as many, or four times (`ring_steps`).
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

from typing import NamedTuple

import numpy as np

from tissue.blade.edge import Edge
from tissue.blade.forces import apply_blade_forces, clear_blade_forces
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import (
    WIDTH,
    Point,
    aligned,
    eight_points,
    filled,
    lanes,
    load_lanes,
    point,
    point_of,
    room_for_points,
    spread,
    square_root,
    store_lanes,
    store_point,
    summed,
    times,
)
from tissue.core.structs import Arrays, IntCell
from tissue.elasticity.springs import NO_LENGTH, Springs
from tissue.forces.step_context import StepContext
from tissue.integrators.bielser_1998.rings import Rings, ring_of
from tissue.mesh.body import Body, grown
from tissue.mesh.star import LARGEST_STAR

N_SEEN = 10
"""Numbers in `LocalClocks.seen` for each neighbour."""

LARGEST_ROW = LARGEST_STAR + WIDTH
"""Neighbours of a node at most: each further tetrahedron around it, through a face, adds one to the
three of the first; and a row is filled up."""


class LocalClocks(Arrays):
    """Each node as a neighbour sees it: on a straight line since the node was moved last."""

    origins: FloatArray
    """Position on the line at the begin of the frame [m], shape (capacity, 3). Its direction is
    the velocity of the node."""
    clocks: FloatArray
    """When the node was moved last, since the begin of the frame [s]; shape (capacity,)."""
    frames: IntArray
    """Number of the frame that moved it last, shape (capacity,)."""
    seen: FloatArray
    """Neighbours as the node that is being moved sees them, eight after eight: origins and
    velocities of their lines, vectors to them [m], and stiffness by squared length [N/m3]."""
    frame: IntCell
    """Number of the last frame."""
    n_known: IntCell
    """Number of nodes that there were in it."""


def new_local_clocks(n_nodes: int) -> LocalClocks:
    """Return local clocks of that many nodes."""
    return LocalClocks(
        origins=room_for_points(n_nodes),
        clocks=np.zeros(n_nodes),
        frames=np.zeros(n_nodes, np.int64),
        seen=aligned(N_SEEN * LARGEST_ROW),
        frame=0,
        n_known=0,
    )


def grown_local_clocks(local_clocks: LocalClocks, n_nodes: int) -> LocalClocks:
    """Return the local clocks with room for that many nodes."""
    of_nodes = ("origins", "clocks", "frames")
    return local_clocks.replaced(
        **{name: grown(getattr(local_clocks, name), n_nodes) for name in of_nodes}
    )


class FrameTimes(NamedTuple):
    """A frame of the hierarchical relaxation."""

    dt: float
    """Length of the time step [s]."""
    begin: float
    """Fraction of the time step at which the frame begins."""
    end: float
    """Fraction of the time step at which it ends."""
    n: int
    """Micro steps."""
    last_ring: int
    """Number s_max of the last ring; nodes further out are beyond the rings."""
    is_far_frozen: bool
    """Whether nodes beyond the last ring stay where they are (the paper's rule)."""


@kernel
def hierarchical_frame(
    context: StepContext,
    edge: Edge,
    rings: Rings,
    local_clocks: LocalClocks,
    every: IntArray,
    frame: FrameTimes,
) -> None:
    """Advance the body by one frame.

    Args:
        context: What takes part. The blade acts in every micro step; all nodes that it acts on
            should be in ring 0.
        edge: The cutting edge over the time step.
        rings: Searched up to `last_ring + 1`: the ring beyond the last is seen, but not moved.
        local_clocks: Scratch.
        every: Micro steps between two moves of a node of each ring, and last of those beyond; each
            divides the next. The nodes of ring 0 are moved in each micro step.
        frame: Times, and how far out nodes are moved.
    """
    body, blade, external = context.body, context.blade, context.stages.external
    last_ring, is_far_frozen, n = frame.last_ring, frame.is_far_frozen, frame.n
    _set_local_clocks(body, rings, local_clocks, last_ring, is_far_frozen)
    share = frame.end - frame.begin
    span = share * frame.dt
    n_far = every[last_ring + 1]
    for j in range(1, n + 1):
        begin = frame.begin + share * (j - 1) / n
        apply_blade_forces(blade, body, edge, body.positions, begin, share / n, frame.dt, external)
        t1 = span * j / n
        for k in range(rings.n_found):
            node = rings.order[k]
            ring = rings.ring[node]
            # The rings come in order, so that none further out is due either.
            if ring > last_ring or j % every[ring] != 0:
                break
            _move(context, local_clocks, node, t1)
        if j % n_far == 0 and not is_far_frozen:
            for node in range(body.n_nodes):
                if not 0 <= ring_of(rings, node) <= last_ring:
                    _move(context, local_clocks, node, t1)
    clear_blade_forces(blade, body, external)


@kernel
def _set_local_clocks(
    body: Body, rings: Rings, local_clocks: LocalClocks, last_ring: int, is_far_frozen: bool
) -> None:
    """Give every node that takes part, or is seen by one that does, the clock of the frame."""
    if is_far_frozen:
        for k in range(rings.n_found):
            node = rings.order[k]
            was_frozen = (
                node < local_clocks.n_known and local_clocks.frames[node] != local_clocks.frame
            )
            if was_frozen or rings.ring[node] > last_ring:
                store_point(body.velocities, node, point_of(0.0, 0.0, 0.0))
            if rings.ring[node] <= last_ring:
                local_clocks.frames[node] = local_clocks.frame + 1
            _set_local_clock(body, local_clocks, node, 0.0)
    else:
        for node in range(body.n_nodes):
            _set_local_clock(body, local_clocks, node, 0.0)
    local_clocks.frame += 1
    local_clocks.n_known = body.n_nodes


@inlined
def _set_local_clock(body: Body, local_clocks: LocalClocks, node: int, clock: float) -> None:
    local_clocks.clocks[node] = clock
    origin = point(body.positions, node) - times(clock, point(body.velocities, node))
    store_point(local_clocks.origins, node, origin)


@kernel
def _move(context: StepContext, local_clocks: LocalClocks, node: int, t1: float) -> None:
    """Move one node alone, from its own clock to `t1` [s] since the begin of the frame."""
    body, springs, surroundings = context.body, context.elastic.springs, context.surroundings
    if body.fixed[node]:
        return
    t0 = local_clocks.clocks[node]
    h = t1 - t0
    x, v = point(body.positions, node), point(body.velocities, node)
    time, drag = surroundings.retardation_time, surroundings.drag * body.drag[node]
    per_mass = 1.0 / body.masses[node]
    external = point(context.stages.external, node) + point(context.stages.loads, node)
    constant = point_of(*surroundings.gravity) + times(per_mass, external)
    net = (springs, local_clocks, node)
    _note_neighbours(body, *net)

    a1 = constant - times(drag, v) + times(per_mass, _force(*net, t0, x, v, time))
    middle, v2 = x + times(0.5 * h, v) + times(0.125 * h * h, a1), v + times(0.5 * h, a1)
    a2 = constant - times(drag, v2) + times(per_mass, _force(*net, t0 + 0.5 * h, middle, v2, time))
    change = times(0.5 * h, a2 - a1)
    a3 = a2 - times(drag, change)
    if time > 0.0:
        a3 = a3 - times(per_mass * time, _resistance(*net, change))
    ahead, v4 = x + times(h, v) + times(0.5 * h * h, a3), v + times(h, a3)
    a4 = constant - times(drag, v4) + times(per_mass, _force(*net, t1, ahead, v4, time))

    both = a2 + a3
    store_point(body.positions, node, x + times(h, v) + times(h * h / 6.0, a1 + both))
    store_point(body.velocities, node, v + times(h / 6.0, a1 + both + both + a4))
    _set_local_clock(body, local_clocks, node, t1)


@inlined
def _note_neighbours(body: Body, springs: Springs, local_clocks: LocalClocks, node: int) -> None:
    """Note the lines of the neighbours of a node, eight after eight."""
    seen = local_clocks.seen
    first = springs.first[node]
    for slot in range(first, first + filled(springs.count[node]), WIDTH):
        at = N_SEEN * (slot - first)
        x, y, z = eight_points(local_clocks.origins, springs.neighbour, slot)
        u, v, w = eight_points(body.velocities, springs.neighbour, slot)
        store_lanes(seen, at, x)
        store_lanes(seen, at + WIDTH, y)
        store_lanes(seen, at + 2 * WIDTH, z)
        store_lanes(seen, at + 3 * WIDTH, u)
        store_lanes(seen, at + 4 * WIDTH, v)
        store_lanes(seen, at + 5 * WIDTH, w)


@inlined
def _force(
    springs: Springs,
    local_clocks: LocalClocks,
    node: int,
    t: float,
    position: Point,
    velocity: Point,
    retardation_time: float,
) -> Point:
    """Force [N] on a node at `position`, moving at `velocity`, among its neighbours at time `t`.

    Notes what `_resistance` needs.
    """
    seen = local_clocks.seen
    x, y, z = spread(position)
    u, v, w = spread(velocity)
    clock, time, one = lanes(t), lanes(retardation_time), lanes(1.0)
    fx = fy = fz = lanes(0.0)
    first = springs.first[node]
    for slot in range(first, first + filled(springs.count[node]), WIDTH):
        at = N_SEEN * (slot - first)
        du, dv, dw = (
            load_lanes(seen, at + 3 * WIDTH),
            load_lanes(seen, at + 4 * WIDTH),
            load_lanes(seen, at + 5 * WIDTH),
        )
        dx = load_lanes(seen, at) + clock * du - x
        dy = load_lanes(seen, at + WIDTH) + clock * dv - y
        dz = load_lanes(seen, at + 2 * WIDTH) + clock * dw - z
        approach = (du - u) * dx + (dv - v) * dy + (dw - w) * dz
        squared = dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH)
        per_squared = one / squared  # next to the root, not after it: nodes are moved one by one
        stiffness = load_lanes(springs.stiffness, slot)
        viscous = stiffness * per_squared
        elastic = stiffness - load_lanes(springs.rest_pull, slot) * per_squared * square_root(
            squared
        )
        along = elastic + time * approach * viscous
        fx, fy, fz = fx + along * dx, fy + along * dy, fz + along * dz
        store_lanes(seen, at + 6 * WIDTH, dx)
        store_lanes(seen, at + 7 * WIDTH, dy)
        store_lanes(seen, at + 8 * WIDTH, dz)
        store_lanes(seen, at + 9 * WIDTH, viscous)
    return summed(fx, fy, fz)


@inlined
def _resistance(springs: Springs, local_clocks: LocalClocks, node: int, speed: Point) -> Point:
    """Force per retardation time [N/s] by which the dampers resist a speed of the node alone.

    At the position of the last `_force`.
    """
    seen = local_clocks.seen
    u, v, w = spread(speed)
    fx = fy = fz = lanes(0.0)
    for at in range(0, N_SEEN * filled(springs.count[node]), N_SEEN * WIDTH):
        dx, dy, dz = (
            load_lanes(seen, at + 6 * WIDTH),
            load_lanes(seen, at + 7 * WIDTH),
            load_lanes(seen, at + 8 * WIDTH),
        )
        along = load_lanes(seen, at + 9 * WIDTH) * (u * dx + v * dy + w * dz)
        fx, fy, fz = fx + along * dx, fy + along * dy, fz + along * dz
    return summed(fx, fy, fz)


@kernel
def ring_frequencies(
    body: Body,
    frequency_squared: FloatArray,
    rings: Rings,
    last_ring: int,
    is_far_frozen: bool,
    out: FloatArray,
) -> None:
    """Write the largest bound on w^2 [1/s2] of the nodes in each ring.

    Args:
        body: For the nodes.
        frequency_squared: Bound on w^2 of each node [1/s2], shape (capacity,).
        rings: The rings.
        last_ring: Number of the last ring.
        is_far_frozen: Whether nodes beyond the last ring stay where they are.
        out: Bound of each ring, shape (last_ring + 2,); last the bound of all nodes beyond, 0 where
            they are frozen.
    """
    for s in range(last_ring + 2):
        out[s] = 0.0
    for k in range(rings.n_found):
        node = rings.order[k]
        ring = rings.ring[node]
        if ring <= last_ring and not body.fixed[node]:
            out[ring] = max(out[ring], frequency_squared[node])
    if is_far_frozen:
        return
    for node in range(body.n_nodes):
        if not (0 <= ring_of(rings, node) <= last_ring or body.fixed[node]):
            out[last_ring + 1] = max(out[last_ring + 1], frequency_squared[node])
