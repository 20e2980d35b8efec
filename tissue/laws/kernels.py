"""Laws of tissue that stiffens as it is stretched: exponential, and polynomial of third order.

    W = mu/2 w(q) + mu/2 (J - 1)^2 + lam/2 (J_mean - 1)^2      q = I1 - 1 - 2 J

    exponential   w = (exp(b q) - 1) / b         Demiray 1972, J. Biomech. 5:309
    yeoh          w = q + c2 q^2 + c3 q^3        Yeoh 1990, Rubber Chem. Technol. 63:792

Where volume is kept q is I1 - 3, the argument of both papers. Beyond that it makes rest free of
stress with both moduli at small strain for any b: q has no term of first order in the strain. With
I1 - 3 the volume term would have to make up for the pressure of the shear term, and for b above 5
it would be negative.

With H = F - 1 and K = cof F - 1, F - cof F = H - K and

    q = |H|^2 - 2 tr cof H - 2 det H      P = mu g (H - K) + p cof F      g = w'(q)

without any difference of large numbers. Under pure dilatation q is negative: there g is 1.
"""

import math
from typing import NamedTuple

from tissue.core.jit import inlined
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import logarithm, splat
from tissue.core.simd_rows import larger, where_larger
from tissue.core.vec3 import Vec3, dot
from tissue.laws.energy_density import EnergyDensity

LARGEST_EXPONENT = 4.0
"""b q beyond which an exponential law stiffens no more: 55 times its modulus at rest, far beyond
the strain at which tissue tears. It bounds the step of an explicit method."""

_HALVINGS = 5
"""The exponent is halved so many times, and its exponential squared as often."""

_NEWTON_STEPS_EXPONENTIAL = 6
_NEWTON_STEPS_YEOH = 30
"""Steps of Newton's method in `complementary_energy`: from y on, a polynomial of fifth degree falls
to a third in each at first."""

_NO_STRESS = 1e-30
"""Added to y, of which the logarithm is taken."""

_FACTORIALS = (362880.0, 40320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0)
"""Of the series of the exponential: with nine terms its error at an exponent of 4 / 32 is
3e-16."""


class LawOfBlock(NamedTuple):
    """The law of a block of tetrahedra, or of nodes: the constants of each."""

    law: EnergyDensity
    """A law of the same kind: that of the body."""
    mu: Lanes
    """`EnergyDensity.mu` [Pa]."""
    exponent: Lanes
    """`EnergyDensity.exponent`."""
    second: Lanes
    """`EnergyDensity.second`."""
    third: Lanes
    """`EnergyDensity.third`."""


@inlined
def same_law(law: EnergyDensity, like: Lanes) -> LawOfBlock:
    """Return one law for all of a block; `like`: a vector of the type of its numbers."""
    return LawOfBlock(
        law,
        splat(law.mu, like),
        splat(law.exponent, like),
        splat(law.second, like),
        splat(law.third, like),
    )


@inlined
def stiffens(law: EnergyDensity) -> bool:
    """Return whether the law is one of these."""
    return law.exponent > 0.0 or law.second > 0.0 or law.third > 0.0


@inlined
def isotropic_factor(of: LawOfBlock, trace: Lanes, x: Vec3, y: Vec3, z: Vec3) -> Lanes:
    """Return s of the neo-Hookean law [Pa] (`tissue.elasticity.neo_hookean`).

    Args:
        of: The law of the block.
        trace: tr H.
        x: First row of H.
        y: Second row.
        z: Third row.
    """
    grown = trace + trace + (dot(x, x) + dot(y, y) + dot(z, z))  # |F|^2 - 3
    return splat(0.25, trace) * of.mu * grown / (grown + splat(4.0, trace))


@inlined
def stretch_invariant(x: Vec3, y: Vec3, z: Vec3, cx: Vec3, cy: Vec3, cz: Vec3) -> Lanes:
    """Return q.

    Args:
        x: First row of H.
        y: Second row.
        z: Third row.
        cx: First row of cof H.
        cy: Second row.
        cz: Third row.
    """
    squared = dot(x, x) + dot(y, y) + dot(z, z)
    less = cx.x + cy.y + cz.z + dot(x, cx)
    return squared - (less + less)


@inlined
def stiffening_factor(of: LawOfBlock, q: Lanes) -> Lanes:
    """Return g = w'(q), the shear modulus over that at rest."""
    one, positive = splat(1.0, q), larger(q, splat(0.0, q))
    if of.law.exponent > 0.0:
        return one + exponential_less_one(_exponent(of, positive))
    second, third = splat(2.0, q) * of.second, splat(3.0, q) * of.third
    return one + positive * (second + third * positive)


@inlined
def stretch_energy(of: LawOfBlock, q: Lanes) -> Lanes:
    """Return w(q)."""
    positive = larger(q, splat(0.0, q))
    if of.law.exponent > 0.0:
        b = of.exponent
        x = _exponent(of, positive)
        grown = exponential_less_one(x)
        # Beyond the largest exponent, and where q is negative, w continues along its tangent.
        return (grown + (grown + splat(1.0, q)) * (b * q - x)) / b
    return q + positive * positive * (of.second + of.third * positive)


@inlined
def complementary_energy(of: LawOfBlock, y: Lanes) -> Lanes:
    """Return 2 g q - w(q), with q from g^2 q = y.

    With y = |dev S|^2 / (2 mu^2), mu/2 times it is S : E - W at small strain: the energy that the
    stress S has by itself, |dev S|^2 / (4 mu) where nothing stiffens.
    """
    if not stiffens(of.law):
        return y
    q = _stretch_of_exponential(of, y) if of.law.exponent > 0.0 else _stretch_of_yeoh(of, y)
    gq = stiffening_factor(of, q) * q
    return gq + gq - stretch_energy(of, q)


@inlined
def _stretch_of_exponential(of: LawOfBlock, y: Lanes) -> Lanes:
    """Return q of exp(2 b q) q = y: in u = b q the root of 2 u + log u - log(b y), a concave one.

    From the left Newton's method stays there. Beyond `LARGEST_EXPONENT` g is constant.
    """
    one, two, b = splat(1.0, y), splat(2.0, y), of.exponent
    by = b * (y + splat(_NO_STRESS, y))
    goal = logarithm(by)
    u = by / (one + two * by)
    for _ in range(_NEWTON_STEPS_EXPONENTIAL):
        u = u - u * (two * u + logarithm(u) - goal) / (two * u + one)
    factor = math.exp(2.0 * LARGEST_EXPONENT)
    u = where_larger(by, splat(LARGEST_EXPONENT * factor, y), splat(1.0 / factor, y) * by, u)
    return u / b


@inlined
def _stretch_of_yeoh(of: LawOfBlock, y: Lanes) -> Lanes:
    """Return q of g^2 q = y, which is convex: from the right Newton's method stays there."""
    q = y
    for _ in range(_NEWTON_STEPS_YEOH):
        g = stiffening_factor(of, q)
        slope = stiffening_slope(of, q, g)
        q = q - (g * g * q - y) / (g * (g + (slope + slope) * q))
    return q


@inlined
def stiffening_slope(of: LawOfBlock, q: Lanes, g: Lanes) -> Lanes:
    """Return g' = w''(q), given g; 0 where q is negative or the law stiffens no more."""
    zero = splat(0.0, q)
    if of.law.exponent > 0.0:
        b = of.exponent
        slope = where_larger(splat(LARGEST_EXPONENT, q), b * q, b * g, zero)
    else:
        slope = splat(2.0, q) * of.second + splat(6.0, q) * of.third * q
    return where_larger(q, zero, slope, zero)


@inlined
def _exponent(of: LawOfBlock, positive: Lanes) -> Lanes:
    """Return b q, at most `LARGEST_EXPONENT`."""
    x = of.exponent * positive
    over = larger(x - splat(LARGEST_EXPONENT, x), splat(0.0, x))
    return x - over


@inlined
def exponential_less_one(x: Lanes) -> Lanes:
    """Return exp(x) - 1 for x from 0 to `LARGEST_EXPONENT`, without loss where x is small."""
    y = splat(0.5**_HALVINGS, x) * x
    e = splat(1.0 / _FACTORIALS[0], x)
    for factorial in _FACTORIALS[1:]:
        e = e * y + splat(1.0 / factorial, x)
    e = e * y
    for _ in range(_HALVINGS):
        e = e * (e + splat(2.0, x))
    return e
