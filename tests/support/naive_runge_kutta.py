"""Runge-Kutta methods as published: slow reference versions of the kernels."""

from collections.abc import Callable

import numpy as np

from tissue import FloatArray

Acceleration = Callable[[FloatArray, FloatArray], FloatArray]
"""Acceleration as a function of positions and velocities."""


def nystroem(a: Acceleration, x: FloatArray, v: FloatArray, h: float) -> tuple:
    """Take one step of Nystroem's form, with the correction terms in h^2 (Collatz, chapter 2)."""
    a1 = a(x, v)
    x2 = x + h / 2 * v + h**2 / 8 * a1
    a2 = a(x2, v + h / 2 * a1)
    a3 = a(x2, v + h / 2 * a2)
    a4 = a(x + h * v + h**2 / 2 * a3, v + h * a3)
    return x + h * v + h**2 / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def three_stages(a: Acceleration, x: FloatArray, v: FloatArray, h: float, c: float) -> tuple:
    """Take one step of the Nystroem method of 4th order with three stages, the second at `c`.

    Weights integrate polynomials of third degree; the other coefficients follow from the conditions
    of order (Hairer, Norsett and Wanner I, II.14).
    """
    c3 = (3 - 4 * c) / (4 - 6 * c)
    nodes = np.array([0.0, c, c3])
    weights = np.linalg.solve(np.vander(nodes, increasing=True).T, [1, 1 / 2, 1 / 3])
    a32 = 1 / (24 * weights[2] * c)
    a1 = a(x, v)
    a2 = a(x + c * h * v + c**2 / 2 * h**2 * a1, v)
    a3 = a(x + c3 * h * v + h**2 * ((c3**2 / 2 - a32) * a1 + a32 * a2), v)
    rates = np.array([a1, a2, a3])
    moved = h * v + h**2 * np.tensordot(weights * (1 - nodes), rates, 1)
    return x + moved, v + h * np.tensordot(weights, rates, 1)
