"""Forces of tetrahedra under a stable neo-Hookean law, a block of tetrahedra at a time.

Laws that stiffen differ in the factor of the shear alone (`tissue.laws.kernels`).

With H the gradient of the displacement, F = 1 + H, K = cof F - 1 = (tr H) 1 - H^T + cof H and
|F|^2 - 3 = 2 tr H + |H|^2, the force on node k is -V P grad N_k, where

    P = mu (1 - 1 / (|F|^2 + 1)) F + lam (J - a) cof F

What is not zero at rest cancels, which leaves

    s = mu (|F|^2 - 3) / (4 (|F|^2 + 1)),   p = lam (J - 1)
    P = (3/4 mu + s) H + (p - 3/4 mu) K + (s + p) 1

every term of which is small where the strain is. The pressure p is that of the tetrahedron, or the
mean of those at its nodes, where J is averaged over the tetrahedra around the node: the exact
gradient of the energy either way. Where stress relaxes, F R + r cof F is taken from P
(`tissue.elasticity.relaxed_stress`).

Four loops: displacements of nodes, gradients of blocks, pressures of nodes, forces of blocks; then
the force on a node is the sum over its row. Threads may share a loop, each taking a part of it.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, Point, point, point_of
from tissue.core.simd_blocks import (
    load_block,
    points_of_rows,
    splat,
    store_block,
    store_everywhere,
    store_row,
    store_rows,
    sum_of_eight_rows,
    values_of_rows,
    width_of,
)
from tissue.core.simd_rows import natural, sum_of_eight
from tissue.core.vec3 import Vec3, add, cross, dot, scale
from tissue.elasticity.finite_elements import N_SHAPE, VOLUME, Solid
from tissue.elasticity.relaxed_stress import relaxed_pressure, relaxes, with_relaxed
from tissue.laws.kernels import isotropic_factor, stiffening_factor, stiffens, stretch_invariant
from tissue.mesh.body import Body

NO_VOLUME = 1e-30
"""Added to volumes [m3], far below any: rows without a tetrahedron have none."""


@kernel
def solid_forces(
    solid: Solid,
    body: Body,
    positions: FloatArray,
    blocks: IntArray,
    n_blocks: int,
    nodes: IntArray,
    n_nodes: int,
) -> None:
    """Run all loops, so that `solid_force` gives the force on a node.

    For the forces on some nodes only, `blocks` are those of the tetrahedra around them, and `nodes`
    the nodes of those tetrahedra. Where volumes are averaged, `solid.dilated` must then be up to
    date around all of these.

    Args:
        solid: Scratch is written.
        body: Rest positions.
        positions: Positions of the nodes [m].
        blocks: Blocks of tetrahedra.
        n_blocks: How many of them.
        nodes: Nodes that the blocks read.
        n_nodes: How many of them.
    """
    displacements(solid, body, positions, nodes, 0, n_nodes)
    displacement_gradients(solid, blocks, 0, n_blocks)
    if has_averaged_volumes(solid):
        pressures(solid, nodes, 0, n_nodes)
    corner_forces(solid, blocks, 0, n_blocks)


@inlined
def solid_force(solid: Solid, node: int) -> Point:
    """Return the force of the tetrahedra around a node on it [N], from `corner_forces`."""
    total = point_of(0.0, 0.0, 0.0)
    slot = solid.first[node]
    end = slot + solid.count[node]
    while slot < end:
        total = total + sum_of_eight_rows(solid.forces, solid.corner, slot)
        slot += WIDTH
    return total


@kernel
def has_averaged_volumes(solid: Solid) -> bool:
    """Return whether forces need the loop `pressures`."""
    return solid.law.lam_of_nodes != 0.0


@kernel
def displacements(
    solid: Solid, body: Body, positions: FloatArray, nodes: IntArray, begin: int, end: int
) -> None:
    """Write the displacements of `nodes[begin:end]` from rest to `positions` [m].

    Args:
        solid: Written.
        body: Rest positions.
        positions: Positions of the nodes [m].
        nodes: The nodes.
        begin: First of them.
        end: End of them.
    """
    for i in range(begin, end):
        node = natural(nodes[i])
        store_row(solid.displacement, node, point(positions, node) - point(body.rest, node))


@kernel
def displacement_gradients(solid: Solid, blocks: IntArray, begin: int, end: int) -> None:
    """Write H, V (J - 1) and `Solid.stiffening` of `blocks[begin:end]`, after `displacements`."""
    # Two loops, so that the code of each is without a branch.
    if stiffens(solid.law):
        for i in range(begin, end):
            _write_gradient(solid, blocks[i], True)
    else:
        for i in range(begin, end):
            _write_gradient(solid, blocks[i], False)


@inlined
def _write_gradient(solid: Solid, block: int, has_stiffened: bool) -> None:
    """Write what `displacement_gradients` does of a block; `has_stiffened` is a constant there.

    In `corner_forces` a long chain of operations would wait for the factor of the shear: for a
    division, or an exponential.
    """
    law, width = solid.law, width_of(solid.shape)
    x, y, z = gradient_of_displacement(solid, block)
    if keeps_gradients(solid):
        at = 9 * width * block
        _store_vector(solid, at, x)
        _store_vector(solid, at + 3 * width, y)
        _store_vector(solid, at + 6 * width, z)
    cofactors = cofactors_of(x, y, z)
    place = width * (1 + block)
    store_block(solid.dilated, place, _dilated(solid, block, x, y, z, cofactors))
    if has_stiffened:
        factor = stiffening_factor(law, stretch_invariant(x, y, z, *cofactors))
    else:
        factor = isotropic_factor(law, x.x + y.y + z.z, x, y, z)
    store_block(solid.stiffening, place, factor)


@kernel
def pressures(solid: Solid, nodes: IntArray, begin: int, end: int) -> None:
    """Write lam (J - 1) of `nodes[begin:end]`, from the volumes around them."""
    for i in range(begin, end):
        _write_pressure(solid, natural(nodes[natural(i)]))


@kernel
def pressures_in_order(solid: Solid, begin: int, end: int) -> None:
    """Write lam (J - 1) of the nodes from `begin` to `end`: `pressures` without a list."""
    for node in range(begin, end):
        _write_pressure(solid, natural(node))


@inlined
def _write_pressure(solid: Solid, node: int) -> None:
    grown = dilated_around(solid, node) / solid.node_volume[node]
    store_everywhere(solid.pressure, node, solid.law.lam_of_nodes * grown)


@kernel
def corner_forces(solid: Solid, blocks: IntArray, begin: int, end: int) -> None:
    """Write the forces on the corners of the tetrahedra of `blocks[begin:end]`.

    Args:
        solid: Written; gradients, and pressures where volumes are averaged, are up to date.
        blocks: Blocks of tetrahedra.
        begin: First block, as an index in `blocks`.
        end: End of the blocks.
    """
    # Two loops, so that the code of elastic blocks is without a branch.
    if relaxes(solid):
        for i in range(begin, end):
            _corner_forces_of(solid, blocks[i], True)
    else:
        for i in range(begin, end):
            _corner_forces_of(solid, blocks[i], False)


@inlined
def _corner_forces_of(solid: Solid, block: int, has_relaxed: bool) -> None:
    """Write the forces on the corners of the tetrahedra of a block.

    Args:
        solid: Written.
        block: The block.
        has_relaxed: Whether stress has relaxed in it; a constant where this is called.
    """
    law, width = solid.law, width_of(solid.shape)
    x, y, z = known_gradient(solid, block)
    v = shape_of(solid, block, VOLUME)
    p = pressure_of(solid, block, v)
    if has_relaxed:
        p = p - relaxed_pressure(solid, block)
    trace = x.x + y.y + z.z
    cx, cy, cz = cofactors_of(x, y, z)
    factor = load_block(solid.stiffening, width * (1 + block))
    if stiffens(law):
        rest = splat(law.mu, v) * factor
        s = splat(0.0, v)
    else:
        s = factor
        rest = splat(0.75 * law.mu, v)
    # The factors of H, K and 1, times -V:
    minus_v = splat(-1.0, v) * v
    a, b, c = (rest + s) * minus_v, (p - rest) * minus_v, (s + p) * minus_v
    px = Vec3(
        a * x.x + b * (trace - x.x + cx.x) + c,
        a * x.y + b * (cx.y - y.x),
        a * x.z + b * (cx.z - z.x),
    )
    py = Vec3(
        a * y.x + b * (cy.x - x.y),
        a * y.y + b * (trace - y.y + cy.y) + c,
        a * y.z + b * (cy.z - z.y),
    )
    pz = Vec3(
        a * z.x + b * (cz.x - x.z),
        a * z.y + b * (cz.y - y.z),
        a * z.z + b * (trace - z.z + cz.z) + c,
    )
    if has_relaxed:
        px, py, pz = with_relaxed(solid, block, v, (px, py, pz), (x, y, z))
    f1 = _product(px, py, pz, gradient_of_shape(solid, block, 0))
    f2 = _product(px, py, pz, gradient_of_shape(solid, block, 3))
    f3 = _product(px, py, pz, gradient_of_shape(solid, block, 6))
    f0 = scale(splat(-1.0, v), add(f1, add(f2, f3)))
    row = 4 * width * (1 + block)
    store_rows(solid.forces, row, f0.x, f0.y, f0.z)
    store_rows(solid.forces, row + width, f1.x, f1.y, f1.z)
    store_rows(solid.forces, row + 2 * width, f2.x, f2.y, f2.z)
    store_rows(solid.forces, row + 3 * width, f3.x, f3.y, f3.z)


@inlined
def pressure_of(solid: Solid, block: int, v: Lanes) -> Lanes:
    """Return the elastic pressures p of the tetrahedra of a block [Pa], of volumes `v` [m3]."""
    law, p = solid.law, splat(0.0, v)
    if law.lam_of_nodes != 0.0:
        p = splat(0.25, v) * _pressure_of_nodes(solid, block)
    if law.lam_of_tetrahedra != 0.0:
        p = p + splat(law.lam_of_tetrahedra, v) * own_dilatation(solid, block, v)
    return p


@inlined
def own_dilatation(solid: Solid, block: int, v: Lanes) -> Lanes:
    """Return J - 1 of the tetrahedra of a block by themselves, after `displacement_gradients`."""
    dilated = load_block(solid.dilated, width_of(solid.shape) * (1 + block))
    return dilated / (v + splat(NO_VOLUME, v))


@inlined
def gradient_of_displacement(solid: Solid, block: int) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of H of the tetrahedra of a block, after `displacements`."""
    x0, y0, z0 = _corners(solid, block, 0)
    x1, y1, z1 = _corners(solid, block, 1)
    x2, y2, z2 = _corners(solid, block, 2)
    x3, y3, z3 = _corners(solid, block, 3)
    g1 = gradient_of_shape(solid, block, 0)
    g2 = gradient_of_shape(solid, block, 3)
    g3 = gradient_of_shape(solid, block, 6)
    return (
        _row_of_gradient(x1 - x0, x2 - x0, x3 - x0, g1, g2, g3),
        _row_of_gradient(y1 - y0, y2 - y0, y3 - y0, g1, g2, g3),
        _row_of_gradient(z1 - z0, z2 - z0, z3 - z0, g1, g2, g3),
    )


@inlined
def keeps_gradients(solid: Solid) -> bool:
    """Return whether H is kept between two loops over the tetrahedra, not computed twice.

    In single precision that takes a sixth less time. Doubles would not fit the cache.
    """
    return width_of(solid.shape) > WIDTH


@inlined
def known_gradient(solid: Solid, block: int) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of H of the tetrahedra of a block, after `displacement_gradients`."""
    if keeps_gradients(solid):
        width = width_of(solid.shape)
        at = 9 * width * block
        return (
            _load_vector(solid, at),
            _load_vector(solid, at + 3 * width),
            _load_vector(solid, at + 6 * width),
        )
    return gradient_of_displacement(solid, block)


@inlined
def _row_of_gradient(d1: Lanes, d2: Lanes, d3: Lanes, g1: Vec3, g2: Vec3, g3: Vec3) -> Vec3:
    return Vec3(
        d1 * g1.x + d2 * g2.x + d3 * g3.x,
        d1 * g1.y + d2 * g2.y + d3 * g3.y,
        d1 * g1.z + d2 * g2.z + d3 * g3.z,
    )


@inlined
def cofactors_of(x: Vec3, y: Vec3, z: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of cof H from the rows of H."""
    return cross(y, z), cross(z, x), cross(x, y)


@inlined
def _dilated(
    solid: Solid, block: int, x: Vec3, y: Vec3, z: Vec3, cofactors: tuple[Vec3, Vec3, Vec3]
) -> Lanes:
    """Return V (J - 1) of the tetrahedra of a block, J - 1 = tr H + tr cof H + det H."""
    cx, cy, cz = cofactors
    growth = (x.x + y.y + z.z) + (cx.x + cy.y + cz.z) + dot(x, cx)
    return shape_of(solid, block, VOLUME) * growth


@inlined
def _product(px: Vec3, py: Vec3, pz: Vec3, g: Vec3) -> Vec3:
    return Vec3(dot(px, g), dot(py, g), dot(pz, g))


@inlined
def _corners(solid: Solid, block: int, k: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return the displacements of corner `k` of the tetrahedra of a block."""
    width = width_of(solid.shape)
    return points_of_rows(solid.displacement, solid.nodes, width * (4 * block + k))


@inlined
def _store_vector(solid: Solid, at: int, v: Vec3) -> None:
    width = width_of(solid.shape)
    store_block(solid.gradient, at, v.x)
    store_block(solid.gradient, at + width, v.y)
    store_block(solid.gradient, at + 2 * width, v.z)


@inlined
def _load_vector(solid: Solid, at: int) -> Vec3:
    width = width_of(solid.shape)
    return Vec3(
        load_block(solid.gradient, at),
        load_block(solid.gradient, at + width),
        load_block(solid.gradient, at + 2 * width),
    )


@inlined
def shape_of(solid: Solid, block: int, which: int) -> Lanes:
    """Return a quantity of `Solid.shape` for the tetrahedra of a block."""
    return load_block(solid.shape, width_of(solid.shape) * (N_SHAPE * block + which))


@inlined
def gradient_of_shape(solid: Solid, block: int, first: int) -> Vec3:
    """Return the gradient of a shape function [1/m], which begins at that quantity of `shape`."""
    return Vec3(
        shape_of(solid, block, first),
        shape_of(solid, block, first + 1),
        shape_of(solid, block, first + 2),
    )


@inlined
def _pressure_of_nodes(solid: Solid, block: int) -> Lanes:
    """Return the sum of the pressures at the four nodes [Pa]."""
    width, rows, nodes = width_of(solid.shape), solid.pressure, solid.nodes
    first = 4 * width * block
    ends = values_of_rows(rows, nodes, first) + values_of_rows(rows, nodes, first + width)
    others = values_of_rows(rows, nodes, first + 2 * width)
    return ends + (others + values_of_rows(rows, nodes, first + 3 * width))


@inlined
def dilated_around(solid: Solid, node: int) -> float:
    """Return a quarter of V (J - 1) of the tetrahedra around a node [m3]."""
    total = 0.0
    slot = solid.first[node]
    end = slot + solid.count[node]
    while slot < end:
        total += sum_of_eight(solid.dilated, solid.around, slot)
        slot += WIDTH
    return 0.25 * total
