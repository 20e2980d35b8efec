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

With its share a tetrahedron resists less as it is pressed flat. Where its own J falls below
`J_LIMIT`

    k/2 V (J_LIMIT - J)^2,     k = 3 mu

is added, Young's modulus of tissue that keeps its volume. Without it tetrahedra turn over in a
block that is glued and pressed by 60 %.

A loop over nodes, between those over tetrahedra of `tissue.elasticity.neo_hookean`: sums over the
stars of nodes, then stresses of as many nodes as a vector has lanes.
"""

from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import (
    gathered_like,
    load_block,
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
from tissue.elasticity.finite_elements import Solid
from tissue.elasticity.stress import MatrixRows, cofactors_of, shear_stiffness, stress_of
from tissue.laws.energy_density import EnergyDensity
from tissue.laws.kernels import (
    isotropic_factor,
    stiffening_factor,
    stiffens,
    stretch_energy,
    stretch_invariant,
)

J_LIMIT = 0.3
"""J below which a tetrahedron resists by itself, under law springs as well
(`tissue.elasticity.collapse`). Larger: tissue that is merely pressed is no more that of the law;
smaller: the term must be stiffer to turn what moves at the same speed."""

FLAT_MODULUS = 3.0
"""k over mu."""


@inlined
def store_gradients(
    solid: Solid, block: int, v: Lanes, gradient: MatrixRows, dilated: Lanes
) -> None:
    """Write what the tetrahedra of a block give to their nodes.

    Args:
        solid: Written.
        block: The block.
        v: Volumes [m3].
        gradient: Rows of H.
        dilated: V (J - 1) [m3].
    """
    x, y, z = scale(v, gradient[0]), scale(v, gradient[1]), scale(v, gradient[2])
    columns = (x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, dilated)
    store_columns(solid.gradient_rows, width_of(solid.shape) * (1 + block), columns)


@kernel
def average_around_nodes(solid: Solid, begin: int, end: int) -> None:
    """Write averages and stresses of the nodes from `begin` to `end`, after the gradients.

    `begin` is the first node of a vector. What the last vector holds beyond `end` is written, too.
    """
    for node in range(begin, end):
        _write_average(solid, natural(node))
    width = width_of(solid.shape)
    # Two loops, so that the code of each is without a branch.
    if stiffens(solid.law):
        for first in range(begin, end, width):
            _write_stresses(solid, natural(first), True)
    else:
        for first in range(begin, end, width):
            _write_stresses(solid, natural(first), False)


@inlined
def _write_average(solid: Solid, node: int) -> None:
    """Write H and J - 1 averaged around a node."""
    share, first, n = 0.25 / solid.node_volume[node], solid.first[node], solid.count[node]
    rows, of = solid.gradient_rows, solid.around
    store_sum_of_rows(solid.node_gradient, node, share, rows, of, first, n)


@inlined
def _average_of(solid: Solid, first: int) -> tuple[MatrixRows, Lanes]:
    """Return the rows of H, and J - 1, averaged around the nodes of a vector."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz, dilatation = columns_of_rows(solid.node_gradient, first)
    return (Vec3(xx, xy, xz), Vec3(yx, yy, yz), Vec3(zx, zy, zz)), dilatation


@inlined
def _write_stresses(solid: Solid, first: int, has_stiffened: bool) -> None:
    """Write the stresses of the nodes of a vector; `has_stiffened` is a constant in the loop."""
    law = solid.law
    gradient, dilatation = _average_of(solid, first)
    x, y, z = gradient
    cofactors = cofactors_of(x, y, z)
    if has_stiffened:
        s = splat(0.0, dilatation)
        q = stretch_invariant(x, y, z, *cofactors)
        factor = stiffening_factor(law, q)
        stiffness, _ = shear_stiffness(law, q, factor, gradient, cofactors)
        store_block(solid.node_stiffness, first, stiffness)
        rest = splat(law.mu * law.shear_of_nodes, factor) * factor
    else:
        s = splat(law.shear_of_nodes, dilatation) * isotropic_factor(law, x.x + y.y + z.z, x, y, z)
        rest = splat(0.75 * law.mu * law.shear_of_nodes, s)
    px, py, pz = stress_of(rest + s, splat(-1.0, s) * rest, s, gradient, cofactors)
    pressure = splat(law.lam_of_nodes, s) * dilatation
    columns = (px.x, px.y, px.z, py.x, py.y, py.z, pz.x, pz.y, pz.z, pressure)
    store_columns(solid.node_stress, first, columns)


@inlined
def stress_of_nodes(solid: Solid, block: int, v: Lanes) -> tuple[MatrixRows, Lanes]:
    """Return the mean stress of the nodes of the tetrahedra of a block, and their mean pressure.

    Args:
        solid: The tetrahedra, after `average_around_nodes`.
        block: A block of them.
        v: Their volumes [m3].
    """
    first = 4 * width_of(solid.shape) * block
    sums = sums_of_four_rows(solid.node_stress, solid.nodes, first)
    xx, xy, xz, yx, yy, yz, zx, zy, zz, pressure = sums
    quarter = splat(0.25, v)
    mean = (
        scale(quarter, Vec3(xx, xy, xz)),
        scale(quarter, Vec3(yx, yy, yz)),
        scale(quarter, Vec3(zx, zy, zz)),
    )
    return mean, quarter * pressure


@inlined
def mean_stiffness(solid: Solid, block: int, like: Lanes) -> Lanes:
    """Return the mean of `Solid.node_stiffness` at the nodes of the tetrahedra of a block."""
    values, nodes, width = solid.node_stiffness, solid.nodes, width_of(solid.shape)
    first = 4 * width * block
    ends = gathered_like(like, values, nodes, first)
    ends = ends + gathered_like(like, values, nodes, first + width)
    others = gathered_like(like, values, nodes, first + 2 * width)
    others = others + gathered_like(like, values, nodes, first + 3 * width)
    return splat(0.25, like) * (ends + others)


@inlined
def flatness(solid: Solid, block: int, v: Lanes) -> Lanes:
    """Return V (J_LIMIT - J) of the tetrahedra of a block where it is positive, else 0 [m3].

    Args:
        solid: The tetrahedra, after `displacement_gradients`.
        block: A block of them.
        v: Their volumes [m3].
    """
    dilated = load_block(solid.dilated, width_of(solid.shape) * (1 + block))
    return larger(splat(J_LIMIT - 1.0, v) * v - dilated, splat(0.0, v))


@inlined
def flat_modulus(law: EnergyDensity) -> float:
    """Return k [Pa]."""
    return FLAT_MODULUS * law.shear_modulus


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
    (x, y, z), dilatation = _average_of(solid, first)
    cx, cy, cz = cofactors_of(x, y, z)
    if stiffens(law):
        w = stretch_energy(law, stretch_invariant(x, y, z, cx, cy, cz))
    else:
        trace = x.x + y.y + z.z
        grown = trace + trace + (dot(x, x) + dot(y, y) + dot(z, z))
        own = trace + (cx.x + cy.y + cz.z) + dot(x, cx)
        w = grown - logarithm(splat(1.0, grown) + splat(0.25, grown) * grown)
        w = w - splat(1.5, grown) * (own - dilatation)
    volume = gathered_like(w, solid.node_volume, solid.every, first)
    return volume * splat(0.5 * law.mu * law.shear_of_nodes, w) * w
