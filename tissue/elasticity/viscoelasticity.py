"""Quasi-linear viscoelasticity: the stress of held tissue relaxes, by a Prony series.

Fung's law (Fung 1993, Biomechanics, section 7.6): the elastic law gives the stress at once, and
held tissue keeps of it

    G(t) = 1 - sum of g_i (1 - exp(-t / tau_i))

The stress is the elastic one less a part for each term, which follows g_i times the elastic stress
with the time constant tau_i, as in a Maxwell element (Simo 1987, Comput. Methods Appl. Mech. Eng.
60:153):

    dR_i/dt = (g_i S - R_i) / tau_i        dr_i/dt = (g_i p - r_i) / tau_i

S is the second Piola-Kirchhoff stress of the shear part of the law, p its pressure. All stress
relaxes: shear and pressure. Where a share of the shear is averaged around nodes, these have R and S
of their own (`tissue.elasticity.averaged_shear`).

R and r are constant while an integrator takes its steps, so that the stages of these see an elastic
body. After each increment of the time step both continue by its length, by the exact solution where
the tissue is held. R then stands for the middle of the next increment, which makes the whole of
second order.

    c (F - cof F) + s F = F S        S = c (1 - (cof F)^T cof F / J) + s 1
"""

import math

from tissue.core.array_types import FloatArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import load_block, splat, store_block, width_of
from tissue.core.simd_rows import larger, where_larger
from tissue.core.vec3 import Vec3, dot
from tissue.elasticity.averaged_shear import averages_of, stress_of_nodes, taken_back
from tissue.elasticity.finite_elements import N_RELAXED, VOLUME, Solid, averages_shear
from tissue.elasticity.graded import law_of_block, law_of_nodes, own_share_of, shear_of_nodes
from tissue.elasticity.gradients import known_gradient, shape_of
from tissue.elasticity.neo_hookean import own_dilatation, pressure_of, with_own_pressure
from tissue.elasticity.relaxed_stress import of_term
from tissue.elasticity.stress import MatrixRows, cofactors_of
from tissue.laws.kernels import (
    LawOfBlock,
    isotropic_factor,
    stiffening_factor,
    stiffens,
    stretch_invariant,
)

SMALLEST_RATIO = 0.1
"""J below which S is that of a tetrahedron of this J, with less of it: S has the factor 1 / J, and
a tetrahedron that is turned inside out has none."""


@kernel
def prepare_relaxation(solid: Solid, seconds: float) -> None:
    """Note for each term how far it goes to its limit in that time [s], which may be infinite."""
    for i in range(len(solid.relaxing_shares)):
        solid.relaxation_weights[i] = -math.expm1(-seconds / solid.relaxation_times[i])


@kernel
def relax_blocks(solid: Solid, begin: int, end: int) -> None:
    """Relax the stress of the blocks of tetrahedra from `begin` to `end` where they are.

    After `prepare_relaxation` and `tissue.elasticity.neo_hookean.deform_solid`.
    """
    for block in range(begin, end):
        stress = _elastic_stress(solid, block)
        _relax(solid, solid.relaxed, solid.relaxed_terms, solid.series, block, stress)


@kernel
def relax_nodes(solid: Solid, begin: int, end: int) -> None:
    """Relax the stress of the nodes from `begin` to `end`, where a share of the shear is theirs.

    As `relax_blocks`; `begin` is the first node of a vector.
    """
    width = width_of(solid.shape)
    for block in range(begin // width, (end + width - 1) // width):
        stress = _elastic_stress_of_nodes(solid, block)
        terms, series = solid.node_relaxed_terms, solid.node_series
        _relax(solid, solid.node_relaxed, terms, series, block, stress)


@inlined
def _relax(
    solid: Solid,
    relaxed: FloatArray,
    terms: FloatArray,
    series: SlotArray,
    block: int,
    stress: tuple[Vec3, Vec3, Lanes],
) -> None:
    """Move what has relaxed in a block towards its limit.

    Args:
        solid: The Prony series.
        relaxed: R and r of tetrahedra, or of nodes; written.
        terms: Those of each term; written.
        series: `Solid.series`, or `Solid.node_series`.
        block: A block of these.
        stress: xx, yy, zz and yz, xz, xy of S, and p [Pa].
    """
    width, n_terms = width_of(solid.shape), solid.n_terms
    along, across, p = stress
    zero = splat(0.0, p)
    rxx, ryy, rzz, ryz, rxz, rxy, r = zero, zero, zero, zero, zero, zero, zero
    for term in range(n_terms):
        share = of_term(solid, solid.relaxing_shares, series, block, term, p)
        weight = of_term(solid, solid.relaxation_weights, series, block, term, p)
        at = width * N_RELAXED * (n_terms * block + term)
        rxx = rxx + _relaxed(terms, at, share, weight, along.x)
        ryy = ryy + _relaxed(terms, at + width, share, weight, along.y)
        rzz = rzz + _relaxed(terms, at + 2 * width, share, weight, along.z)
        ryz = ryz + _relaxed(terms, at + 3 * width, share, weight, across.x)
        rxz = rxz + _relaxed(terms, at + 4 * width, share, weight, across.y)
        rxy = rxy + _relaxed(terms, at + 5 * width, share, weight, across.z)
        r = r + _relaxed(terms, at + 6 * width, share, weight, p)
    at = width * N_RELAXED * block
    store_block(relaxed, at, rxx)
    store_block(relaxed, at + width, ryy)
    store_block(relaxed, at + 2 * width, rzz)
    store_block(relaxed, at + 3 * width, ryz)
    store_block(relaxed, at + 4 * width, rxz)
    store_block(relaxed, at + 5 * width, rxy)
    store_block(relaxed, at + 6 * width, r)


@inlined
def _relaxed(terms: FloatArray, at: int, share: Lanes, weight: Lanes, stress: Lanes) -> Lanes:
    """Move a number of a term of a block towards its limit, and return it.

    Args:
        terms: `Solid.relaxed_terms`.
        at: Where the number is.
        share: g of the term.
        weight: How far it goes.
        stress: The same number of the elastic stress.
    """
    old = load_block(terms, at)
    new = old + weight * (share * stress - old)
    store_block(terms, at, new)
    return new


@inlined
def _elastic_stress(solid: Solid, block: int) -> tuple[Vec3, Vec3, Lanes]:
    """Return xx, yy, zz and yz, xz, xy of S, and p, of the tetrahedra of a block [Pa].

    Without what of their shear is averaged around nodes.
    """
    v = shape_of(solid, block, VOLUME)
    own = own_share_of(solid, block, v)
    factor = load_block(solid.stiffening, width_of(solid.shape) * (1 + block))
    c, s = _moduli(law_of_block(solid, block, v), factor)
    c, s = own * c, own * s
    if averages_shear(solid):
        _, p, taken = stress_of_nodes(solid, block, v)
        p, c = with_own_pressure(solid, block, v, p), c + taken
    else:
        p = pressure_of(solid, block, v)
    dilatation = own_dilatation(solid, block, v)
    along, across = _shear_stress(c, s, known_gradient(solid, block), dilatation)
    return along, across, p


@inlined
def _elastic_stress_of_nodes(solid: Solid, block: int) -> tuple[Vec3, Vec3, Lanes]:
    """Return xx, yy, zz and yz, xz, xy of S of the averaged shear of a block of nodes, and 0 [Pa].

    From the averages of F, less what tetrahedra take back.
    """
    law = solid.law
    first = width_of(solid.shape) * block
    gradient, _, averaged_q = averages_of(solid, first)
    x, y, z = gradient
    cx, cy, cz = cofactors_of(x, y, z)
    q = stretch_invariant(x, y, z, cx, cy, cz)
    trace = x.x + y.y + z.z
    stiff = stiffens(law)
    of = law_of_nodes(solid, first, q)
    factor = stiffening_factor(of, q) if stiff else isotropic_factor(of, trace, x, y, z)
    c, s = _moduli(of, factor)
    taken, _ = taken_back(averaged_q, q)
    share = splat(law.shear_of_nodes, q)
    c, s = share * (c - shear_of_nodes(solid, first, q) * taken), share * s
    dilatation = trace + (cx.x + cy.y + cz.z) + dot(x, cx)
    along, across = _shear_stress(c, s, gradient, dilatation)
    return along, across, splat(0.0, q)


@inlined
def _moduli(of: LawOfBlock, factor: Lanes) -> tuple[Lanes, Lanes]:
    """Return c and s [Pa] of the shear part c (F - cof F) + s F from `Solid.stiffening`."""
    if stiffens(of.law):
        return of.mu * factor, splat(0.0, factor)
    return splat(0.75, factor) * of.mu, factor


@inlined
def _shear_stress(c: Lanes, s: Lanes, gradient: MatrixRows, dilatation: Lanes) -> tuple[Vec3, Vec3]:
    """Return xx, yy, zz and yz, xz, xy of S [Pa].

    With K = cof F - 1, (cof F)^T cof F = 1 + K + K^T + K^T K: nothing is lost at small strain.

    Args:
        c: See above [Pa].
        s: See above [Pa].
        gradient: Rows of H.
        dilatation: J - 1 of these.
    """
    x, y, z = gradient
    cx, cy, cz = cofactors_of(x, y, z)
    trace = x.x + y.y + z.z
    # The columns of K = (tr H) 1 - H^T + cof H:
    a = Vec3(trace - x.x + cx.x, cy.x - x.y, cz.x - x.z)
    b = Vec3(cx.y - y.x, trace - y.y + cy.y, cz.y - y.z)
    d = Vec3(cx.z - z.x, cy.z - z.y, trace - z.z + cz.z)
    one, zero = splat(1.0, trace), splat(0.0, trace)
    ratio = one + dilatation
    inverse = one / larger(ratio, splat(SMALLEST_RATIO, trace))
    inverse = where_larger(ratio, zero, inverse, zero)
    of_c = c * inverse
    minus = splat(-1.0, trace) * of_c
    along = Vec3(
        of_c * (dilatation - _sum_and_product(a.x, a.x, a, a)) + s,
        of_c * (dilatation - _sum_and_product(b.y, b.y, b, b)) + s,
        of_c * (dilatation - _sum_and_product(d.z, d.z, d, d)) + s,
    )
    across = Vec3(
        minus * _sum_and_product(b.z, d.y, b, d),
        minus * _sum_and_product(a.z, d.x, a, d),
        minus * _sum_and_product(a.y, b.x, a, b),
    )
    return along, across


@inlined
def _sum_and_product(c: Lanes, d: Lanes, a: Vec3, b: Vec3) -> Lanes:
    """Return c + d + a . b."""
    return c + d + (a.x * b.x + a.y * b.y + a.z * b.z)
