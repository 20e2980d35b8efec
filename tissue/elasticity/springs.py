"""Masses at nodes, springs along edges as one row of neighbours for each node, and their forces.

Each spring is in the rows of both its ends, so that the force on a node is a gather: no scatter, no
race, the same bits for any number of threads. A row depends only on the tetrahedra around its node;
after a cut only the rows of touched nodes are written again. A row is padded to a multiple of
eight with springs without stiffness from the node to itself, so that forces are evaluated eight at
a time.

Stiffness of an edge (van Gelder): k = E * (volume of the tetrahedra around it) / (rest length)^2.
Pull of a spring on its ends: k (l - l0). Dampers along the edges have the stiffness of springs.
"""

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import (
    WIDTH,
    Point,
    eight_points,
    filled,
    lanes,
    load_lanes,
    square_root,
    summed,
    times,
)
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import norm, sub, vec3
from tissue.geometry.tetrahedron import (
    add_square,
    largest_eigenvalue,
    nothing_symmetric,
    tetrahedron_volume,
)
from tissue.mesh.body import Body
from tissue.mesh.star import LARGEST_STAR, Visits, sorted_star

NO_LENGTH = 1e-300
"""Added to squared lengths [m2], far below any: it prevents division by zero in slots without a
spring and between nodes that coincide."""

SPRING_POOL_MARGIN = LARGEST_STAR + WIDTH
"""Free slots below which `build_rows` requests a larger pool; more than any one row needs."""


class Springs(Arrays):
    """Rows of springs in one pool, and bounds on the frequency of each node."""

    first: IntArray = sized("nodes")
    """Where each node's row begins in the pool, shape (capacity,)."""
    room: IntArray = sized("nodes")
    """Slots reserved for each node's row, shape (capacity,)."""
    count: IntArray = sized("nodes")
    """Slots that each node's row uses, shape (capacity,)."""
    neighbour: SlotArray = sized("pool")
    """Other end of each spring, shape (pool,)."""
    stiffness: FloatArray = sized("pool")
    """Stiffness k of each spring [N/m], shape (pool,)."""
    rest_pull: FloatArray = sized("pool")
    """Stiffness times rest length of each spring [N], shape (pool,)."""
    stiffness_per_mass: FloatArray = sized("nodes")
    """Largest eigenvalue of the stiffness of all springs at each node, per mass [1/s2], shape
    (capacity,)."""
    frequency_squared: FloatArray = sized("nodes")
    """Bound on the square of the local angular frequency [1/s2], shape (capacity,)."""
    used: IntCell
    """Number of slots of the pool in use."""


def no_springs(n_nodes: int, pool: int) -> Springs:
    """Return empty rows for that many nodes."""
    return Springs.new({"nodes": n_nodes, "pool": pool})


@kernel
def build_rows(
    body: Body,
    visits: Visits,
    springs: Springs,
    nodes: IntArray,
    n: int,
    around: IntArray,
) -> int:
    """Write the rows and masses of the first `n` of `nodes`; return how many were written.

    If fewer than `n` were, the pool is full: enlarge it and continue from there.

    Args:
        body: Masses are written.
        visits: For searches.
        springs: Rows are written.
        nodes: The nodes.
        n: How many of them.
        around: Scratch, shape (LARGEST_STAR,).
    """
    for i in range(n):
        if springs.used + SPRING_POOL_MARGIN > len(springs.neighbour):
            return i
        _build_row(body, visits, springs, nodes[i], around)
    return n


@kernel
def _build_row(
    body: Body,
    visits: Visits,
    springs: Springs,
    node: int,
    around: IntArray,
) -> None:
    materials, row = body.materials, body.material
    is_uniform = materials.is_even == 1
    # Both ends of an edge must add the same volumes in the same order, or the two ends of a spring
    # would differ in the last bit and action would not quite be reaction: hence sorted.
    n_around = sorted_star(body, visits, node, around)
    visits.epoch += 1
    epoch = visits.epoch
    n = 0
    for i in range(n_around):
        for k in range(4):
            other = body.tetrahedra[around[i], k]
            if other != node and visits.nodes[other] != epoch:
                visits.nodes[other] = epoch
                visits.place[other] = n
                n += 1
    if n > springs.room[node]:
        room = filled(n)
        springs.first[node] = springs.used
        springs.room[node] = room
        springs.used += room
    first = springs.first[node]
    for slot in range(first, first + n):
        springs.stiffness[slot] = 0.0
    mass = 0.0
    for i in range(n_around):
        t = around[i]
        volume = tetrahedron_volume(body.rest, body.tetrahedra, t)
        mass += materials.density[row[t]] * volume / 4.0
        share = volume if is_uniform else materials.spring_modulus[row[t]] * volume
        for k in range(4):
            other = body.tetrahedra[t, k]
            if other != node:
                slot = first + visits.place[other]
                springs.neighbour[slot] = other
                springs.stiffness[slot] += share
    springs.count[node] = n
    body.masses[node] = mass
    body.added_masses[node] = 0.0
    here = vec3(body.rest, node)
    modulus = materials.spring_modulus[0] if is_uniform else 1.0
    for slot in range(first, first + n):
        length = norm(sub(vec3(body.rest, springs.neighbour[slot]), here))
        k = modulus * springs.stiffness[slot] / (length * length)
        springs.stiffness[slot] = k
        springs.rest_pull[slot] = k * length
    for slot in range(first + n, first + filled(n)):
        springs.neighbour[slot] = node
        springs.stiffness[slot] = 0.0
        springs.rest_pull[slot] = 0.0
    springs.stiffness_per_mass[node] = _stiffness_per_mass(body, springs, node)


@kernel
def _stiffness_per_mass(body: Body, springs: Springs, node: int) -> float:
    """Return the largest eigenvalue of S = sum of k u u^T over the row, per mass [1/s2]."""
    here = vec3(body.rest, node)
    stiffness = nothing_symmetric()
    for slot in range(springs.first[node], springs.first[node] + springs.count[node]):
        d = sub(vec3(body.rest, springs.neighbour[slot]), here)
        c = springs.stiffness[slot] / (d.x * d.x + d.y * d.y + d.z * d.z)
        stiffness = add_square(stiffness, c, d)
    stiffness_per_mass: float = largest_eigenvalue(stiffness) / body.masses[node]
    return stiffness_per_mass


@kernel
def bound_frequencies(body: Body, springs: Springs, nodes: IntArray, n: int) -> None:
    """Write the bound on w^2 at the first `n` of `nodes`, whose rows are up to date.

    Every spring is given a share of the mass of each end, in proportion to its stiffness: the share
    k / s_a of node a, where s_a is the largest eigenvalue of S_a. In no direction do the shares add
    up to more than the mass. So by Irons' theorem no mode of the body is faster than the fastest
    spring alone with its masses: w^2 = k (s_a / (k m_a) + s_b / (k m_b)) = s_a / m_a + s_b / m_b. A
    fixed node counts as infinitely heavy.
    """
    for i in range(n):
        node = nodes[i]
        adjacent = 0.0
        for slot in range(springs.first[node], springs.first[node] + springs.count[node]):
            other = springs.neighbour[slot]
            if not body.fixed[other]:
                adjacent = max(adjacent, springs.stiffness_per_mass[other])
        springs.frequency_squared[node] = springs.stiffness_per_mass[node] + adjacent


@kernel
def spring_energy(springs: Springs, body: Body) -> float:
    """Return the energy stored in the springs [J]: sum of k (l - l0)^2 / 2, each spring once."""
    energy = 0.0
    for i in range(body.n_nodes):
        here = vec3(body.positions, i)
        for slot in range(springs.first[i], springs.first[i] + springs.count[i]):
            j = springs.neighbour[slot]
            if j > i:
                k = springs.stiffness[slot]
                stretch = norm(sub(vec3(body.positions, j), here)) - springs.rest_pull[slot] / k
                energy += 0.5 * k * stretch * stretch
    return energy


@inlined
def elastic_force(springs: Springs, node: int, positions: FloatArray) -> Point:
    """Return the pull of the springs on a node [N]: the sum of k (l - l0) along each."""
    x, y, z = lanes(positions[node, 0]), lanes(positions[node, 1]), lanes(positions[node, 2])
    fx = fy = fz = lanes(0.0)
    slot = springs.first[node]
    end = slot + springs.count[node]
    while slot < end:
        dx, dy, dz = eight_points(positions, springs.neighbour, slot)
        dx, dy, dz = dx - x, dy - y, dz - z
        length = square_root(dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH))
        pull = load_lanes(springs.stiffness, slot) - load_lanes(springs.rest_pull, slot) / length
        fx, fy, fz = fx + pull * dx, fy + pull * dy, fz + pull * dz
        slot += WIDTH
    return summed(fx, fy, fz)


@inlined
def damping_force(
    springs: Springs,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the force of the dampers on a node [N]: retardation time times k l' along each spring.

    Args:
        springs: The rows.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness [s].
    """
    x, y, z = lanes(positions[node, 0]), lanes(positions[node, 1]), lanes(positions[node, 2])
    u, v, w = lanes(velocities[node, 0]), lanes(velocities[node, 1]), lanes(velocities[node, 2])
    fx = fy = fz = lanes(0.0)
    slot = springs.first[node]
    end = slot + springs.count[node]
    while slot < end:
        dx, dy, dz = eight_points(positions, springs.neighbour, slot)
        dx, dy, dz = dx - x, dy - y, dz - z
        du, dv, dw = eight_points(velocities, springs.neighbour, slot)
        approach = (du - u) * dx + (dv - v) * dy + (dw - w) * dz
        squared = dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH)
        pull = load_lanes(springs.stiffness, slot) * approach / squared
        fx, fy, fz = fx + pull * dx, fy + pull * dy, fz + pull * dz
        slot += WIDTH
    return times(retardation_time, summed(fx, fy, fz))


@inlined
def elastic_and_damping_force(
    springs: Springs,
    node: int,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float,
) -> Point:
    """Return the sum of `elastic_force` and `damping_force` [N], in one pass over the row.

    Args:
        springs: The rows.
        node: The node.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        retardation_time: Viscosity per stiffness [s].
    """
    x, y, z = lanes(positions[node, 0]), lanes(positions[node, 1]), lanes(positions[node, 2])
    u, v, w = lanes(velocities[node, 0]), lanes(velocities[node, 1]), lanes(velocities[node, 2])
    time, one = lanes(retardation_time), lanes(1.0)
    fx = fy = fz = lanes(0.0)
    slot = springs.first[node]
    end = slot + springs.count[node]
    while slot < end:
        dx, dy, dz = eight_points(positions, springs.neighbour, slot)
        dx, dy, dz = dx - x, dy - y, dz - z
        du, dv, dw = eight_points(velocities, springs.neighbour, slot)
        approach = (du - u) * dx + (dv - v) * dy + (dw - w) * dz
        inverse = one / square_root(dx * dx + dy * dy + dz * dz + lanes(NO_LENGTH))
        stiffness = load_lanes(springs.stiffness, slot)
        pull = stiffness - load_lanes(springs.rest_pull, slot) * inverse
        pull = pull + stiffness * (time * approach * inverse * inverse)
        fx, fy, fz = fx + pull * dx, fy + pull * dy, fz + pull * dz
        slot += WIDTH
    return summed(fx, fy, fz)
