"""The coefficients of the recursion against Chebyshev polynomials."""

import numpy as np
import pytest

from tissue.integrators.local.chebyshev import MOST_SUBSTEPS, chebyshev, substep_limits

EACH = [(p, nu) for p in (1, 2, 3, 4, 8, 16) for nu in (0.05, 1.0)]


def stretch(p: int, nu: float, phase: float) -> float:
    """Return e_p of one node on a spring, x'' = -w^2 x from x = 1, with w H = `phase`."""
    c = chebyshev(p, nu)
    before = e = 0.0
    for m in range(p):
        r = -(phase**2) * (1.0 + e)
        before, e = e, c.onward[m] * e - c.back[m] * before + c.push[m] * r
    return e


@pytest.mark.parametrize(("p", "nu"), EACH)
def test_a_constant_force_gives_the_impulse_of_leap_frog(p, nu):
    """The weights add up to 1: an impulse is the force times the time."""
    assert chebyshev(p, nu).weight.sum() == pytest.approx(1.0, rel=1e-13)
    assert (chebyshev(p, nu).weight > 0.0).all()


@pytest.mark.parametrize(("p", "nu"), EACH)
def test_the_step_is_a_quotient_of_chebyshev_polynomials(p, nu):
    """1 + e_p = T_p(d - (w H)^2 / w_p) / T_p(d), for w_p = 2 T_p'(d) / T_p(d)."""
    d = 1.0 + nu / p**2
    t = np.polynomial.chebyshev.Chebyshev.basis(p)
    w = 2.0 * t.deriv()(d) / t(d)
    for phase in (0.1, 1.0, 1.9):
        expected = t(d - phase**2 / w) / t(d)
        assert 1.0 + stretch(p, nu, phase) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("p", "nu"), EACH)
def test_the_limit_is_where_the_step_begins_to_grow(p, nu):
    """|1 + e_p| <= 1 keeps the leap-frog recursion bounded."""
    limit = chebyshev(p, nu).limit
    below = [abs(1.0 + stretch(p, nu, phase)) for phase in np.linspace(0.01, limit, 200)]
    assert max(below) <= 1.0 + 1e-12
    assert abs(1.0 + stretch(p, nu, 1.01 * limit)) > 1.0


def test_one_substep_is_leap_frog():
    assert chebyshev(1).limit == pytest.approx(2.0)
    assert stretch(1, 1.0, 0.7) == pytest.approx(-0.5 * 0.7**2)


def test_stability_limits_grow_in_proportion_to_the_substeps():
    limits = substep_limits()
    assert len(limits) == MOST_SUBSTEPS + 1
    assert (np.diff(limits[1:]) > 1.4).all()
    assert limits[8] > 0.75 * 2.0 * 8
