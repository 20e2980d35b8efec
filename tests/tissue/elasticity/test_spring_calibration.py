"""Moduli of springs, and the stiffness matrix, against theory."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, naive
from tests.support.materials import SPRINGS
from tissue import Material, block
from tissue.elasticity.spring_calibration import calibrated, spring_error
from tissue.elasticity.stiffness_matrix import edge_springs, masses, stiffness_matrix

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


MESH = bodies.jittered(3, seed=1)
LAWS = {
    "springs": SPRINGS,
    "springs and volume": replace(SPRINGS, poisson_ratio=0.45),
    "neo-Hookean": Material(law="neo_hookean", poisson_ratio=0.45),
}


def motion_of(gradient):
    """Return the displacements of the nodes with a constant gradient, as a flat array [m]."""
    return (MESH.positions @ np.asarray(gradient, dtype=float).T).ravel()


def test_springs_and_masses_are_those_of_the_slow_reference():
    springs = edge_springs(MESH, 10e3)
    slow = naive.stiffnesses(*MESH[:2], 10e3)
    fast = {(int(a), int(b)): k for (a, b), k in zip(*springs, strict=True)}
    assert fast.keys() == slow.keys()
    assert [fast[edge] for edge in slow] == pytest.approx(list(slow.values()), rel=1e-12)
    np.testing.assert_allclose(masses(MESH, 1050.0), naive.masses(*MESH[:2], 1050.0), rtol=1e-12)


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_every_deformation_costs_energy(material):
    dense = stiffness_matrix(block((2, 2, 2), (0.02, 0.02, 0.02)), material).toarray()
    np.testing.assert_allclose(dense, dense.T, atol=1e-12 * dense.max())
    values = np.linalg.eigvalsh(dense)
    assert (np.abs(values[:6]) < 1e-9 * values[-1]).all()  # six rigid motions
    assert values[6] > 1e-4 * values[-1]


@pytest.mark.parametrize("averaged", [True, False])
def test_tetrahedra_follow_hookes_law_under_uniform_strain(averaged):
    """Energy of an affine strain: V (mu eps:eps + lam (tr eps)^2 / 2)."""
    material = Material(law="neo_hookean", poisson_ratio=0.45)
    gradient = np.array([[0.3, 0.1, 0.0], [0.2, -0.4, 0.1], [0.0, 0.5, 0.2]])
    strain = (gradient + gradient.T) / 2.0
    by_hand = material.mu * np.sum(strain**2) + material.lam * np.trace(strain) ** 2 / 2.0
    motion = motion_of(gradient)
    energy = motion @ (stiffness_matrix(MESH, material, averaged=averaged) @ motion) / 2.0
    assert energy / 0.04**3 == pytest.approx(by_hand, rel=1e-12)
