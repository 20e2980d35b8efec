"""Forces of tetrahedra under a stable neo-Hookean law, a block of eight tetrahedra at a time.

With d_i = x_i - x_0, the products of `Solid.shape`, e_i = sum over j of (V grad N_i . grad N_j) d_j
and the cofactors n_1 = d_2 x d_3, n_2 = d_3 x d_1, n_3 = d_1 x d_2, the forces on nodes 1, 2, 3 are

    f_i = -(mu (1 - 1 / (|F|^2 + 1)) e_i + p n_i / 6),     f_0 = -(f_1 + f_2 + f_3)

(V grad N_i times P = mu (1 - 1 / (|F|^2 + 1)) F + p cof F). The pressure p = lam (J - a) is that of
the tetrahedron, or the mean of those at its nodes, where J is averaged over the tetrahedra around
the node: the exact gradient of the energy either way.

Three loops, each over a list: volumes of blocks, pressures of nodes, forces of blocks; then the
force on a node is the sum over its row. Threads may share a loop, each taking a part of its list.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import (
    WIDTH,
    Lanes,
    Point,
    eight_points,
    lanes,
    load_lanes,
    logarithm,
    point_of,
    store_lanes,
)
from tissue.core.simd_gather import gathered, sum_of_eight, sum_of_eight_points
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, scale, sub
from tissue.elasticity.finite_elements import (
    PER_VOLUME,
    VOLUME,
    Solid,
    corner_place,
    n_blocks,
)


@kernel
def solid_forces(
    solid: Solid,
    positions: FloatArray,
    blocks: IntArray,
    n_blocks: int,
    nodes: IntArray,
    n_nodes: int,
) -> None:
    """Run all three loops, so that `solid_force` gives the force on a node.

    For the forces on some nodes only, `blocks` are those of the tetrahedra around them. Where
    volumes are averaged, `nodes` are then the nodes of those tetrahedra, and `solid.volume` must be
    up to date around all of these.

    Args:
        solid: Volumes, pressures and forces are written.
        positions: Positions of the nodes [m].
        blocks: Blocks of tetrahedra.
        n_blocks: How many of them.
        nodes: Nodes whose pressure is needed.
        n_nodes: How many of them.
    """
    if has_averaged_volumes(solid):
        volumes(solid, positions, blocks, 0, n_blocks)
        pressures(solid, nodes, 0, n_nodes)
    corner_forces(solid, positions, blocks, 0, n_blocks)


@inlined
def solid_force(solid: Solid, node: int) -> Point:
    """Return the force of the tetrahedra around a node on it [N], from `corner_forces`."""
    total = point_of(0.0, 0.0, 0.0)
    first = solid.first[node]
    for slot in range(first, first + solid.count[node], WIDTH):
        total = total + sum_of_eight_points(solid.forces, solid.corner, slot)
    return total


@kernel
def has_averaged_volumes(solid: Solid) -> bool:
    """Return whether forces need the first two loops, `volumes` and `pressures`."""
    return solid.law.lam_of_nodes != 0.0


@kernel
def volumes(solid: Solid, positions: FloatArray, blocks: IntArray, begin: int, end: int) -> None:
    """Write the signed volumes of tetrahedra to `solid.volume`.

    Args:
        solid: Written.
        positions: Positions of the nodes [m].
        blocks: Blocks of tetrahedra.
        begin: First block, as an index in `blocks`.
        end: End of the blocks.
    """
    for i in range(begin, end):
        block = blocks[i]
        d1, d2, d3 = edges(solid, positions, block)
        store_lanes(solid.volume, WIDTH * (1 + block), lanes(1.0 / 6.0) * dot(d1, cross(d2, d3)))


@kernel
def pressures(solid: Solid, nodes: IntArray, begin: int, end: int) -> None:
    """Write lam (J - a) of `nodes[begin:end]` to `solid.pressure`, from the volumes around them."""
    lam, a = solid.law.lam_of_nodes, solid.law.a
    for i in range(begin, end):
        node = nodes[i]
        solid.pressure[node] = lam * (_volume_around(solid, node) / solid.node_volume[node] - a)


@kernel
def corner_forces(
    solid: Solid, positions: FloatArray, blocks: IntArray, begin: int, end: int
) -> None:
    """Write the forces on the corners of tetrahedra to `solid.forces`.

    Args:
        solid: Written; volumes and pressures are up to date where volumes are averaged.
        positions: Positions of the nodes [m].
        blocks: Blocks of tetrahedra.
        begin: First block, as an index in `blocks`.
        end: End of the blocks.
    """
    law = solid.law
    for i in range(begin, end):
        block = blocks[i]
        d1, d2, d3 = edges(solid, positions, block)
        n1, n2, n3 = cross(d2, d3), cross(d3, d1), cross(d1, d2)
        p = lanes(0.0)
        if law.lam_of_nodes != 0.0:
            p = lanes(0.25) * _pressure_of_nodes(solid, block)
        if law.lam_of_tetrahedra != 0.0:
            dilatation = lanes(1.0 / 6.0) * dot(d1, n1) * shape_of(solid, block, PER_VOLUME)
            p = p + lanes(law.lam_of_tetrahedra) * (dilatation - lanes(law.a))
        p = lanes(-1.0 / 6.0) * p
        f1, f2, f3 = scale(p, n1), scale(p, n2), scale(p, n3)
        if law.mu != 0.0:
            e1, e2, e3 = _weighted(solid, block, d1, d2, d3)
            squared = dot(d1, e1) + dot(d2, e2) + dot(d3, e3)  # V |F|^2
            s = lanes(-law.mu) * squared / (squared + shape_of(solid, block, VOLUME))
            f1, f2, f3 = axpy(s, e1, f1), axpy(s, e2, f2), axpy(s, e3, f3)
        f0 = scale(lanes(-1.0), add(f1, add(f2, f3)))
        _store(solid, block, 0, f0)
        _store(solid, block, 1, f1)
        _store(solid, block, 2, f2)
        _store(solid, block, 3, f3)


@inlined
def _store(solid: Solid, block: int, k: int, force: Vec3) -> None:
    """Write the forces on corners `k` of eight tetrahedra."""
    place = corner_place(WIDTH * block, k)
    store_lanes(solid.forces, place, force.x)
    store_lanes(solid.forces, place + WIDTH, force.y)
    store_lanes(solid.forces, place + 2 * WIDTH, force.z)


@inlined
def edges(solid: Solid, positions: FloatArray, block: int) -> tuple[Vec3, Vec3, Vec3]:
    """Return the edges from node 0 to nodes 1, 2 and 3 of eight tetrahedra, as `Lanes`."""
    x0 = _corners(solid, positions, block, 0)
    return (
        sub(_corners(solid, positions, block, 1), x0),
        sub(_corners(solid, positions, block, 2), x0),
        sub(_corners(solid, positions, block, 3), x0),
    )


@inlined
def _corners(solid: Solid, positions: FloatArray, block: int, k: int) -> Vec3:
    x, y, z = eight_points(positions, solid.nodes, WIDTH * (4 * block + k))
    return Vec3(x, y, z)


@inlined
def shape_of(solid: Solid, block: int, which: int) -> Lanes:
    """Return a quantity of `Solid.shape` for eight tetrahedra."""
    return load_lanes(solid.shape, WIDTH * (WIDTH * block + which))


@inlined
def _weighted(solid: Solid, block: int, d1: Vec3, d2: Vec3, d3: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return e_i = sum over j of (V grad N_i . grad N_j) d_j [m2], for i = 1, 2, 3."""
    k11, k22, k33 = shape_of(solid, block, 0), shape_of(solid, block, 1), shape_of(solid, block, 2)
    k12, k13, k23 = shape_of(solid, block, 3), shape_of(solid, block, 4), shape_of(solid, block, 5)
    return (
        axpy(k11, d1, axpy(k12, d2, scale(k13, d3))),
        axpy(k12, d1, axpy(k22, d2, scale(k23, d3))),
        axpy(k13, d1, axpy(k23, d2, scale(k33, d3))),
    )


@inlined
def _pressure_of_nodes(solid: Solid, block: int) -> Lanes:
    """Return the sum of the pressures at the four nodes [Pa]."""
    first = 4 * WIDTH * block
    ends = gathered(solid.pressure, solid.nodes, first)
    ends = ends + gathered(solid.pressure, solid.nodes, first + WIDTH)
    others = gathered(solid.pressure, solid.nodes, first + 2 * WIDTH)
    return ends + (others + gathered(solid.pressure, solid.nodes, first + 3 * WIDTH))


@inlined
def _volume_around(solid: Solid, node: int) -> float:
    """Return a quarter of the volume of the tetrahedra around a node, from `solid.volume` [m3]."""
    total = 0.0
    first = solid.first[node]
    for slot in range(first, first + solid.count[node], WIDTH):
        total += sum_of_eight(solid.volume, solid.around, slot)
    return 0.25 * total


@kernel
def solid_energy(solid: Solid, positions: FloatArray, n_tetrahedra: int, n_nodes: int) -> float:
    """Return the elastic energy of the body at `positions` [m], less that at rest [J]."""
    law = solid.law
    n = n_blocks(n_tetrahedra)
    volumes(solid, positions, solid.every, 0, n)
    total = lanes(0.0)
    for block in range(n - 1):
        total = total + _energies(solid, positions, block)
    store_lanes(solid.growth, 0, total)
    store_lanes(solid.growth, WIDTH, _energies(solid, positions, n - 1))
    energy = 0.0
    for lane in range(WIDTH + n_tetrahedra - WIDTH * (n - 1)):  # the last block may not be full
        energy += solid.growth[lane]
    at_rest = (1.0 - law.a) ** 2
    for node in range(n_nodes):
        v = solid.node_volume[node]
        j = _volume_around(solid, node) / v
        energy += 0.5 * law.lam_of_nodes * v * ((j - law.a) ** 2 - at_rest)
    return energy


@inlined
def _energies(solid: Solid, positions: FloatArray, block: int) -> Lanes:
    """Return the energies of eight tetrahedra by themselves [J], after `volumes`."""
    law, v = solid.law, shape_of(solid, block, VOLUME)
    d1, d2, d3 = edges(solid, positions, block)
    e1, e2, e3 = _weighted(solid, block, d1, d2, d3)
    per_volume, one = shape_of(solid, block, PER_VOLUME), lanes(1.0)
    squared = (dot(d1, e1) + dot(d2, e2) + dot(d3, e3)) * per_volume  # |F|^2
    shear = squared - lanes(3.0) - logarithm(lanes(0.25) * (squared + one))
    change = load_lanes(solid.volume, WIDTH * (1 + block)) * per_volume - lanes(law.a)
    bulk = change * change - lanes((1.0 - law.a) ** 2)
    return v * (lanes(0.5 * law.mu) * shear + lanes(0.5 * law.lam_of_tetrahedra) * bulk)
