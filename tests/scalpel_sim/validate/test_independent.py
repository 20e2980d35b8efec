"""Scenes against theory that is not in the engine: stretch, returned energy, insertions."""

import numpy as np
import pytest

from scalpel_sim.validate import coupling, liver, stretch
from scalpel_sim.validate.findings import FAIL, PASS, REGRESSION, THEORY
from tissue import MATERIALS


def verdicts(checks):
    return [check.verdict for check in checks]


# Large stretch


@pytest.mark.parametrize("law", stretch.BARS)
def test_a_formula_begins_with_the_moduli_at_small_strain(law):
    found = stretch.uniaxial(stretch.BARS[law], np.array([0.999, 1.001]))
    assert np.diff(found.stress)[0] / 0.002 == pytest.approx(10e3, rel=1e-4)
    assert -np.diff(found.width)[0] / 0.002 == pytest.approx(0.45, rel=1e-3)


def test_a_bar_passes_with_its_own_law_and_fails_with_another():
    material = stretch.BARS["yeoh"]
    found = stretch.stretched_bar(material)
    theory = stretch.uniaxial(material, found.stretch)
    assert found.stretch[-1] == 2.0 and theory.stress[-1] > 1.4 * 10e3
    checks = stretch.check_stretch("it", found, theory)
    assert verdicts(checks) == [PASS, PASS]
    assert all(abs(check.value - 1.0) < 1e-3 for check in checks)
    other = stretch.uniaxial(stretch.BARS["neo_hookean"], found.stretch)
    assert verdicts(stretch.check_stretch("it", found, other)) == [FAIL, FAIL]


# A published curve


def test_silicone_has_the_shape_of_the_measured_curve_and_no_neo_hookean_has():
    strains, measured = np.array(list(stretch.MEASURED.items())).T
    silicone = MATERIALS["silicone"].material
    shares = stretch.uniaxial(silicone, 1.0 + strains).stress / measured
    assert np.abs(shares - 1.0).max() < 0.04
    plain = silicone.changed(law="neo_hookean")
    shares = stretch.uniaxial(plain, 1.0 + strains).stress / measured
    assert shares.max() / shares.min() > 1.3


# Energy that comes back from a coupling


def test_a_hand_that_gets_back_what_it_put_in_passes_and_one_that_gets_more_fails():
    for most, verdict in ((0.02, PASS), (-0.2, FAIL)):
        work = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, most, 50)]) * 1e-3
        check = coupling.check_returned("releases", 10, work)
        assert check.verdict == verdict and check.basis == THEORY
        assert check.value == pytest.approx(1.0 - most)


def test_energy_that_comes_back_before_it_is_put_in_fails():
    work = np.array([0.0, 0.1, -0.2, 0.5, 1.0]) * 1e-3
    assert coupling.check_returned("taps", 33, work).verdict == FAIL


def test_a_hand_that_never_meets_the_tissue_fails():
    assert coupling.check_returned("holds", 1, np.zeros(9)).verdict == FAIL


def test_the_work_of_forces_and_torques_is_that_of_a_spring():
    """A spring against translation, and one against turning about the edge."""
    distance, angle = 1e-3 * np.sin(np.linspace(0.0, np.pi, 400)), 0.1 * np.linspace(0.0, 1.0, 400)
    zero = np.zeros(400)
    tip = np.column_stack([zero, distance, zero])
    heel = tip + np.array([0.0, 0.0, 0.04])
    forward = np.column_stack([-np.sin(angle), np.cos(angle), zero])
    poses = np.stack([tip, heel, forward], axis=1)
    forces, torques = -500.0 * tip, -2.0 * np.column_stack([zero, zero, angle])
    work = coupling.work_on_tissue(forces, torques, poses)
    stored = 0.5 * 500.0 * distance**2 + 0.5 * 2.0 * angle**2
    np.testing.assert_allclose(work, stored[1:], atol=2e-2 * stored.max())


# Two insertions


def test_two_insertions_pass_with_the_toughness_put_in_and_fail_with_another():
    found = liver.Insertions(None, None, force=164.0, cut=1.0, toughness=164.0)
    checks = liver.check_two_insertions(0.0, found)
    assert verdicts(checks) == [PASS, PASS]
    assert [check.basis for check in checks] == [REGRESSION, THEORY]
    low = found._replace(toughness=0.75 * 164.0, force=0.94 * 164.0)
    assert verdicts(liver.check_two_insertions(0.0, low)) == [FAIL, FAIL]


def test_the_blade_pays_for_half_of_what_is_cut_more_than_swept():
    found = liver.Insertions(None, None, force=1.1 * 164.0, cut=1.2, toughness=164.0)
    assert liver.check_two_insertions(0.0, found)[1].value == pytest.approx(1.0)


def test_a_deep_insertion_that_is_not_steady_fails():
    assert verdicts(liver.check_deep_insertion(164.0, 1.0)) == [PASS, PASS]
    assert verdicts(liver.check_deep_insertion(1.06 * 164.0, 1.12)) == [FAIL, FAIL]
