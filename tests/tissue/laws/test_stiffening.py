"""Laws that stiffen, against the formulas of their papers."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.support import bodies
from tests.tissue.solids import lame, solid_of
from tissue.laws.energy_density import exponential, polynomial
from tissue.laws.kernels import LARGEST_EXPONENT, exponential_less_one

pytestmark = pytest.mark.kernel

CUBE = bodies.jittered_grid(2, 1, size=1.0)
MU, LAM = lame(0.49995)

FORMULAS = {
    # -(dW/dI1) / mu of the papers, at I1 - 3
    "exponential": (exponential(MU, LAM, 1.5), lambda i: 0.5 * np.exp(1.5 * i)),
    "yeoh": (
        polynomial(MU, LAM, 0.3, 0.1),
        lambda i: 0.5 * (1.0 + 2.0 * 0.3 * i + 3.0 * 0.1 * i**2),
    ),
}


def pull(solid, stretch, narrowing):
    """Return the force that holds the far end of a cube, and the force on its sides [N]."""
    x = CUBE.positions * [stretch, narrowing, narrowing]
    forces, at = solid.forces(x), CUBE.positions
    return -forces[at[:, 0] > 1.0 - 1e-9, 0].sum(), -forces[at[:, 1] > 1.0 - 1e-9, 1].sum()


@pytest.mark.parametrize("law", FORMULAS)
@pytest.mark.parametrize("stretch", [0.7, 1.3, 2.0])
def test_a_bar_pulled_to_twice_its_length_follows_the_formula_of_the_paper(stretch, law):
    """Incompressible: stress 2 dW/dI1 (l - 1 / l^2). Here Poisson's ratio is 0.49995."""
    density, slope = FORMULAS[law]
    solid = solid_of(CUBE, density)
    narrowing = brentq(lambda s: pull(solid, stretch, s)[1], 0.5, 1.5)
    expected = 2.0 * MU * slope(stretch**2 + 2.0 / stretch - 3.0) * (stretch - stretch**-2)
    assert pull(solid, stretch, narrowing)[0] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_the_exponential_is_exact_from_the_smallest_to_the_largest_argument(dtype):
    """Within two roundings: each of the five squarings doubles the error of the one before."""
    x = np.array([0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 3.0, LARGEST_EXPONENT], dtype)
    series = getattr(exponential_less_one, "py_func", exponential_less_one)
    np.testing.assert_allclose(series(x), np.expm1(x), rtol=64.0 * np.finfo(dtype).eps)
