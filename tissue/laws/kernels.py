"""What laws differ in: their shear terms, and the branch between them.

    P = c (F - cof F) + s F + p cof F

p is the pressure of the volume term, the same under each law. The stable neo-Hookean law has

    c = 3/4 mu        s = mu (|F|^2 - 3) / (4 (|F|^2 + 1))

and laws of tissue that stiffens as it is stretched have s = 0, c = mu g, g = w'(q) and

    W = mu/2 w(q) + mu/2 (J - 1)^2 + lam/2 (J_mean - 1)^2      q = I1 - 1 - 2 J

    exponential   w = (exp(b q) - 1) / b         Demiray 1972, J. Biomech. 5:309
    polynomial    w = q + c2 q^2 + c3 q^3        Yeoh 1990, Rubber Chem. Technol. 63:792

Where volume is kept q is I1 - 3, the argument of both papers. Beyond that it makes rest free of
stress with both moduli at small strain for any b: q has no term of first order in the strain. With
I1 - 3 the volume term would have to make up for the pressure of the shear term, and for b above 5
it would be negative.

With H = F - 1 and K = cof F - 1, F - cof F = H - K and

    q = |H|^2 - 2 tr cof H - 2 det H

without any difference of large numbers. Under pure dilatation q is negative: there g is 1.

A form of its own needs w, g, g' and the inverse of g^2 q here, and a branch in each of the four
functions that choose by the form.
"""

import math

from tissue.core.jit import inlined
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import alike, logarithm
from tissue.core.simd_rows import larger, where_larger
from tissue.core.vec3 import Vec3, dot
from tissue.laws.energy_density import EXPONENTIAL, NEO_HOOKEAN, EnergyDensity

LARGEST_EXPONENT = 4.0
"""b q beyond which an exponential law stiffens no more: 55 times its modulus at rest, far beyond
the strain at which tissue tears. It bounds the step of an explicit method."""

_HALVINGS = 5
"""The exponent is halved so many times, and its exponential squared as often."""

_NEWTON_STEPS_EXPONENTIAL = 6
_NEWTON_STEPS_POLYNOMIAL = 30
"""Steps of Newton's method in `complementary_energy`: from y on, a polynomial of fifth degree falls
to a third in each at first."""

_NO_STRESS = 1e-30
"""Added to y, of which the logarithm is taken."""

_FACTORIALS = (362880.0, 40320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0)
"""Of the series of the exponential: with nine terms its error at an exponent of 4 / 32 is
3e-16."""

Rows = tuple[Vec3, Vec3, Vec3]
"""The rows of a matrix."""


@inlined
def stiffens(law: EnergyDensity) -> bool:
    """Return whether the law stiffens."""
    return law.form != NEO_HOOKEAN


@inlined
def shear_factors(
    law: EnergyDensity, trace: Lanes, gradient: Rows, cofactors: Rows
) -> tuple[Lanes, Lanes]:
    """Return c and s of the law [Pa].

    Args:
        law: The law.
        trace: tr H.
        gradient: Rows of H.
        cofactors: Rows of cof H.
    """
    if stiffens(law):
        c = alike(law.mu, trace) * stiffening_factor(law, stretch_invariant(gradient, cofactors))
        return c, alike(0.0, trace)
    grown = _growth_of_square(trace, gradient)
    s = alike(0.25 * law.mu, trace) * grown / (grown + alike(4.0, trace))
    return alike(0.75 * law.mu, trace), s


@inlined
def shear_energy(law: EnergyDensity, trace: Lanes, gradient: Rows, cofactors: Rows) -> Lanes:
    """Return the energy of the shear term over mu / 2; arguments as of `shear_factors`."""
    if stiffens(law):
        return stretch_energy(law, stretch_invariant(gradient, cofactors))
    grown = _growth_of_square(trace, gradient)
    return grown - logarithm(alike(1.0, trace) + alike(0.25, trace) * grown)


@inlined
def _growth_of_square(trace: Lanes, gradient: Rows) -> Lanes:
    """Return |F|^2 - 3."""
    x, y, z = gradient
    return trace + trace + (dot(x, x) + dot(y, y) + dot(z, z))


@inlined
def stretch_invariant(gradient: Rows, cofactors: Rows) -> Lanes:
    """Return q, from the rows of H and of cof H."""
    x, y, z = gradient
    cx, cy, cz = cofactors
    squared = dot(x, x) + dot(y, y) + dot(z, z)
    less = cx.x + cy.y + cz.z + dot(x, cx)
    return squared - (less + less)


@inlined
def stiffening_factor(law: EnergyDensity, q: Lanes) -> Lanes:
    """Return g = w'(q), the shear modulus over that at rest."""
    if law.form == EXPONENTIAL:
        return _factor_of_exponential(law, q)
    return _factor_of_polynomial(law, q)


@inlined
def stiffening_slope(law: EnergyDensity, q: Lanes, g: Lanes) -> Lanes:
    """Return g' = w''(q), given g; 0 where q is negative or the law stiffens no more."""
    if law.form == EXPONENTIAL:
        slope = _slope_of_exponential(law, q, g)
    else:
        slope = _slope_of_polynomial(law, q)
    zero = alike(0.0, q)
    return where_larger(q, zero, slope, zero)


@inlined
def stretch_energy(law: EnergyDensity, q: Lanes) -> Lanes:
    """Return w(q)."""
    if law.form == EXPONENTIAL:
        return _energy_of_exponential(law, q)
    return _energy_of_polynomial(law, q)


@inlined
def complementary_energy(law: EnergyDensity, y: Lanes) -> Lanes:
    """Return 2 g q - w(q), with q from g^2 q = y.

    With y = |dev S|^2 / (2 mu^2), mu/2 times it is S : E - W at small strain: the energy that the
    stress S has by itself, |dev S|^2 / (4 mu) where nothing stiffens.
    """
    if not stiffens(law):
        return y
    if law.form == EXPONENTIAL:
        q = _stretch_of_exponential(law, y)
    else:
        q = _stretch_of_polynomial(law, y)
    gq = stiffening_factor(law, q) * q
    return gq + gq - stretch_energy(law, q)


@inlined
def _factor_of_exponential(law: EnergyDensity, q: Lanes) -> Lanes:
    positive = larger(q, alike(0.0, q))
    return alike(1.0, q) + exponential_less_one(_exponent(law, positive))


@inlined
def _slope_of_exponential(law: EnergyDensity, q: Lanes, g: Lanes) -> Lanes:
    b = alike(law.first, q)
    return where_larger(alike(LARGEST_EXPONENT, q), b * q, b * g, alike(0.0, q))


@inlined
def _energy_of_exponential(law: EnergyDensity, q: Lanes) -> Lanes:
    """Return w; beyond the largest exponent, and where q is negative, along its tangent."""
    b = alike(law.first, q)
    x = _exponent(law, larger(q, alike(0.0, q)))
    grown = exponential_less_one(x)
    return (grown + (grown + alike(1.0, q)) * (b * q - x)) / b


@inlined
def _stretch_of_exponential(law: EnergyDensity, y: Lanes) -> Lanes:
    """Return q of exp(2 b q) q = y: in u = b q the root of 2 u + log u - log(b y), a concave one.

    From the left Newton's method stays there. Beyond `LARGEST_EXPONENT` g is constant.
    """
    one, two, b = alike(1.0, y), alike(2.0, y), alike(law.first, y)
    by = b * (y + alike(_NO_STRESS, y))
    goal = logarithm(by)
    u = by / (one + two * by)
    for _ in range(_NEWTON_STEPS_EXPONENTIAL):
        u = u - u * (two * u + logarithm(u) - goal) / (two * u + one)
    factor = math.exp(2.0 * LARGEST_EXPONENT)
    u = where_larger(by, alike(LARGEST_EXPONENT * factor, y), alike(1.0 / factor, y) * by, u)
    return u / b


@inlined
def _factor_of_polynomial(law: EnergyDensity, q: Lanes) -> Lanes:
    positive = larger(q, alike(0.0, q))
    second, third = alike(2.0 * law.first, q), alike(3.0 * law.second, q)
    return alike(1.0, q) + positive * (second + third * positive)


@inlined
def _slope_of_polynomial(law: EnergyDensity, q: Lanes) -> Lanes:
    return alike(2.0 * law.first, q) + alike(6.0 * law.second, q) * q


@inlined
def _energy_of_polynomial(law: EnergyDensity, q: Lanes) -> Lanes:
    positive = larger(q, alike(0.0, q))
    second, third = alike(law.first, q), alike(law.second, q)
    return q + positive * positive * (second + third * positive)


@inlined
def _stretch_of_polynomial(law: EnergyDensity, y: Lanes) -> Lanes:
    """Return q of g^2 q = y, which is convex: from the right Newton's method stays there."""
    q = y
    for _ in range(_NEWTON_STEPS_POLYNOMIAL):
        g = stiffening_factor(law, q)
        slope = stiffening_slope(law, q, g)
        q = q - (g * g * q - y) / (g * (g + (slope + slope) * q))
    return q


@inlined
def _exponent(law: EnergyDensity, positive: Lanes) -> Lanes:
    """Return b q, at most `LARGEST_EXPONENT`."""
    x = alike(law.first, positive) * positive
    over = larger(x - alike(LARGEST_EXPONENT, x), alike(0.0, x))
    return x - over


@inlined
def exponential_less_one(x: Lanes) -> Lanes:
    """Return exp(x) - 1 for x from 0 to `LARGEST_EXPONENT`, without loss where x is small."""
    y = alike(0.5**_HALVINGS, x) * x
    e = alike(1.0 / _FACTORIALS[0], x)
    for factorial in _FACTORIALS[1:]:
        e = e * y + alike(1.0 / factorial, x)
    e = e * y
    for _ in range(_HALVINGS):
        e = e * (e + alike(2.0, x))
    return e
