"""Materials are held against measured curves as they were measured."""

import math

import numpy as np
import pytest

from scalpel_sim.validate.findings import FAIL, KNOWN, PASS
from scalpel_sim.validate.measured import homogeneous, silicone_bar
from scalpel_sim.validate.measured.curves import check_curve, measured_curves, simulate
from scalpel_sim.validate.stretch import uniaxial
from tissue import MATERIALS

CURVES = measured_curves().curves


# A block that is deformed evenly


def test_a_pressed_block_has_the_stress_of_its_law_on_any_mesh():
    muscle = MATERIALS["muscle"].material
    along = np.array([0.95, 0.8, 0.7])
    theory = uniaxial(muscle, along)
    paths = [np.diag(homogeneous.stretches_with_free_sides(muscle, stretch)) for stretch in along]
    for cells in ((2, 2, 2), (4, 4, 4)):
        found = homogeneous.stresses(muscle, paths, cells)
        pressure = np.array([stress[0, 0] for stress in found])
        np.testing.assert_allclose(pressure, theory.stress / theory.width**2, rtol=1e-5)
        assert max(abs(stress[1, 1]) for stress in found) < 1e-5 * abs(pressure[-1])


def test_a_small_shear_meets_the_shear_modulus_at_rest_and_more_under_pressure():
    fat = MATERIALS["fat"].material
    at_rest, pressed = homogeneous.shear_moduli(fat, [1.0, 0.8])
    assert at_rest == pytest.approx(fat.mu, rel=1e-3)
    assert pressed > 1.2 * at_rest


# The table


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_a_curve_has_its_points_within_its_spread(curve):
    lists = [
        curve.along,
        curve.measured,
        curve.lowest,
        curve.highest,
        *filter(None, [curve.across]),
    ]
    assert len({len(each) for each in lists}) == 1
    ends = np.sort([curve.lowest, curve.highest], axis=0)
    assert (ends[0] <= curve.measured).all() and (curve.measured <= ends[1]).all()
    assert measured_curves().study_of(curve).why


def test_a_material_within_the_spread_passes_and_one_as_far_out_as_known_is_known():
    curve = CURVES["skin_equibiaxial"]
    assert {check.verdict for check in check_curve(curve, np.array(curve.lowest))} == {PASS}
    assert curve.known is not None
    as_known = np.array(curve.measured) * np.linspace(*curve.known, len(curve.measured))
    assert {check.verdict for check in check_curve(curve, as_known)} == {KNOWN}
    assert {check.verdict for check in check_curve(curve, 0.9 * as_known)} == {FAIL}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_no_material_has_left_its_known_deviation(curve):
    assert FAIL not in {check.verdict for check in check_curve(curve, simulate(curve))}


# The bar of silicone


def test_a_bar_sags_as_measured_under_a_load_that_it_was_not_fitted_to():
    take = silicone_bar.TAKES[1]
    rest = silicone_bar.height_at_rest(take.load)
    checks = silicone_bar.check_take(take, rest, take.deepest, take.interval)
    assert [check.verdict for check in checks] == [PASS, PASS, PASS]
    checks = silicone_bar.check_take(take, 0.9 * rest, 1.3 * take.deepest, 0.8 * take.interval)
    assert [check.verdict for check in checks] == [FAIL, FAIL, FAIL]


def test_the_bar_sags_as_a_solid_of_linear_elasticity():
    rest = silicone_bar.height_at_rest(0.0)
    assert silicone_bar.check_solid(rest).verdict == PASS
    assert silicone_bar.check_solid(0.95 * rest).verdict == FAIL


def test_the_inertia_of_a_weight_slows_the_swing_as_a_mass_on_a_spring():
    intervals = []
    for take in silicone_bar.TAKES[:2]:
        rest = silicone_bar.height_at_rest(take.load, 2)
        intervals.append(silicone_bar.let_go(take.load, rest, 2).interval(rest))
    share_of_mass = 33.0 / 140.0  # of a cantilever that swings as one that bears a load
    bar = 1070.0 * 0.1 * 0.03**2 * share_of_mass
    slower = math.sqrt((bar + 0.51 / 9.81) / bar)
    assert intervals[1] / intervals[0] == pytest.approx(slower, rel=0.05)


def test_a_swing_that_does_not_cross_its_rest_has_no_period():
    still = silicone_bar.Swing(np.arange(5) * 1e-3, np.zeros(5))
    assert math.isnan(still.interval(-0.01))
