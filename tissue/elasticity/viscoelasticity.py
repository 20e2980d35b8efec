"""Quasi-linear viscoelasticity: the stress of held tissue relaxes, by a Prony series.

Fung's law (Fung 1993, Biomechanics, section 7.6): the elastic law gives the stress at once, and
held tissue keeps of it

    G(t) = 1 - sum of g_i (1 - exp(-t / tau_i))

The stress is the elastic one less a part for each term, which follows g_i times the elastic stress
with the time constant tau_i, as in a Maxwell element (Simo 1987, Comput. Methods Appl. Mech. Eng.
60:153):

    dR_i/dt = (g_i S - R_i) / tau_i        dr_i/dt = (g_i p - r_i) / tau_i

S is the second Piola-Kirchhoff stress of the shear part of the law, p its pressure. All stress
relaxes: shear and pressure.

R and r are constant while an integrator takes its steps, so that the stages of these see an elastic
body. After each increment of the time step both continue by its length, by the exact solution where
the tissue is held. R then stands for the middle of the next increment, which makes the whole of
second order.

    c (F - cof F) + s F = F S        S = c (1 - (cof F)^T cof F / J) + s 1
"""

import math

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import load_block, splat, store_block, width_of
from tissue.core.simd_rows import larger, where_larger
from tissue.core.vec3 import Vec3
from tissue.elasticity.finite_elements import N_RELAXED, VOLUME, Solid
from tissue.elasticity.gradients import known_gradient, shape_of
from tissue.elasticity.neo_hookean import own_dilatation, pressure_of
from tissue.elasticity.stress import cofactors_of
from tissue.laws.kernels import stiffens

SMALLEST_RATIO = 0.1
"""J below which S is that of a tetrahedron of this J, with less of it: S has the factor 1 / J, and
a tetrahedron that is turned inside out has none."""


_Six = tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]
"""xx, yy, zz, yz, xz and xy of a symmetric matrix."""


@kernel
def prepare_relaxation(solid: Solid, seconds: float) -> None:
    """Note for each term how far it goes to its limit in that time [s], which may be infinite."""
    for term in range(len(solid.relaxing_shares)):
        solid.relaxation_weights[term] = -math.expm1(-seconds / solid.relaxation_times[term])


@kernel
def relax_blocks(solid: Solid, begin: int, end: int) -> None:
    """Relax the stress of the blocks of tetrahedra from `begin` to `end` where they are.

    After `prepare_relaxation` and `tissue.elasticity.neo_hookean.deform_solid`.
    """
    width, n_terms = width_of(solid.shape), len(solid.relaxing_shares)
    for block in range(begin, end):
        xx, yy, zz, yz, xz, xy, p = _elastic_stress(solid, block)
        zero = splat(0.0, p)
        rxx, ryy, rzz, ryz, rxz, rxy, r = zero, zero, zero, zero, zero, zero, zero
        for term in range(n_terms):
            share, weight = solid.relaxing_shares[term], solid.relaxation_weights[term]
            terms, at = solid.relaxed_terms, width * N_RELAXED * (n_terms * block + term)
            rxx = rxx + _relaxed(terms, at, share, weight, xx)
            ryy = ryy + _relaxed(terms, at + width, share, weight, yy)
            rzz = rzz + _relaxed(terms, at + 2 * width, share, weight, zz)
            ryz = ryz + _relaxed(terms, at + 3 * width, share, weight, yz)
            rxz = rxz + _relaxed(terms, at + 4 * width, share, weight, xz)
            rxy = rxy + _relaxed(terms, at + 5 * width, share, weight, xy)
            r = r + _relaxed(terms, at + 6 * width, share, weight, p)
        at = width * N_RELAXED * block
        store_block(solid.relaxed, at, rxx)
        store_block(solid.relaxed, at + width, ryy)
        store_block(solid.relaxed, at + 2 * width, rzz)
        store_block(solid.relaxed, at + 3 * width, ryz)
        store_block(solid.relaxed, at + 4 * width, rxz)
        store_block(solid.relaxed, at + 5 * width, rxy)
        store_block(solid.relaxed, at + 6 * width, r)


@inlined
def _relaxed(terms: FloatArray, at: int, share: float, weight: float, stress: Lanes) -> Lanes:
    """Move a number of a term of a block towards its limit, and return it.

    Args:
        terms: `Solid.relaxed_terms`.
        at: Where the number is.
        share: g of the term.
        weight: How far it goes.
        stress: The same number of the elastic stress.
    """
    old = load_block(terms, at)
    new = old + splat(weight, old) * (splat(share, old) * stress - old)
    store_block(terms, at, new)
    return new


@inlined
def _elastic_stress(solid: Solid, block: int) -> tuple[*_Six, Lanes]:
    """Return xx, yy, zz, yz, xz and xy of S, and p, of the tetrahedra of a block [Pa].

    With K = cof F - 1, (cof F)^T cof F = 1 + K + K^T + K^T K: nothing is lost at small strain.
    """
    law = solid.law
    x, y, z = known_gradient(solid, block)
    v = shape_of(solid, block, VOLUME)
    cx, cy, cz = cofactors_of(x, y, z)
    trace = x.x + y.y + z.z
    factor = load_block(solid.stiffening, width_of(solid.shape) * (1 + block))
    if stiffens(law):
        c = splat(law.mu, v) * factor
        s = splat(0.0, v)
    else:
        c, s = splat(0.75 * law.mu, v), factor
    # The columns of K = (tr H) 1 - H^T + cof H:
    a = Vec3(trace - x.x + cx.x, cy.x - x.y, cz.x - x.z)
    b = Vec3(cx.y - y.x, trace - y.y + cy.y, cz.y - y.z)
    d = Vec3(cx.z - z.x, cy.z - z.y, trace - z.z + cz.z)
    dilatation = own_dilatation(solid, block, v)
    ratio = splat(1.0, v) + dilatation
    inverse = splat(1.0, v) / larger(ratio, splat(SMALLEST_RATIO, v))
    inverse = where_larger(ratio, splat(0.0, v), inverse, splat(0.0, v))
    of_c = c * inverse
    own = (
        of_c * (dilatation - _sum_and_product(a.x, a.x, a, a)) + s,
        of_c * (dilatation - _sum_and_product(b.y, b.y, b, b)) + s,
        of_c * (dilatation - _sum_and_product(d.z, d.z, d, d)) + s,
        splat(-1.0, v) * of_c * _sum_and_product(b.z, d.y, b, d),
        splat(-1.0, v) * of_c * _sum_and_product(a.z, d.x, a, d),
        splat(-1.0, v) * of_c * _sum_and_product(a.y, b.x, a, b),
    )
    return *own, pressure_of(solid, block, v)


@inlined
def _sum_and_product(c: Lanes, d: Lanes, a: Vec3, b: Vec3) -> Lanes:
    """Return c + d + a . b."""
    return c + d + (a.x * b.x + a.y * b.y + a.z * b.z)
