"""Shear from gradients that are averaged around nodes, so that coarse tetrahedra twist and bend.

The strain of a linear tetrahedron is constant. Where that of the body varies within it, as in
twisting and bending, it is too stiff: a bar of three cells across by a third to two thirds. With F
averaged over the tetrahedra around each node, by volume, it is too soft, and there are motions that
averages hardly see. The energy per volume is a mixture of both (the alpha finite element method;
Liu, Nguyen-Thoi and Lam 2008, Comput. Methods Appl. Mech. Eng. 197:3883),

    (1 - s) W(F of the tetrahedron) + s W(F averaged at its nodes)

with the shear part W of the law, and s = `EnergyDensity.shear_of_nodes`. J of the volume term is
averaged around nodes in any case. At small strain W is convex, so that the mixture is nowhere
stiffer than tetrahedra by themselves; `tissue.elasticity.frequency.at_rest` bounds its frequencies.
Forces are the exact gradient: with P the stress of a node, from its F, a tetrahedron gets the mean
of those of its four nodes besides its own, as it gave a quarter of V F to each.

Where the strain differs much around a node, its average says little: that of tetrahedra which are
turned against each other is small, and so folds would stay. There tetrahedra take their shear back.
With q the measure of shear of the laws (`tissue.laws.kernels`), and its spread

    g = (q averaged - q of F averaged) / 2        mu g is what averaging saves at small strain

the energy of a node has in addition, per volume, s mu (g - h(g)) with

    g - h = G (x - 2 log(1 + x) - 1 / (1 + x) + 1),     x = g / G,     G = `SPREAD_LIMIT`

of which the derivative rises from 0 to 1 as (x / (1 + x))^2.

A loop over nodes, between those over tetrahedra of `tissue.elasticity.neo_hookean`: sums over the
stars of nodes, then stresses of as many nodes as a vector has lanes.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import (
    gathered_like,
    logarithm,
    splat,
    store_block,
    sum_of_lanes,
    width_of,
)
from tissue.core.simd_columns import (
    columns_of_rows,
    store_columns,
    store_sum_of_rows,
    sums_of_four_rows,
)
from tissue.core.simd_rows import larger, natural
from tissue.core.vec3 import Vec3, dot, scale
from tissue.elasticity.finite_elements import Solid, is_graded
from tissue.elasticity.graded import lam_of_nodes, law_of_nodes, shear_of_nodes
from tissue.elasticity.relaxed_stress import relaxes, with_relaxed
from tissue.elasticity.stress import MatrixRows, cofactors_of, shear_stiffness, stress_of
from tissue.laws.kernels import (
    isotropic_factor,
    stiffening_factor,
    stiffens,
    stretch_energy,
    stretch_invariant,
)

SPREAD_LIMIT = 0.03
"""G: strains around a node that differ by its root, 0.17, give a quarter of the averaged shear back
to tetrahedra. With a larger one some bodies do not unfold that tetrahedra by themselves unfold; a
smaller one makes tissue stiffer where it is bent by a few percent within an element."""


@inlined
def store_gradients(
    solid: Solid, block: int, v: Lanes, gradient: MatrixRows, dilated: Lanes, q: Lanes
) -> None:
    """Write what the tetrahedra of a block give to their nodes.

    Args:
        solid: Written.
        block: The block.
        v: Volumes [m3].
        gradient: Rows of H.
        dilated: V (J - 1) [m3].
        q: Their measure of shear.
    """
    x, y, z = scale(v, gradient[0]), scale(v, gradient[1]), scale(v, gradient[2])
    columns = (x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, dilated, v * q)
    store_columns(solid.gradient_rows, width_of(solid.shape) * (1 + block), columns)


@kernel
def average_around_nodes(solid: Solid, begin: int, end: int) -> None:
    """Write averages and stresses of the nodes from `begin` to `end`, after the gradients.

    `begin` is the first node of a vector. What the last vector holds beyond `end` is written, too.
    """
    for node in range(begin, end):
        _write_average(solid, natural(node))
    # Loops of their own, so that the code of each is without a branch.
    if stiffens(solid.law):
        if relaxes(solid):
            _write_all_stresses(solid, begin, end, True, True)
        else:
            _write_all_stresses(solid, begin, end, True, False)
    elif relaxes(solid):
        _write_all_stresses(solid, begin, end, False, True)
    else:
        _write_all_stresses(solid, begin, end, False, False)


@inlined
def _write_average(solid: Solid, node: int) -> None:
    """Write H, J - 1 and q averaged around a node."""
    share, first, n = 0.25 / solid.node_volume[node], solid.first[node], solid.count[node]
    rows, of = solid.gradient_rows, solid.around
    store_sum_of_rows(solid.node_gradient, node, share, rows, of, first, n)


@inlined
def averages_of(solid: Solid, first: int) -> tuple[MatrixRows, Lanes, Lanes]:
    """Return the rows of H, J - 1 and q, averaged around the nodes of a vector."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz, dilatation, q = columns_of_rows(solid.node_gradient, first)
    return (Vec3(xx, xy, xz), Vec3(yx, yy, yz), Vec3(zx, zy, zz)), dilatation, q


@inlined
def _write_all_stresses(
    solid: Solid, begin: int, end: int, has_stiffened: bool, has_relaxed: bool
) -> None:
    """Write the stresses of nodes.

    Args:
        solid: Written.
        begin: First of the nodes.
        end: End of them.
        has_stiffened: Whether the law stiffens; a constant where this is called.
        has_relaxed: Whether stress has relaxed; a constant, too.
    """
    for first in range(begin, end, width_of(solid.shape)):
        _write_stresses(solid, natural(first), has_stiffened, has_relaxed)


@inlined
def _write_stresses(solid: Solid, first: int, has_stiffened: bool, has_relaxed: bool) -> None:
    """Write the stresses of the nodes of a vector; see `_write_all_stresses`."""
    law = solid.law
    gradient, dilatation, averaged_q = averages_of(solid, first)
    x, y, z = gradient
    cofactors = cofactors_of(x, y, z)
    q = stretch_invariant(x, y, z, *cofactors)
    share, modulus = splat(law.shear_of_nodes, q), shear_of_nodes(solid, first, q)
    taken, stiffness_taken = taken_back(averaged_q, q)
    of_block = law_of_nodes(solid, first, q)
    if has_stiffened:
        s = splat(0.0, q)
        factor = stiffening_factor(of_block, q)
        stiffness, _ = shear_stiffness(of_block, q, factor, gradient, cofactors)
        store_block(solid.node_stiffness, first, stiffness)
        rest = share * modulus * (factor - taken)
    else:
        s = share * isotropic_factor(of_block, x.x + y.y + z.z, x, y, z)
        rest = share * modulus * (splat(1.0, q) - taken)
    store_block(solid.stiffness_taken, first, stiffness_taken)
    px, py, pz = stress_of(rest + s, splat(-1.0, s) * rest, s, gradient, cofactors)
    if has_relaxed:
        minus = splat(-1.0, q)
        px, py, pz = with_relaxed(solid.node_relaxed, first, minus, (px, py, pz), gradient)
    pressure = lam_of_nodes(solid, first, s) * dilatation
    taken = share * modulus * taken
    columns = (px.x, px.y, px.z, py.x, py.y, py.z, pz.x, pz.y, pz.z, pressure, taken)
    store_columns(solid.node_stress, first, columns)


@inlined
def taken_back(averaged_q: Lanes, q: Lanes) -> tuple[Lanes, Lanes]:
    """Return the share of the averaged shear that tetrahedra take back, and their stiffness by it.

    That is a bound on the second derivative of g - h over that of q / 2 at rest: the slope of
    g - h, and what that changes by. With A = F - cof F dg is the average of (A - A averaged) : dF,
    and |A - A averaged|^2 is 4 g on average.

    Args:
        averaged_q: q averaged around nodes.
        q: q of F averaged there.
    """
    zero, one = splat(0.0, q), splat(1.0, q)
    x = splat(0.5 / SPREAD_LIMIT, q) * larger(averaged_q - q, zero)
    inverse = one / (one + x)
    share = x * inverse
    share = share * share
    return share, share + splat(8.0, q) * share * inverse


@inlined
def stress_of_nodes(solid: Solid, block: int, v: Lanes) -> tuple[MatrixRows, Lanes, Lanes]:
    """Return the mean stress of the nodes of the tetrahedra of a block, and two more means.

    These are their pressures, and the shear moduli that tetrahedra take back [Pa].

    Args:
        solid: The tetrahedra, after `average_around_nodes`.
        block: A block of them.
        v: Their volumes [m3].
    """
    first = 4 * width_of(solid.shape) * block
    sites = solid.sites if is_graded(solid) else solid.nodes
    sums = sums_of_four_rows(solid.node_stress, sites, first)
    xx, xy, xz, yx, yy, yz, zx, zy, zz, pressure, taken = sums
    quarter = splat(0.25, v)
    mean = (
        scale(quarter, Vec3(xx, xy, xz)),
        scale(quarter, Vec3(yx, yy, yz)),
        scale(quarter, Vec3(zx, zy, zz)),
    )
    return mean, quarter * pressure, quarter * taken


@inlined
def mean_of_nodes(values: FloatArray, solid: Solid, block: int, like: Lanes) -> Lanes:
    """Return the means of values at the nodes of the tetrahedra of a block.

    Args:
        values: One number a node.
        solid: The tetrahedra.
        block: A block of them.
        like: A vector of the type of the means.
    """
    sites, width = solid.sites if is_graded(solid) else solid.nodes, width_of(solid.shape)
    first = 4 * width * block
    ends = gathered_like(like, values, sites, first)
    ends = ends + gathered_like(like, values, sites, first + width)
    others = gathered_like(like, values, sites, first + 2 * width)
    others = others + gathered_like(like, values, sites, first + 3 * width)
    return splat(0.25, like) * (ends + others)


@kernel
def shear_energy_of_nodes(solid: Solid, n_nodes: int) -> float:
    """Return the energy of the shear of averages [J], after `average_around_nodes`."""
    energy = 0.0
    for first in range(0, n_nodes, width_of(solid.shape)):
        energy += sum_of_lanes(_energies(solid, first))
    return energy


@inlined
def _energies(solid: Solid, first: int) -> Lanes:
    """Return the energies of the shear of the nodes of a vector [J].

    Under a law that does not stiffen the term in J of the shear is that of F, not J averaged, of
    which `solid_energy` counts the whole.
    """
    law = solid.law
    (x, y, z), dilatation, averaged_q = averages_of(solid, first)
    cx, cy, cz = cofactors_of(x, y, z)
    q = stretch_invariant(x, y, z, cx, cy, cz)
    one = splat(1.0, q)
    if stiffens(law):
        w = stretch_energy(law_of_nodes(solid, first, q), q)
    else:
        trace = x.x + y.y + z.z
        grown = trace + trace + (dot(x, x) + dot(y, y) + dot(z, z))
        own = trace + (cx.x + cy.y + cz.z) + dot(x, cx)
        w = grown - logarithm(one + splat(0.25, q) * grown)
        w = w - splat(1.5, q) * (own - dilatation)
    u = splat(0.5 / SPREAD_LIMIT, q) * larger(averaged_q - q, splat(0.0, q))
    taken = u - splat(2.0, q) * logarithm(one + u) + u / (one + u)
    volume = gathered_like(w, solid.node_volume, solid.every, first)
    mu, spread = law_of_nodes(solid, first, w).mu, splat(SPREAD_LIMIT, w)
    w = splat(0.5, w) * mu * w + spread * shear_of_nodes(solid, first, w) * taken
    return splat(law.shear_of_nodes, w) * volume * w
