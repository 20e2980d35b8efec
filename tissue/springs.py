"""Masses at nodes and springs along edges, as one row of neighbours a node.

Each spring stands in the rows of both its ends, so that the force on a node is a gather: no
scatter, no race, the same bits for any number of threads. The rows follow from the tetrahedra
around the node alone; after a cut only the rows of the nodes that it touched are written anew.

Stiffness of an edge (van Gelder): k = E * (volume of the tetrahedra around it) / (rest length)^2.
Pull of a spring on its ends: k (l - l0).
"""

import math

import numpy as np

from tissue.arrays import Arrays
from tissue.body import NODES, TETRAHEDRA, Body, grown
from tissue.geometry import tetrahedron_volume
from tissue.jit import kernel
from tissue.star import Visits, star
from tissue.types import FloatArray, IntArray
from tissue.vec3 import norm, sub, vec3

ROW_QUANTUM = 8
"""Rows have room for a multiple of this many springs, so that most can grow in place."""

POOL_MARGIN = 1024
"""Free slots below which `build_rows` asks for a larger pool; more than any one row needs."""


class Springs(Arrays):
    """The rows, and what follows from them for each node."""

    first: IntArray
    """Where each node's row begins in the pool, shape (capacity,)."""
    room: IntArray
    """Slots that the row has, shape (capacity,)."""
    count: IntArray
    """Slots that it uses, shape (capacity,)."""
    neighbour: IntArray
    """Other end of the spring, shape (pool,)."""
    stiffness: FloatArray
    """k [N/m], shape (pool,)."""
    rest_pull: FloatArray
    """k times rest length [N], shape (pool,)."""
    frequency_squared: FloatArray
    """Bound on the square of the local angular frequency [1/s2], shape (capacity,)."""
    used: IntArray
    """Slots of the pool in use, shape (1,)."""


def no_springs(n_nodes: int, pool: int) -> Springs:
    """Return empty rows for that many nodes."""
    return Springs(
        first=np.zeros(n_nodes, dtype=np.int64),
        room=np.zeros(n_nodes, dtype=np.int64),
        count=np.zeros(n_nodes, dtype=np.int64),
        neighbour=np.zeros(pool, dtype=np.int64),
        stiffness=np.zeros(pool),
        rest_pull=np.zeros(pool),
        frequency_squared=np.zeros(n_nodes),
        used=np.zeros(1, dtype=np.int64),
    )


def grown_springs(springs: Springs, n_nodes: int, pool: int) -> Springs:
    """Return the rows with room for that many nodes and springs."""
    of_nodes = ("first", "room", "count", "frequency_squared")
    larger = {name: grown(getattr(springs, name), n_nodes) for name in of_nodes}
    of_pool = ("neighbour", "stiffness", "rest_pull")
    larger |= {name: grown(getattr(springs, name), pool) for name in of_pool}
    return springs.replaced(**larger)


@kernel
def build_rows(
    body: Body,
    visits: Visits,
    springs: Springs,
    nodes: IntArray,
    n: int,
    density: float,
    young_modulus: float,
    around: IntArray,
) -> int:
    """Write the rows and masses of the first `n` of `nodes` anew; return how many it wrote.

    Fewer than `n` means that the pool is full: give it room and go on from there. `around` is
    scratch of shape (LARGEST_STAR,).
    """
    for i in range(n):
        if springs.used[0] + POOL_MARGIN > len(springs.neighbour):
            return i
        _build_row(body, visits, springs, nodes[i], density, young_modulus, around)
    return n


@kernel
def _build_row(
    body: Body,
    visits: Visits,
    springs: Springs,
    node: int,
    density: float,
    young_modulus: float,
    around: IntArray,
) -> None:
    n_around = star(body, visits, node, body.node_tetrahedron[node], around)
    # Both ends of an edge must add the same volumes in the same order, or the two ends of a spring
    # would differ in the last bit and action would not quite be reaction: hence the sorting.
    _sort(around, n_around)
    visits.epoch[0] += 1
    epoch = visits.epoch[0]
    n = 0
    for i in range(n_around):
        for k in range(4):
            other = body.tetrahedra[around[i], k]
            if other != node and visits.nodes[other] != epoch:
                visits.nodes[other] = epoch
                visits.place[other] = n
                n += 1
    if n > springs.room[node]:
        room = (n + ROW_QUANTUM - 1) // ROW_QUANTUM * ROW_QUANTUM
        springs.first[node] = springs.used[0]
        springs.room[node] = room
        springs.used[0] += room
    first = springs.first[node]
    for slot in range(first, first + n):
        springs.stiffness[slot] = 0.0
    mass = 0.0
    for i in range(n_around):
        t = around[i]
        volume = tetrahedron_volume(body.rest, body.tetrahedra, t)
        mass += density * volume / 4.0
        for k in range(4):
            other = body.tetrahedra[t, k]
            if other != node:
                slot = first + visits.place[other]
                springs.neighbour[slot] = other
                springs.stiffness[slot] += volume
    springs.count[node] = n
    body.masses[node] = mass
    here = vec3(body.rest, node)
    for slot in range(first, first + n):
        length = norm(sub(vec3(body.rest, springs.neighbour[slot]), here))
        k = young_modulus * springs.stiffness[slot] / (length * length)
        springs.stiffness[slot] = k
        springs.rest_pull[slot] = k * length
    springs.frequency_squared[node] = _frequency_bound(body, springs, node)


@kernel
def _sort(values: IntArray, n: int) -> None:
    """Insertion sort of the first `n`; stars are short."""
    for i in range(1, n):
        value = values[i]
        j = i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value


@kernel
def _frequency_bound(body: Body, springs: Springs, node: int) -> float:
    """Gershgorin's bound on w^2 from the block row of this node in M^-1 K.

    The diagonal block is S = sum k u u^T, the others add up to at most sum k; the norm of S is
    at most its largest absolute row sum, and at most its trace, sum k.
    """
    here = vec3(body.rest, node)
    xx = yy = zz = xy = xz = yz = trace = 0.0
    for slot in range(springs.first[node], springs.first[node] + springs.count[node]):
        d = sub(vec3(body.rest, springs.neighbour[slot]), here)
        k = springs.stiffness[slot]
        c = k / (d.x * d.x + d.y * d.y + d.z * d.z)
        xx += c * d.x * d.x
        yy += c * d.y * d.y
        zz += c * d.z * d.z
        xy += c * d.x * d.y
        xz += c * d.x * d.z
        yz += c * d.y * d.z
        trace += k
    rows = max(xx + abs(xy) + abs(xz), max(abs(xy) + yy + abs(yz), abs(xz) + abs(yz) + zz))
    return (min(rows, trace) + trace) / body.masses[node]


@kernel
def accelerations(
    springs: Springs,
    body: Body,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
    viscous_damping: float,
    gravity: FloatArray,
    external: FloatArray,
    with_elastic: bool,
    elastic: FloatArray,
    out: FloatArray,
) -> None:
    """Write the acceleration of every node to `out` [m/s2], shape (n_nodes, 3).

    Args:
        springs: The rows.
        body: For masses and fixed nodes.
        positions: Where the nodes are [m].
        velocities: How fast they move [m/s].
        retardation_time: Damping along each spring, per stiffness [s].
        viscous_damping: Drag on each node, per mass [1/s].
        gravity: [m/s2], shape (3,).
        external: Further forces on the nodes [N].
        with_elastic: Whether to evaluate the elastic forces; if not they are read from `elastic`.
        elastic: Elastic forces at `positions` [N], written or read.
        out: The result. A fixed node gets zero.
    """
    for i in range(body.counts[NODES]):
        if body.fixed[i]:
            out[i, 0] = out[i, 1] = out[i, 2] = 0.0
            continue
        x = positions[i, 0]
        y = positions[i, 1]
        z = positions[i, 2]
        vx = velocities[i, 0]
        vy = velocities[i, 1]
        vz = velocities[i, 2]
        ex = ey = ez = 0.0
        fx = fy = fz = 0.0
        first = springs.first[i]
        for slot in range(first, first + springs.count[i]):
            j = springs.neighbour[slot]
            dx = positions[j, 0] - x
            dy = positions[j, 1] - y
            dz = positions[j, 2] - z
            inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
            if with_elastic:
                pull = springs.stiffness[slot] - springs.rest_pull[slot] * inverse
                ex += pull * dx
                ey += pull * dy
                ez += pull * dz
            approach = (
                (velocities[j, 0] - vx) * dx
                + (velocities[j, 1] - vy) * dy
                + (velocities[j, 2] - vz) * dz
            )
            pull = springs.stiffness[slot] * approach * inverse * inverse
            fx += pull * dx
            fy += pull * dy
            fz += pull * dz
        if with_elastic:
            elastic[i, 0] = ex
            elastic[i, 1] = ey
            elastic[i, 2] = ez
        else:
            ex = elastic[i, 0]
            ey = elastic[i, 1]
            ez = elastic[i, 2]
        fx = ex + retardation_time * fx
        fy = ey + retardation_time * fy
        fz = ez + retardation_time * fz
        per_mass = 1.0 / body.masses[i]
        out[i, 0] = (
            (fx + external[i, 0]) * per_mass + gravity[0] - viscous_damping * velocities[i, 0]
        )
        out[i, 1] = (
            (fy + external[i, 1]) * per_mass + gravity[1] - viscous_damping * velocities[i, 1]
        )
        out[i, 2] = (
            (fz + external[i, 2]) * per_mass + gravity[2] - viscous_damping * velocities[i, 2]
        )


@kernel
def elastic_energy(springs: Springs, body: Body) -> float:
    """Energy stored in the springs [J]: sum of k (l - l0)^2 / 2, each spring once."""
    energy = 0.0
    for i in range(body.counts[NODES]):
        here = vec3(body.positions, i)
        for slot in range(springs.first[i], springs.first[i] + springs.count[i]):
            j = springs.neighbour[slot]
            if j > i:
                k = springs.stiffness[slot]
                stretch = norm(sub(vec3(body.positions, j), here)) - springs.rest_pull[slot] / k
                energy += 0.5 * k * stretch * stretch
    return energy


@kernel
def total_volume(body: Body) -> float:
    """Volume of the body at rest [m3]."""
    volume = 0.0
    for t in range(body.counts[TETRAHEDRA]):
        volume += tetrahedron_volume(body.rest, body.tetrahedra, t)
    return volume
