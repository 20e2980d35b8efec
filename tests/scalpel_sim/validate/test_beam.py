"""The bar of the validation: theory of beam and solid, and what fails when the engine is wrong."""

import math

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from scalpel_sim.validate import bar, beam, clamped_solid
from scalpel_sim.validate.findings import FAIL, PASS
from tissue import fixed_nodes
from tissue.elasticity.stiffness_matrix import masses, stiffness_matrix


def verdicts(checks):
    return [check.verdict for check in checks]


# The beam


@pytest.fixture
def slender(monkeypatch):
    """A bar so slender that shear and rotary inertia do not count: E I and mass per length."""
    monkeypatch.setattr(bar, "BAR_THICKNESS", 1e-3)
    return 1e6 * 1e-12 / 12.0, 1000.0 * 1e-6


@pytest.mark.parametrize(("period", "root"), [("period", 1.8751041), ("free_period", 4.7300407)])
def test_the_period_of_a_slender_beam_is_eulers(slender, period, root):
    bending, per_length = slender
    euler = 2.0 * math.pi * 0.1**2 / root**2 * math.sqrt(per_length / bending)
    assert getattr(bar.beam_theory(0.0), period) == pytest.approx(euler, rel=1e-3)


def test_the_sag_of_a_slender_beam_is_eulers(slender):
    bending, per_length = slender
    weight = 9.81 * per_length * 0.1
    theory = bar.beam_theory(0.3)
    assert theory.sag_of_weight == pytest.approx(weight * 0.1**3 / (8 * bending), rel=1e-3)
    assert theory.sag_of_load == pytest.approx(weight * 0.1**3 / (3 * bending), rel=1e-3)


# The clamped solid


def shares_of_beam(poisson_ratio):
    solid, theory = (
        clamped_solid.clamped_solid(poisson_ratio),
        bar.beam_theory(poisson_ratio),
    )
    return [getattr(solid, name) / getattr(theory, name) for name in solid._fields]


def test_a_clamped_solid_that_does_not_narrow_does_as_the_beam():
    assert shares_of_beam(0.0) == pytest.approx([1.0, 1.0, 1.0], abs=1e-3)


def test_a_clamp_hinders_less_than_if_no_section_could_narrow():
    """A plate that cannot narrow at all sags 1 - nu^2 of the beam."""
    for share, least in zip(shares_of_beam(0.45), (0.7975, 0.7975, 0.893), strict=True):
        assert least < share < 0.98


def test_the_clamped_solid_hardly_depends_on_its_grid(monkeypatch):
    fine = shares_of_beam(0.45)
    monkeypatch.setattr(clamped_solid, "N_TOWARDS_EDGE", 3)
    assert shares_of_beam(0.45) == pytest.approx(fine, rel=1e-3)


# The clamped bar


@pytest.fixture(scope="module")
def coarse_bar():
    return beam.swing(0.0, 3)


def test_the_bar_sags_as_its_stiffness_matrix_says(coarse_bar):
    material, mesh = bar.bar_material(0.0), bar.bar_mesh(3)
    is_free = np.repeat(~fixed_nodes(mesh, "left"), 3)
    matrix = stiffness_matrix(mesh, material, element="averaged")[is_free][:, is_free].tocsc()
    weight = np.zeros((len(mesh.positions), 3))
    weight[:, 2] = -9.81 * masses(mesh, material.density)
    moved = np.zeros(is_free.size)
    moved[is_free] = splu(matrix).solve(weight.ravel()[is_free])
    sag = -moved.reshape(-1, 3)[fixed_nodes(mesh, "right"), 2].mean()
    assert coarse_bar.sag_of_weight == pytest.approx(sag, rel=5e-3)


def test_a_bar_swings_with_the_frequency_that_its_sag_implies(coarse_bar):
    theory = bar.beam_theory(0.0)
    stiffer = theory.sag_of_weight / coarse_bar.sag_of_weight
    slower = coarse_bar.period / theory.period
    assert slower == pytest.approx(math.sqrt(1.0 / stiffer), rel=0.02)


@pytest.mark.parametrize("of", [bar.beam_theory, clamped_solid.clamped_solid])
def test_a_bar_on_a_coarse_mesh_fails_and_one_that_does_as_theory_says_passes(coarse_bar, of):
    theory = of(0.0)
    assert verdicts(beam.check_bar("it", coarse_bar, theory)) == [FAIL, FAIL, PASS]
    names = clamped_solid.ClampedSolid._fields
    right = coarse_bar._replace(**{name: getattr(theory, name) for name in names})
    assert verdicts(beam.check_bar("it", right, theory)) == [PASS] * 3
    for name in names:
        wrong = right._replace(**{name: 1.04 * getattr(theory, name)})
        assert verdicts(beam.check_bar("it", wrong, theory)).count(FAIL) == 1


def test_a_bar_that_does_not_narrow_is_within_three_percent_on_six_cells(coarse_bar):
    fine, theory = beam.swing(0.0, 6), bar.beam_theory(0.0)
    assert verdicts(beam.check_bar("it", fine, theory)) == [PASS] * 3
    assert verdicts(beam.check_bar("it", beam.extrapolated(coarse_bar, fine), theory)) == [PASS] * 3


def test_the_limit_of_an_error_of_second_order_has_none(coarse_bar):
    """Errors of 8 and 2 % of sags and of squared frequencies on cells of two sizes, 2 to 1."""
    coarse = coarse_bar._replace(sag_of_weight=0.92, sag_of_load=1.84, period=1.08**-0.5)
    fine = coarse_bar._replace(sag_of_weight=0.98, sag_of_load=1.96, period=1.02**-0.5)
    assert beam.extrapolated(coarse, fine)[:3] == pytest.approx((1.0, 2.0, 1.0))


# The free bar


def test_a_free_bar_is_within_three_percent_on_a_lattice_of_six_cells():
    bars = [beam.bent_and_let_go(0.45, across) for across in beam.CELLS_ACROSS]
    checks = beam.check_free_bar("it", *bars)
    assert verdicts(checks) == [PASS] * 5
    assert checks[3].value == pytest.approx(1.0, abs=0.005)


def free(across, *, error):
    """A bar that is too stiff by `error`, and swings with the frequency of that stiffness."""
    return beam.FreeBar(across, 1.0 + error, (1.0 + error) ** -0.5)


def test_a_free_bar_that_goes_to_theory_with_the_square_passes():
    checks = beam.check_free_bar("it", free(3, error=0.08), free(6, error=0.02))
    assert verdicts(checks) == [PASS] * 5
    assert [check.value for check in checks[2:]] == pytest.approx([2.0, 1.0, 1.0])


def test_the_strongest_of_two_swings_has_the_period():
    time = np.linspace(0.0, 6.5, 326)
    swing = np.cos(2.0 * np.pi * time / 1.01) + 0.5 * np.cos(2.0 * np.pi * 3.19 * time)
    assert beam.strongest_period(time, swing) == pytest.approx(1.01, rel=1e-3)


@pytest.mark.parametrize(
    ("coarse", "fine", "expected"),
    [
        (0.24, 0.12, [FAIL] * 5),  # of first order
        (0.05, 0.05, [FAIL, PASS, FAIL, FAIL, PASS]),  # another stiffness on every mesh
        (0.05, 0.04, [FAIL, PASS, FAIL, FAIL, PASS]),
        (-0.02, 0.02, [PASS, PASS, FAIL, FAIL, PASS]),
    ],
)
def test_a_free_bar_that_goes_elsewhere_or_slower_fails(coarse, fine, expected):
    checks = beam.check_free_bar("it", free(3, error=coarse), free(6, error=fine))
    assert verdicts(checks) == expected


def test_a_couple_at_an_end_has_no_resultant():
    mesh = bar.bar_mesh(2)
    forces = beam.forces_of_couple(mesh, "right", 2e-3)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-15)
    moment = np.cross(mesh.positions - [0.1, 0.015, 0.015], forces).sum(axis=0)
    np.testing.assert_allclose(moment, [0.0, 2e-3, 0.0], atol=1e-15)
