import pytest

from tissue import DAMPING_BAND, MATERIALS, Preset

FIGURES = (
    "young_modulus",
    "poisson_ratio",
    "density",
    "toughness",
    "blade_friction",
    "damping_ratio",
)


def test_the_tissues_that_surgeons_meet_and_the_phantoms_that_stand_for_them_are_there():
    assert list(MATERIALS) == ["liver", "kidney", "skin", "fat", "muscle", "gelatin", "silicone"]


@pytest.mark.parametrize("preset", MATERIALS.values(), ids=list(MATERIALS))
def test_a_figure_says_how_it_was_measured_and_a_measured_one_says_by_whom(preset: Preset):
    for name in FIGURES:
        figure = getattr(preset, name)
        assert figure.measured
        assert figure.source or not figure.is_confirmed or figure.measured.startswith("chosen")


@pytest.mark.parametrize("preset", MATERIALS.values(), ids=list(MATERIALS))
def test_a_preset_is_the_material_that_it_says(preset: Preset):
    material = preset.material
    for name in FIGURES[:-1]:
        assert getattr(material, name) == getattr(preset, name).value
    assert material.law == "neo_hookean"
    for frequency in DAMPING_BAND:
        assert material.damping_ratio(frequency) == pytest.approx(preset.damping_ratio.value)
