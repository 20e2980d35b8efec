"""Viscous forces of tetrahedra, at rest the retardation time times their stiffness there.

A continuum that resists its rate of deformation (Kelvin-Voigt). With n_k = cof F grad N_k, the
gradient of a shape function as the face opposite node k is now, and u_k the velocity of the node

    J d = sym(sum of u_k n_k^T)              the rate of deformation times J; its trace is J'
    T = 2 mu (J d) + lam tr(J d) 1           f_k = -tau V T n_k

so that the stress of Cauchy is tau T: a dashpot of constant viscosity. T is symmetric and d knows
no rotation, so momentum and angular momentum are kept. The forces are -B^T C B of the velocities:
they never do work. In motion that keeps the volume lam does nothing, however large the strain is.

Shear and volume are shared between each tetrahedron and averages around nodes as the elastic terms
are at small strain (`tissue.elasticity.stiffness_matrix`), so that each mode of the body dies away
by half of tau times its angular frequency, whichever the element is. A law may leave tetrahedra a
negative bulk modulus of their own, which averages make good: here it is 0, and averages have less.
What is smooth is damped as much; modes of a block of three cells across within 1 %.

Moduli are those at rest. Where tissue has stiffened its modes are faster, and their ratio is less.

As a tetrahedron is stretched its faces grow, and what limits the step would grow as their square
G. So n_k is multiplied by

    2 / (1 + G),   at most 1 / sqrt(G),     G at least 1, of the face that has grown most

Then no face resists more than at rest. That the bound on frequencies at rest
(`tissue.elasticity.frequency.at_rest`) then bounds the rates of decay at any strain is measured and
not proven: faces of neighbours may come to align. A tetrahedron that is pressed flat, or inside
out, is as any other.

Three loops, after the gradients of displacement: rates of blocks, averages of nodes, forces of
blocks.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes, point
from tissue.core.simd_blocks import splat, store_block, width_of
from tissue.core.simd_columns import store_columns, store_sum_of_rows, sums_of_four_rows
from tissue.core.simd_points import points_of_rows, store_everywhere, store_row
from tissue.core.simd_rows import natural, where_larger
from tissue.core.sized import sized
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, add, dot, scale, sub
from tissue.elasticity.finite_elements import (
    N_SHAPE,
    VISCOUS_LAM,
    VISCOUS_MU,
    VOLUME,
    Solid,
    averages_shear,
    is_graded,
    n_blocks,
)
from tissue.elasticity.graded import LEAST_LAM, modulus_of
from tissue.elasticity.gradients import (
    displacements,
    gradient_of_displacement,
    gradient_of_shape,
    known_gradient,
    load_vector,
    shape_of,
    store_vector,
)
from tissue.elasticity.neo_hookean import (
    has_averages,
    store_corner_forces,
    sum_around,
    sum_of_corners,
)
from tissue.elasticity.stress import MatrixRows, deformed_cofactors, product_with
from tissue.laws.energy_density import EnergyDensity
from tissue.mesh.body import Body

N_RATES = 15
"""Numbers of a tetrahedron in `Viscosity.rates`."""

_RATE = 9
"""Place of J d among them, as xx, yy, zz, xy, yz and zx; before it are n_1, n_2 and n_3."""


class Viscosity(Arrays, two_precisions=True):
    """Scratch for rates of deformation; all of it is empty where tetrahedra have no viscosity."""

    velocity: FloatArray = sized("nodes", 4, is_for_vectors=True)
    """Velocities of the nodes [m/s], shape (nodes, 4), the last column 0."""
    rates: FloatArray = sized((N_RATES, "in_blocks"), is_for_vectors=True)
    """n_k [1/m] and J d [1/s] of each tetrahedron, in blocks of fifteen rows."""
    rate_rows: FloatArray = sized("averaged_behind_a_block", 16, is_for_vectors=True)
    """V J d of each tetrahedron [m3/s], behind a first block of zeros, where shear is averaged."""
    node_rates: FloatArray = sized("averaging_nodes", 16, is_for_vectors=True)
    """J d averaged around each node [1/s]; where tetrahedra have moduli of their own, times mu of
    the node, and behind it lam J' [Pa/s]."""
    dilated: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """V J' of each tetrahedron [m3/s], behind a first block of zeros, where it is not."""
    node_dilation: FloatArray = sized("dilating_nodes", 4, is_for_vectors=True)
    """J' averaged around each node [1/s], four times in a row (`values_of_rows`); times the modulus
    of the node where tetrahedra have moduli of their own [Pa/s]."""
    force: FloatArray = sized("forced_nodes", 3)
    """Viscous force on each node per tau [N/s], where it acts together with the elastic one."""


def no_viscosity(solid: Solid, *, is_viscous: bool) -> Viscosity:
    """Return scratch for the tetrahedra of a solid, or none where they have no viscosity."""
    return Viscosity.new(_sizes(solid, is_viscous), real=solid.shape.dtype.type)


def grown_viscosity(viscosity: Viscosity, solid: Solid) -> Viscosity:
    """Return scratch for a solid that has grown."""
    return viscosity.grown(_sizes(solid, is_viscous(viscosity)))


def _sizes(solid: Solid, is_viscous: bool) -> dict[str, int]:
    """Return the sizes of the arrays of `Viscosity`."""
    n_nodes, width = len(solid.first) * is_viscous, width_of(solid.shape)
    in_blocks = len(solid.shape) // N_SHAPE * is_viscous
    behind, averages = in_blocks + width * is_viscous, bool(averages_shear(solid))
    rows = len(solid.node_volume) * is_viscous
    return {
        "nodes": n_nodes,
        "in_blocks": in_blocks,
        "averaged_behind_a_block": behind * averages,
        "averaging_nodes": rows * averages,
        "behind_a_block": behind * (not averages),
        "dilating_nodes": rows * (not averages),
        "forced_nodes": n_nodes,
    }


@kernel
def is_viscous(viscosity: Viscosity) -> bool:
    """Return whether tetrahedra resist their rate of deformation."""
    return len(viscosity.velocity) > 0


@kernel
def viscous_corner_forces(
    viscosity: Viscosity, solid: Solid, body: Body, positions: FloatArray, velocities: FloatArray
) -> None:
    """Run all loops, so that `solid_force` gives the viscous force on a node per tau [N/s].

    Args:
        viscosity: Written.
        solid: Scratch is written.
        body: Rest positions.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
    """
    blocks = n_blocks(solid, body.n_tetrahedra)
    solid.are_gradients_known = 0
    displacements(solid, body, positions, 0, body.n_nodes)
    write_velocities(viscosity, body, velocities)
    rates_of_deformation(viscosity, solid, 0, blocks)
    if has_averages(solid):
        average_rates(viscosity, solid, 0, body.n_nodes)
    viscous_forces(viscosity, solid, 0, blocks)


@kernel
def write_velocities(viscosity: Viscosity, body: Body, velocities: FloatArray) -> None:
    """Write the velocities [m/s] that the tetrahedra resist."""
    for i in range(body.n_nodes):
        store_row(viscosity.velocity, i, point(velocities, i))


@kernel
def rates_of_deformation(viscosity: Viscosity, solid: Solid, begin: int, end: int) -> None:
    """Write n_k and J d of the blocks from `begin` to `end`.

    After `write_velocities`, and `displacements` or, where they are known, the gradients of these.
    """
    # Loops of their own, so that the code of each is without a branch.
    is_known = solid.are_gradients_known == 1
    if averages_shear(solid):
        if is_known:
            for block in range(begin, end):
                _write_rates(viscosity, solid, natural(block), True, True)
        else:
            for block in range(begin, end):
                _write_rates(viscosity, solid, natural(block), False, True)
    elif is_known:
        for block in range(begin, end):
            _write_rates(viscosity, solid, natural(block), True, False)
    else:
        for block in range(begin, end):
            _write_rates(viscosity, solid, natural(block), False, False)


@inlined
def _write_rates(
    viscosity: Viscosity, solid: Solid, block: int, is_known: bool, is_averaged: bool
) -> None:
    """Write what `rates_of_deformation` does of a block.

    Args:
        viscosity: Written.
        solid: The tetrahedra.
        block: The block.
        is_known: Whether the gradients of displacement are; a constant where this is called.
        is_averaged: Whether a share of the shear is averaged around nodes; a constant, too.
    """
    if is_known:
        x, y, z = known_gradient(solid, block)
    else:
        x, y, z = gradient_of_displacement(solid, block)
    n1, n2, n3 = _faces(solid, block, (x, y, z))
    origin = _velocity(viscosity, solid, block, 0)
    u1 = sub(_velocity(viscosity, solid, block, 1), origin)
    u2 = sub(_velocity(viscosity, solid, block, 2), origin)
    u3 = sub(_velocity(viscosity, solid, block, 3), origin)
    along, across = _rate_of((u1, u2, u3), (n1, n2, n3))
    width, v = width_of(solid.shape), shape_of(solid, block, VOLUME)
    at = width * N_RATES * block
    store_vector(viscosity.rates, at, n1)
    store_vector(viscosity.rates, at + 3 * width, n2)
    store_vector(viscosity.rates, at + 6 * width, n3)
    store_vector(viscosity.rates, at + _RATE * width, along)
    store_vector(viscosity.rates, at + (_RATE + 3) * width, across)
    place = width * (1 + block)
    if is_averaged:
        a, b, none = scale(v, along), scale(v, across), splat(0.0, v)
        columns = (a.x, a.y, a.z, b.x, b.y, b.z, none, none, none, none, none)
        store_columns(viscosity.rate_rows, place, columns)
    else:
        store_block(viscosity.dilated, place, v * (along.x + along.y + along.z))


@inlined
def _rate_of(u: MatrixRows, n: MatrixRows) -> tuple[Vec3, Vec3]:
    """Return xx, yy, zz and xy, yz, zx of sym(sum of u_k n_k^T)."""
    along, across = _dyad(u[0], n[0])
    along_2, across_2 = _dyad(u[1], n[1])
    along_3, across_3 = _dyad(u[2], n[2])
    half = splat(0.5, along.x)
    return add(along, add(along_2, along_3)), scale(half, add(across, add(across_2, across_3)))


@inlined
def _dyad(u: Vec3, n: Vec3) -> tuple[Vec3, Vec3]:
    """Return xx, yy, zz and twice xy, yz, zx of sym(u n^T)."""
    across = Vec3(u.x * n.y + u.y * n.x, u.y * n.z + u.z * n.y, u.z * n.x + u.x * n.z)
    return Vec3(u.x * n.x, u.y * n.y, u.z * n.z), across


@inlined
def _faces(solid: Solid, block: int, gradient: MatrixRows) -> MatrixRows:
    """Return n_1, n_2 and n_3 of the tetrahedra of a block [1/m], which no stretch makes stiffer.

    Args:
        solid: The tetrahedra.
        block: The block.
        gradient: Rows of H.
    """
    c, one = deformed_cofactors(*gradient), splat(1.0, gradient[0].x)
    g1 = gradient_of_shape(solid, block, 0)
    g2 = gradient_of_shape(solid, block, 3)
    g3 = gradient_of_shape(solid, block, 6)
    n1, n2, n3 = product_with(c, g1), product_with(c, g2), product_with(c, g3)
    # G = now / before, without a division for each face. Rows without a tetrahedron have no faces.
    now, before = _more_grown(one, one, n1, g1)
    now, before = _more_grown(now, before, n2, g2)
    now, before = _more_grown(now, before, n3, g3)
    now, before = _more_grown(now, before, add(n1, add(n2, n3)), add(g1, add(g2, g3)))
    share = (before + before) / (now + before)
    return scale(share, n1), scale(share, n2), scale(share, n3)


@inlined
def _more_grown(now: Lanes, before: Lanes, n: Vec3, g: Vec3) -> tuple[Lanes, Lanes]:
    """Return the squares of a face as it is and as it was, of the one that has grown more.

    Args:
        now: The square of one face as it is.
        before: As it was at rest.
        n: Another one as it is.
        g: As it was.
    """
    squared, at_rest = dot(n, n), dot(g, g)
    of_other, of_this = squared * before, now * at_rest
    return (
        where_larger(of_other, of_this, squared, now),
        where_larger(of_other, of_this, at_rest, before),
    )


@inlined
def _velocity(viscosity: Viscosity, solid: Solid, block: int, k: int) -> Vec3:
    """Return the velocities of corner `k` of the tetrahedra of a block [m/s]."""
    first = width_of(solid.shape) * (4 * block + k)
    x, y, z = points_of_rows(viscosity.velocity, solid.nodes, first)
    return Vec3(x, y, z)


@kernel
def average_rates(viscosity: Viscosity, solid: Solid, begin: int, end: int) -> None:
    """Write the rates averaged around the nodes from `begin` to `end`, from the tetrahedra there.

    That is J d where a share of the shear is averaged, else J'.
    """
    if averages_shear(solid):
        rows, of = viscosity.rate_rows, solid.around
        for i in range(begin, end):
            node = natural(i)
            share, first, n = 0.25 / solid.node_volume[node], solid.first[node], solid.count[node]
            store_sum_of_rows(viscosity.node_rates, node, share, rows, of, first, n)
            if is_graded(solid):
                _weigh_rates(viscosity, solid, node)
    else:
        for i in range(begin, end):
            node = natural(i)
            rate = 0.25 * sum_around(solid, viscosity.dilated, node) / solid.node_volume[node]
            if is_graded(solid):
                rate *= solid.node_viscous_lam[node]
            store_everywhere(viscosity.node_dilation, node, rate)


@kernel
def _weigh_rates(viscosity: Viscosity, solid: Solid, node: int) -> None:
    """Multiply the averaged rates of a node by its moduli; those of its volume come behind them."""
    rates, mu = viscosity.node_rates, solid.node_viscous_mu[node]
    trace = rates[node, 0] + rates[node, 1] + rates[node, 2]
    for q in range(6):
        rates[node, q] *= mu
    rates[node, 6] = solid.node_viscous_lam[node] * trace


@kernel
def viscous_forces(viscosity: Viscosity, solid: Solid, begin: int, end: int) -> None:
    """Write the viscous forces on the corners of the blocks from `begin` to `end`, per tau [N/s].

    They are where those of `corner_forces` are, until these are evaluated again.
    """
    if averages_shear(solid):
        for block in range(begin, end):
            _viscous_forces_of(viscosity, solid, natural(block), True)
    else:
        for block in range(begin, end):
            _viscous_forces_of(viscosity, solid, natural(block), False)


@inlined
def _viscous_forces_of(viscosity: Viscosity, solid: Solid, block: int, is_averaged: bool) -> None:
    """Write the viscous forces on the corners of the tetrahedra of a block.

    Args:
        viscosity: Rates.
        solid: Forces are written.
        block: The block.
        is_averaged: Whether a share of the shear is averaged around nodes; a constant where this
            is called.
    """
    width, v = width_of(solid.shape), shape_of(solid, block, VOLUME)
    at = width * N_RATES * block
    n1, n2 = load_vector(viscosity.rates, at), load_vector(viscosity.rates, at + 3 * width)
    n3 = load_vector(viscosity.rates, at + 6 * width)
    along = load_vector(viscosity.rates, at + _RATE * width)
    across = load_vector(viscosity.rates, at + (_RATE + 3) * width)
    own_mu, own_lam, mean_mu, mean_lam = viscous_moduli(solid.law)
    minus_v = splat(-1.0, v) * v
    if is_graded(solid):
        twice = splat(2.0, v) * modulus_of(solid, block, VISCOUS_MU)
        lam = modulus_of(solid, block, VISCOUS_LAM)
        mean_mu = mean_lam = 1.0  # those of nodes are in their rates
    else:
        twice, lam = splat(2.0 * own_mu, v), splat(own_lam, v)
    p = lam * (along.x + along.y + along.z)
    along, across = scale(twice, along), scale(twice, across)
    if is_averaged:
        sites = solid.sites if is_graded(solid) else solid.nodes
        sums = sums_of_four_rows(viscosity.node_rates, sites, 4 * width * block)
        xx, yy, zz, xy, yz, zx, trace, _, _, _, _ = sums
        if not is_graded(solid):
            trace = xx + yy + zz
        p = p + splat(0.25 * mean_lam, v) * trace
        twice = splat(0.5 * mean_mu, v)
        along = add(along, scale(twice, Vec3(xx, yy, zz)))
        across = add(across, scale(twice, Vec3(xy, yz, zx)))
    elif has_averages(solid):
        p = p + splat(0.25 * mean_lam, v) * sum_of_corners(solid, viscosity.node_dilation, block)
    tx = Vec3(along.x + p, across.x, across.z)
    ty = Vec3(across.x, along.y + p, across.y)
    tz = Vec3(across.z, across.y, along.z + p)
    stress = scale(minus_v, tx), scale(minus_v, ty), scale(minus_v, tz)
    store_corner_forces(solid, block, stress, (n1, n2, n3))


@kernel
def viscous_moduli(law: EnergyDensity) -> tuple[float, float, float, float]:
    """Return mu and lam of each tetrahedron by itself, then mu and lam of averages [Pa].

    They add up to Lame's constants of the material.
    """
    of_nodes = law.shear_of_nodes
    own_mu, mean_mu = (1.0 - of_nodes) * law.shear_modulus, of_nodes * law.shear_modulus
    own = law.lam_of_tetrahedra - (1.0 - of_nodes) * law.excess
    own_lam = own if law.lam_of_nodes == 0.0 else max(own, LEAST_LAM * own_mu)
    mean_lam = law.lam_of_nodes - of_nodes * law.excess + (own - own_lam)
    return own_mu, own_lam, mean_mu, mean_lam
