"""The toughness law: speed, skin and a blunt edge."""

import pytest

from tissue import BladeShape, Material
from tissue.blade.toughness import skin_toughness_at, toughness_at, toughness_law_of

pytestmark = pytest.mark.kernel


def test_a_slow_cut_costs_the_toughness():
    law = toughness_law_of(Material(toughness=20.0, toughness_exponent=0.5), None)
    assert toughness_at(law, 0.0) == 20.0


def test_toughness_doubles_at_its_speed_and_follows_a_power_law():
    material = Material(toughness=20.0, toughness_exponent=0.5, toughness_speed=0.1)
    law = toughness_law_of(material, None)
    assert toughness_at(law, 0.1) == pytest.approx(40.0)
    assert toughness_at(law, 0.4) == pytest.approx(60.0)


def test_without_an_exponent_toughness_does_not_depend_on_speed():
    assert toughness_at(toughness_law_of(Material(toughness=20.0), None), 10.0) == 20.0


def test_skin_is_never_weaker_than_the_tissue_below():
    skinned = Material(toughness=20.0, skin_toughness=50.0)
    assert toughness_law_of(skinned, None).skin_toughness == 50.0
    assert toughness_law_of(Material(toughness=20.0), None).skin_toughness == 20.0


def test_skin_costs_at_least_what_the_speed_asks_for():
    material = Material(
        toughness=20.0, skin_toughness=50.0, toughness_exponent=0.5, toughness_speed=0.1
    )
    law = toughness_law_of(material, None)
    assert skin_toughness_at(law, 0.1) == 50.0  # the tissue below has 40 J/m2
    assert skin_toughness_at(law, 0.9) == toughness_at(law, 0.9) == pytest.approx(80.0)


def test_a_blunt_edge_destroys_a_layer_twice_as_thick_as_its_radius():
    tissue = Material(toughness=20.0, work_to_rupture=1e5)
    law = toughness_law_of(tissue, BladeShape(edge_radius=50e-6))
    assert law.toughness == pytest.approx(30.0)
    assert law.skin_toughness == pytest.approx(30.0)
