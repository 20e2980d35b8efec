from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies
from tests.support.materials import SPRINGS
from tissue import Material, block
from tissue.elasticity.spring_calibration import calibrated, on_surface, spring_error

CELLS = block((4, 4, 4), (0.04, 0.04, 0.04))
RANDOM = bodies.jittered(8, seed=1)
UNIT = replace(SPRINGS, young_modulus=1.0)


def test_moduli_of_springs_on_a_grid_of_cells_are_those_of_theory():
    """By hand: C11 = 13/9, C12 = C44 = 5/18; the diagonals couple stretch to shear."""
    error = spring_error(CELLS, UNIT)
    assert error.affine == pytest.approx((1.36, 0.16, 0.48), rel=0.05)
    assert error.affine.young_modulus == pytest.approx((7 / 6) * 2.0 / (31 / 18), rel=1e-9)
    assert error.relaxed[:2] == pytest.approx((1.03, 0.035), rel=0.05)
    assert error.relaxed.young_modulus == pytest.approx(30 / 29, rel=1e-6)
    assert error.softest < 0.4 < 1.6 < error.stiffest


def test_springs_on_a_random_mesh_are_5_to_16_percent_too_stiff_and_nearly_isotropic():
    error = spring_error(RANDOM, UNIT)
    assert error.affine == pytest.approx((1.16, 0.21, 0.73), rel=0.05)
    assert error.relaxed[:2] == pytest.approx((1.05, 0.21), rel=0.05)


@pytest.mark.parametrize("mesh", [CELLS, bodies.jittered(4, seed=2)], ids=["cells", "random"])
def test_tetrahedra_have_no_error_on_any_mesh(mesh):
    material = Material(young_modulus=4e3, law="neo_hookean", poisson_ratio=0.45)
    error = spring_error(mesh, material)
    for effective in (error.affine, error.relaxed):
        assert effective == pytest.approx(error.asked, rel=1e-6)
    assert (error.softest, error.stiffest) == pytest.approx((4e3, 4e3), rel=1e-6)


@pytest.mark.parametrize("nu", [0.3, 0.45])
def test_a_volume_term_gives_springs_the_requested_bulk_modulus(nu):
    """Springs have a bulk modulus of 2/3 of Young's on any mesh; the volume term adds the rest."""
    material = replace(UNIT, poisson_ratio=nu)
    found = spring_error(RANDOM, material).affine
    bulk = found.young_modulus / (3.0 * (1.0 - 2.0 * found.poisson_ratio))
    assert bulk == pytest.approx(1.0 / (3.0 * (1.0 - 2.0 * nu)), rel=1e-9)


@pytest.mark.parametrize("mesh", [CELLS, RANDOM], ids=["cells", "random"])
@pytest.mark.parametrize("nu", [0.25, 0.45])
def test_calibrated_springs_have_the_requested_modulus(mesh, nu):
    material = calibrated(mesh, replace(SPRINGS, young_modulus=12e3, poisson_ratio=nu))
    assert material.young_modulus == 12e3
    assert spring_error(mesh, material).relaxed.young_modulus == pytest.approx(12e3, rel=1e-4)
    assert 0.7 < material.law.calibration < 1.3


def test_a_law_without_springs_is_not_calibrated():
    with pytest.raises(ValueError, match="no springs to calibrate"):
        calibrated(CELLS, Material(law="neo_hookean"))


def test_the_surface_of_a_grid_is_its_outer_nodes():
    inside = np.all((CELLS.positions > 0.001) & (CELLS.positions < 0.039), axis=1)
    np.testing.assert_array_equal(on_surface(CELLS), ~inside)
