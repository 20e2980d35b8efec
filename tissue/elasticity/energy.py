"""Energies stored in the body, and the power that damping dissipates.

Tetrahedra store the energy of their law, and what relaxation changes in it. With R and r constant
they are elastic, with the energy

    W - V R : E - V r (J - 1)        E = (F^T F - 1) / 2

to which each Maxwell element adds g times the complementary energy of R / g and r / g, the energy
that they have by themselves, as at small strain:

    V (|dev R|^2 / (4 mu g) + K (r / M)^2 / (2 g))        K = lam + 2/3 mu

M is the modulus from which the pressure of the law follows, p = M (J - 1); where tissue stiffens
the first term is smaller (`tissue.laws.kernels.complementary_energy`). The sum is the free energy
where strains are small: of held tissue 1 - sum of g_i of W is left in the end. As R and r change it
falls, by what the dashpots dissipate. At large strain the shares of what is stored and what is
dissipated are estimates; their sum is exact.
"""

from typing import Final, NamedTuple

from tissue.core.array_types import FloatArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes, store_point
from tissue.core.simd_blocks import (
    gathered_like,
    load_block,
    logarithm,
    splat,
    sum_of_lanes,
    width_of,
)
from tissue.core.simd_rows import larger
from tissue.core.vec3 import Vec3, dot, vec3
from tissue.elasticity.averaged_shear import averages_of, shear_energy_of_nodes
from tissue.elasticity.collapse import collapse_energy
from tissue.elasticity.finite_elements import (
    BULK,
    N_RELAXED,
    VOLUME,
    Solid,
    averages_shear,
    is_graded,
    n_blocks,
)
from tissue.elasticity.graded import (
    NO_MODULUS,
    law_of_block,
    law_of_nodes,
    modulus_of,
    modulus_of_node,
    own_lam_of,
    own_share_of,
    shear_modulus_of,
)
from tissue.elasticity.gradients import known_gradient, shape_of
from tissue.elasticity.internal_forces import Elastic, Surroundings, resist, viscous_force
from tissue.elasticity.neo_hookean import deform_solid, dilated_around, own_dilatation
from tissue.elasticity.relaxed_stress import (
    PRESSURE,
    of_term,
    relaxed_pressure,
    relaxes,
    rows_of_stress,
)
from tissue.elasticity.springs import spring_energy
from tissue.elasticity.stress import MatrixRows, cofactors_of
from tissue.laws.kernels import (
    LawOfBlock,
    complementary_energy,
    stiffens,
    stretch_energy,
    stretch_invariant,
)
from tissue.mesh.body import Body

_LEAST_SHARE: Final = 1e-20
"""A g far below any, in place of 0 of a term that a material does not have."""


@kernel
def elastic_energy(elastic: Elastic, body: Body) -> float:
    """Return the elastic energy of the body now, less that at rest [J].

    Where stress relaxes, that in the springs of the Maxwell elements is a part of it.
    """
    energy = 0.0
    if elastic.has_springs:
        energy += spring_energy(elastic.springs, body)
        energy += collapse_energy(elastic.collapsing, body)
    if elastic.has_tetrahedra:
        energy += solid_energy(elastic.solid, body, body.positions)
    return energy


@kernel
def kinetic_energy(body: Body) -> float:
    """Return the kinetic energy of the nodes that are not fixed [J]."""
    energy = 0.0
    for node in range(body.n_nodes):
        if body.fixed[node]:  # its motion is that of its support
            continue
        v = vec3(body.velocities, node)
        energy += 0.5 * body.masses[node] * dot(v, v)
    return energy


@kernel
def potential_energy(body: Body, gravity: Vec3) -> float:
    """Return the potential energy of all nodes in gravity [J]."""
    energy = 0.0
    for node in range(body.n_nodes):
        weight = body.masses[node] - body.added_masses[node]
        energy -= weight * dot(gravity, vec3(body.positions, node))
    return energy


@kernel
def dissipated_power(
    body: Body,
    elastic: Elastic,
    surroundings: Surroundings,
    positions: FloatArray,
    velocities: FloatArray,
    scratch: FloatArray,
) -> float:
    """Return the power that viscosity and drag dissipate [W].

    Args:
        body: Masses and fixed nodes.
        elastic: What is viscous; scratch is written.
        surroundings: Drag and retardation time.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        scratch: Overwritten; shaped as positions.
    """
    time = surroundings.retardation_time
    power = 0.0
    if time > 0.0:
        resist(elastic, body, positions, velocities)
    for node in range(body.n_nodes):
        v = vec3(velocities, node)
        if not body.fixed[node]:
            power += surroundings.drag * body.drag[node] * body.masses[node] * dot(v, v)
        if time > 0.0:
            force = viscous_force(elastic, node, positions, velocities, time)
            store_point(scratch, node, force)
            power -= dot(vec3(scratch, node), v)
    return power


@kernel
def solid_energy(solid: Solid, body: Body, positions: FloatArray) -> float:
    """Return the energy stored in the tetrahedra at `positions` [m], less that at rest [J]."""
    law, blocks = solid.law, n_blocks(solid, body.n_tetrahedra)
    deform_solid(solid, body, positions)
    # What is linear in J - 1 is that of tetrahedra where they have moduli of their own.
    energy, a = 0.0, 1.0 if is_graded(solid) else law.a
    for block in range(blocks):
        energy += sum_of_lanes(_energies(solid, block))
    for node in range(body.n_nodes):
        v = solid.node_volume[node]
        energy += v * _bulk_energy(modulus_of_node(solid, node), dilated_around(solid, node) / v, a)
    if averages_shear(solid):
        energy += shear_energy_of_nodes(solid, body.n_nodes)
    if relaxes(solid):
        energy += relaxed_energy(solid, body)
    return energy


@kernel
def relaxed_energy(solid: Solid, body: Body) -> float:
    """Return what relaxation adds to the energy of the elastic law, which may be negative [J].

    After `deform_solid`.
    """
    energy = 0.0
    for block in range(n_blocks(solid, body.n_tetrahedra)):
        energy += sum_of_lanes(_relaxed_energies(solid, block))
    if averages_shear(solid):
        width = width_of(solid.shape)
        for block in range((body.n_nodes + width - 1) // width):
            energy += sum_of_lanes(_relaxed_energies_of_nodes(solid, block))
    return energy


@inlined
def _relaxed_energies(solid: Solid, block: int) -> Lanes:
    """Return what relaxation adds to the energies of the tetrahedra of a block [J]."""
    width, n_terms = width_of(solid.shape), solid.n_terms
    v, gradient = shape_of(solid, block, VOLUME), known_gradient(solid, block)
    numbers, own = (solid.relaxed, solid.relaxed_terms), own_share_of(solid, block, v)
    rows = _Relaxed(*numbers, solid.series, block, own)
    total = _of_relaxed(solid, rows, law_of_block(solid, block, v), gradient)
    total = total - relaxed_pressure(solid, block) * own_dilatation(solid, block, v)
    for term in range(n_terms):
        at = width * (N_RELAXED * (n_terms * block + term) + PRESSURE)
        r = load_block(solid.relaxed_terms, at)
        total = total + _bulk_compliance(solid, block, term, v) * r * r
    return v * total


@inlined
def _relaxed_energies_of_nodes(solid: Solid, block: int) -> Lanes:
    """Return what relaxation adds to the energies of the averaged shear of nodes [J]."""
    first = width_of(solid.shape) * block
    gradient, _, _ = averages_of(solid, first)
    share = splat(solid.law.shear_of_nodes, gradient[0].x)
    numbers = solid.node_relaxed, solid.node_relaxed_terms
    rows = _Relaxed(*numbers, solid.node_series, block, share)
    w = _of_relaxed(solid, rows, law_of_nodes(solid, first, share), gradient)
    return gathered_like(w, solid.node_volume, solid.every, first) * w


class _Relaxed(NamedTuple):
    """R of a block of tetrahedra, or of nodes."""

    sums: FloatArray
    """`Solid.relaxed`, or `Solid.node_relaxed`."""
    terms: FloatArray
    """The same of each term."""
    series: SlotArray
    """`Solid.series`, or `Solid.node_series`."""
    block: int
    """The block."""
    share: Lanes
    """The part of the shear that it is of; of that which is taken back it is an estimate."""


@inlined
def _of_relaxed(solid: Solid, relaxed: _Relaxed, of: LawOfBlock, gradient: MatrixRows) -> Lanes:
    """Return what R adds to the energies of the shear [J/m3].

    Args:
        solid: Shares.
        relaxed: R.
        of: The law.
        gradient: Rows of H.
    """
    width, n_terms = width_of(solid.shape), solid.n_terms
    x, y, z = gradient
    rx, ry, rz = rows_of_stress(relaxed.sums, width * N_RELAXED * relaxed.block)
    # R : E = R : H + sum over the rows h of H of h . R h / 2
    strained = dot(rx, x) + dot(ry, y) + dot(rz, z)
    squares = _quadratic(x, rx, ry, rz) + _quadratic(y, rx, ry, rz) + _quadratic(z, rx, ry, rz)
    half = splat(0.5, strained)
    total = splat(-1.0, strained) * (strained + half * squares)
    for term in range(n_terms):
        at = width * N_RELAXED * (n_terms * relaxed.block + term)
        rows = rows_of_stress(relaxed.terms, at)
        numbers, series = solid.relaxing_shares, relaxed.series
        g = relaxed.share * of_term(solid, numbers, series, relaxed.block, term, strained)
        total = total + _complementary(of, g, rows)
    return total


@inlined
def _quadratic(h: Vec3, rx: Vec3, ry: Vec3, rz: Vec3) -> Lanes:
    """Return h . R h."""
    return dot(h, Vec3(dot(rx, h), dot(ry, h), dot(rz, h)))


@inlined
def _complementary(of: LawOfBlock, g: Lanes, rows: MatrixRows) -> Lanes:
    """Return the complementary energy of R of a term [J/m3].

    Args:
        of: The law.
        g: Share of the term, of the part of the shear that R is of.
        rows: Rows of its R.
    """
    rx, ry, rz = rows
    mu = of.mu if stiffens(of.law) else splat(0.75, rx.x) * of.mu
    trace = rx.x + ry.y + rz.z
    third = splat(1.0 / 3.0, trace)
    deviator = dot(rx, rx) + dot(ry, ry) + dot(rz, rz) - third * trace * trace
    of_term = larger(g * mu, splat(NO_MODULUS, trace))
    y = larger(splat(0.5, trace) / (of_term * of_term) * deviator, splat(0.0, trace))
    return splat(0.5, trace) * of_term * complementary_energy(of, y)


@inlined
def _bulk_compliance(solid: Solid, block: int, term: int, like: Lanes) -> Lanes:
    """Return the complementary energies of r of a term over r^2 [1/Pa], of a block.

    Args:
        solid: Moduli and shares.
        block: A block of tetrahedra.
        term: The term.
        like: A vector of the type of the numbers.
    """
    law = solid.law
    if is_graded(solid):
        g = of_term(solid, solid.relaxing_shares, solid.series, block, term, like)
        # A term that the material does not have has no r.
        return modulus_of(solid, block, BULK) / larger(g, splat(_LEAST_SHARE, like))
    g = solid.relaxing_shares[term]
    modulus = law.lam_of_tetrahedra + law.lam_of_nodes
    bulk = modulus - law.excess + law.shear_modulus * 2.0 / 3.0
    return splat(0.5 * bulk / (g * modulus**2), like)


@inlined
def _energies(solid: Solid, block: int) -> Lanes:
    """Return the energies of the tetrahedra of a block by themselves [J].

    After `displacement_gradients`.
    """
    law, width = solid.law, width_of(solid.shape)
    x, y, z = known_gradient(solid, block)
    v = shape_of(solid, block, VOLUME)
    of = law_of_block(solid, block, v)
    if stiffens(law):
        shear = stretch_energy(of, stretch_invariant(x, y, z, *cofactors_of(x, y, z)))
    else:
        trace = x.x + y.y + z.z
        grown = trace + trace + (dot(x, x) + dot(y, y) + dot(z, z))
        shear = grown - logarithm(splat(1.0, v) + splat(0.25, v) * grown)
    dilatation = load_block(solid.dilated, width * (1 + block))
    ratio = own_dilatation(solid, block, v)
    own = splat(0.5, v) * own_share_of(solid, block, v) * of.mu
    half = splat(0.5, v) * own_lam_of(solid, block, v)
    if is_graded(solid):
        bulk = half * dilatation * ratio
        if not stiffens(law):  # lam (a - 1) of the whole lam is the shear modulus
            bulk = bulk - shear_modulus_of(solid, block, v) * dilatation
        return own * v * shear + bulk
    bulk = dilatation * (ratio + splat(2.0 * (1.0 - law.a), v))
    return own * v * shear + half * bulk


@kernel
def _bulk_energy(lam: float, dilatation: float, a: float) -> float:
    """Return lam/2 ((J - a)^2 - (1 - a)^2) [J/m3], `dilatation` is J - 1."""
    return 0.5 * lam * dilatation * (dilatation + 2.0 * (1.0 - a))
