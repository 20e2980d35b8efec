"""Coefficients of stabilised leap-frog local time stepping (Grote, Michel and Sauter 2021).

A macro step of length H takes p substeps. With e the displacement of a node since the begin,
r its acceleration there, and T the Chebyshev polynomials:

    d = 1 + nu / p^2        w = 2 T_p'(d) / T_p(d)
    e_1     = H^2 r(0) / (d w)
    e_{m+1} = 2 T_m / T_{m+1} d e_m - T_{m-1} / T_{m+1} e_{m-1} + 2 T_m / T_{m+1} / w H^2 r(e_m)

so that 2 e_p = H^2 (weighted mean of the r): what leap-frog adds to x_{n+1} - 2 x_n + x_{n-1}.
"""

import functools

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.core.structs import Arrays

STABILISATION = 1.0
"""Default of nu. At 0 the plain scheme (Diaz and Grote 2009) is unstable at many steps far below
the limit.
At 0.05 it is stable up to the limit of the coarse zone as long as strains are small; a body without
any damping, strained by 6 % about a zone 16 times as stiff, still exploded at 0.5, and did not at
1. That costs a quarter more substeps than 0 would."""

MOST_SUBSTEPS = 64
"""Substeps that a macro step takes at most."""


class Chebyshev(Arrays):
    """Coefficients for each substep m from 0 to p - 1, each of shape (p,)."""

    onward: FloatArray
    """Factor of e_m."""
    back: FloatArray
    """Factor of e_{m-1}."""
    push: FloatArray
    """Factor of H^2 r(e_m)."""
    weight: FloatArray
    """Weight of r(e_m) in the mean over the macro step; they add up to 1."""
    limit: float
    """Largest stable angular frequency times step, were all nodes fine; 2 for p = 1."""


@functools.cache
def chebyshev(n_substeps: int, stabilisation: float = STABILISATION) -> Chebyshev:
    """Return the coefficients for p = `n_substeps` and nu = `stabilisation`."""
    p = n_substeps
    d = 1.0 + stabilisation / p**2
    angle = np.arccosh(d)
    t = np.cosh(np.arange(p + 1) * angle)
    w = 2.0 * p * np.sinh(p * angle) / np.sinh(angle) / t[p]
    onward, back, push = np.zeros((3, p))
    push[0] = 1.0 / (d * w)
    onward[1:] = 2.0 * d * t[1:p] / t[2:]
    back[1:] = t[: p - 1] / t[2:]
    push[1:] = 2.0 * t[1:p] / t[2:] / w

    # Row k: the e's that a push of 1 in substep k alone makes.
    before, e = np.zeros((2, p))
    for m in range(p):
        before, e = e, onward[m] * e - back[m] * before + push[m] * (np.arange(p) == m)
    # The step multiplies by T_p(d - (H omega)^2 / w) / T_p(d), which is at most 1 for |...| <= d.
    limit = float(np.sqrt(2.0 * d * w))
    return Chebyshev(onward=onward, back=back, push=push, weight=2.0 * e, limit=limit)


@functools.cache
def substep_limits(stabilisation: float = STABILISATION) -> FloatArray:
    """Return `Chebyshev.limit` for each p from 1 to MOST_SUBSTEPS, shape (MOST_SUBSTEPS + 1,)."""
    every = range(1, MOST_SUBSTEPS + 1)
    return np.array([0.0, *(chebyshev(p, stabilisation).limit for p in every)])
