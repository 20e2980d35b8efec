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
gradient of the energy either way. Of the other terms a share may be averaged in the same way
(`tissue.elasticity.averaged_shear`). Where stress relaxes, F R + r cof F is taken from P
(`tissue.elasticity.relaxed_stress`).

Four loops: displacements of nodes, gradients of blocks, averages of nodes, forces of blocks; then
the force on a node is the sum over its row. Threads may share a loop, each taking a part of it.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, Point, point_of
from tissue.core.simd_blocks import load_block, splat, store_block, width_of
from tissue.core.simd_points import (
    store_everywhere,
    store_rows,
    sum_of_eight_rows,
    values_of_rows,
)
from tissue.core.simd_rows import natural, sum_of_eight
from tissue.core.vec3 import Vec3, add, axpy, dot, scale
from tissue.elasticity.averaged_shear import (
    average_around_nodes,
    store_gradients,
    stress_of_nodes,
)
from tissue.elasticity.finite_elements import (
    VOLUME,
    Solid,
    averages_shear,
    is_graded,
    n_blocks,
)
from tissue.elasticity.graded import law_of_block, modulus_of_node, own_lam_of, own_share_of
from tissue.elasticity.gradients import (
    displacements,
    gradient_of_displacement,
    gradient_of_shape,
    keep_gradient,
    keeps_gradients,
    known_gradient,
    shape_of,
)
from tissue.elasticity.relaxed_stress import relaxed_pressure, relaxes, with_relaxed
from tissue.elasticity.stress import MatrixRows, cofactors_of, product_with, stress_of
from tissue.laws.kernels import isotropic_factor, stiffening_factor, stiffens, stretch_invariant
from tissue.mesh.body import Body

NO_VOLUME = 1e-30
"""Added to volumes [m3], far below any: rows without a tetrahedron have none."""


@kernel
def solid_forces(solid: Solid, body: Body, positions: FloatArray) -> None:
    """Run all loops, so that `solid_force` gives the force on a node.

    Args:
        solid: Scratch is written.
        body: Rest positions.
        positions: Positions of the nodes [m].
    """
    deform_solid(solid, body, positions)
    corner_forces(solid, 0, n_blocks(solid, body.n_tetrahedra))


@kernel
def deform_solid(solid: Solid, body: Body, positions: FloatArray) -> None:
    """Write gradients of the tetrahedra at `positions` [m], and what is averaged around nodes."""
    displacements(solid, body, positions, 0, body.n_nodes)
    displacement_gradients(solid, 0, n_blocks(solid, body.n_tetrahedra))
    if has_averages(solid):
        average_volumes(solid, 0, body.n_nodes)


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
def has_averages(solid: Solid) -> bool:
    """Return whether forces need the loop `average_volumes`."""
    return solid.law.lam_of_nodes != 0.0


@kernel
def displacement_gradients(solid: Solid, begin: int, end: int) -> None:
    """Write H, V (J - 1) and `Solid.stiffening` of the blocks from `begin` to `end`.

    After `displacements`.
    """
    # Loops of their own, so that the code of each is without a branch.
    if averages_shear(solid):
        if stiffens(solid.law):
            for block in range(begin, end):
                _write_gradient(solid, natural(block), True, True)
        else:
            for block in range(begin, end):
                _write_gradient(solid, natural(block), False, True)
    elif stiffens(solid.law):
        for block in range(begin, end):
            _write_gradient(solid, natural(block), True, False)
    else:
        for block in range(begin, end):
            _write_gradient(solid, natural(block), False, False)


@inlined
def _write_gradient(solid: Solid, block: int, has_stiffened: bool, is_averaged: bool) -> None:
    """Write what `displacement_gradients` does of a block.

    In `corner_forces` a long chain of operations would wait for the factor of the shear: for a
    division, or an exponential.

    Args:
        solid: Written.
        block: The block.
        has_stiffened: Whether the law stiffens; a constant where this is called.
        is_averaged: Whether a share of the shear is averaged around nodes; a constant, too.
    """
    width = width_of(solid.shape)
    x, y, z = gradient_of_displacement(solid, block)
    if keeps_gradients(solid):
        keep_gradient(solid, block, (x, y, z))
    cofactors = cofactors_of(x, y, z)
    place = width * (1 + block)
    v = shape_of(solid, block, VOLUME)
    dilated = _dilated(v, x, y, z, cofactors)
    store_block(solid.dilated, place, dilated)
    q = stretch_invariant(x, y, z, *cofactors)
    if is_averaged:
        store_gradients(solid, block, v, (x, y, z), dilated, q)
    law = law_of_block(solid, block, q)
    if has_stiffened:
        factor = stiffening_factor(law, q)
    else:
        factor = isotropic_factor(law, x.x + y.y + z.z, x, y, z)
    store_block(solid.stiffening, place, factor)


@kernel
def average_volumes(solid: Solid, begin: int, end: int) -> None:
    """Write what is averaged around the nodes from `begin` to `end`, from the tetrahedra there.

    That is lam (J - 1), and the stress of averaged shear; `begin` is a multiple of eight.
    """
    if averages_shear(solid):
        average_around_nodes(solid, begin, end)
    else:
        for node in range(begin, end):
            _write_pressure(solid, natural(node))


@inlined
def _write_pressure(solid: Solid, node: int) -> None:
    grown = dilated_around(solid, node) / solid.node_volume[node]
    store_everywhere(solid.pressure, node, modulus_of_node(solid, node) * grown)


@kernel
def corner_forces(solid: Solid, begin: int, end: int) -> None:
    """Write the forces on the corners of the tetrahedra of the blocks from `begin` to `end`.

    Gradients, and what is averaged around nodes, are up to date.
    """
    # Loops of their own, so that the code of each is without a branch.
    if averages_shear(solid) and relaxes(solid):
        for block in range(begin, end):
            _corner_forces_of(solid, natural(block), True, True)
    elif averages_shear(solid):
        for block in range(begin, end):
            _corner_forces_of(solid, natural(block), False, True)
    elif relaxes(solid):
        for block in range(begin, end):
            _corner_forces_of(solid, natural(block), True, False)
    else:
        for block in range(begin, end):
            _corner_forces_of(solid, natural(block), False, False)


@inlined
def _corner_forces_of(solid: Solid, block: int, has_relaxed: bool, is_averaged: bool) -> None:
    """Write the forces on the corners of the tetrahedra of a block.

    Args:
        solid: Written.
        block: The block.
        has_relaxed: Whether stress has relaxed in it; a constant where this is called.
        is_averaged: Whether a share of the shear is averaged around nodes; a constant, too.
    """
    law, width = solid.law, width_of(solid.shape)
    x, y, z = known_gradient(solid, block)
    v = shape_of(solid, block, VOLUME)
    if is_averaged:
        mean, p, taken = stress_of_nodes(solid, block, v)
        p = with_own_pressure(solid, block, v, p)
    else:
        p = pressure_of(solid, block, v)
    if has_relaxed:
        p = p - relaxed_pressure(solid, block)
    cofactors = cofactors_of(x, y, z)
    factor, mu = load_block(solid.stiffening, width * (1 + block)), law_of_block(solid, block, v).mu
    if stiffens(law):
        rest = mu * factor
        s = splat(0.0, v)
    else:
        s = factor
        rest = splat(0.75, v) * mu
    if is_averaged:
        own = own_share_of(solid, block, v)
        s, rest = own * s, own * rest + taken
    # The factors of H, K and 1, times -V:
    minus_v = splat(-1.0, v) * v
    a, b, c = (rest + s) * minus_v, (p - rest) * minus_v, (s + p) * minus_v
    px, py, pz = stress_of(a, b, c, (x, y, z), cofactors)
    if is_averaged:
        px, py, pz = (
            axpy(minus_v, mean[0], px),
            axpy(minus_v, mean[1], py),
            axpy(minus_v, mean[2], pz),
        )
    if has_relaxed:
        px, py, pz = with_relaxed(solid.relaxed, width * block, v, (px, py, pz), (x, y, z))
    g1 = gradient_of_shape(solid, block, 0)
    g2 = gradient_of_shape(solid, block, 3)
    g3 = gradient_of_shape(solid, block, 6)
    store_corner_forces(solid, block, (px, py, pz), (g1, g2, g3))


@inlined
def store_corner_forces(solid: Solid, block: int, stress: MatrixRows, normals: MatrixRows) -> None:
    """Write the forces on the corners of the tetrahedra of a block [N].

    Args:
        solid: Written.
        block: The block.
        stress: Rows of -V times a stress [N m].
        normals: The directions 1, 2 and 3 that it acts across [1/m]; that of corner 0 is minus
            their sum.
    """
    width = width_of(solid.shape)
    n1, n2, n3 = normals
    f1, f2 = product_with(stress, n1), product_with(stress, n2)
    f3 = product_with(stress, n3)
    f0 = scale(splat(-1.0, f1.x), add(f1, add(f2, f3)))
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
        p = splat(0.25, v) * sum_of_corners(solid, solid.pressure, block)
    return with_own_pressure(solid, block, v, p)


@inlined
def with_own_pressure(solid: Solid, block: int, v: Lanes, p: Lanes) -> Lanes:
    """Return pressures with those that follow from J of each tetrahedron by itself [Pa]."""
    if is_graded(solid) or solid.law.lam_of_tetrahedra != 0.0:
        p = p + own_lam_of(solid, block, v) * own_dilatation(solid, block, v)
    return p


@inlined
def own_dilatation(solid: Solid, block: int, v: Lanes) -> Lanes:
    """Return J - 1 of the tetrahedra of a block by themselves, after `displacement_gradients`."""
    dilated = load_block(solid.dilated, width_of(solid.shape) * (1 + block))
    return dilated / (v + splat(NO_VOLUME, v))


@inlined
def _dilated(v: Lanes, x: Vec3, y: Vec3, z: Vec3, cofactors: MatrixRows) -> Lanes:
    """Return V (J - 1) of the tetrahedra of a block, J - 1 = tr H + tr cof H + det H.

    Args:
        v: Volumes [m3].
        x: First row of H.
        y: Second row.
        z: Third row.
        cofactors: Rows of cof H.
    """
    cx, cy, cz = cofactors
    growth = (x.x + y.y + z.z) + (cx.x + cy.y + cz.z) + dot(x, cx)
    return v * growth


@inlined
def sum_of_corners(solid: Solid, rows: FloatArray, block: int) -> Lanes:
    """Return the sum of what `rows` have averaged at the corners of the tetrahedra of a block."""
    width, sites = width_of(solid.shape), solid.sites if is_graded(solid) else solid.nodes
    first = 4 * width * block
    ends = values_of_rows(rows, sites, first) + values_of_rows(rows, sites, first + width)
    others = values_of_rows(rows, sites, first + 2 * width)
    return ends + (others + values_of_rows(rows, sites, first + 3 * width))


@inlined
def dilated_around(solid: Solid, node: int) -> float:
    """Return a quarter of V (J - 1) of the tetrahedra around a node [m3]."""
    return 0.25 * sum_around(solid, solid.dilated, node)


@inlined
def sum_around(solid: Solid, values: FloatArray, node: int) -> float:
    """Return the sum of `values` of the tetrahedra around a node, which are behind a block."""
    total = 0.0
    slot = solid.first[node]
    end = slot + solid.count[node]
    while slot < end:
        total += sum_of_eight(values, solid.around, slot)
        slot += WIDTH
    return total
