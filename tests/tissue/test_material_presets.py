import pytest

from tissue import DAMPING_BAND, MATERIALS, Preset


def test_there_are_presets_of_common_tissues_and_phantoms():
    assert list(MATERIALS) == ["liver", "kidney", "skin", "fat", "muscle", "gelatin", "silicone"]


@pytest.mark.parametrize("preset", MATERIALS.values(), ids=list(MATERIALS))
def test_every_value_has_a_method_and_a_measured_one_a_source(preset: Preset):
    for quantity in preset.values.values():
        assert quantity.measured
        assert (
            quantity.source or not quantity.is_confirmed or quantity.measured.startswith("chosen")
        )


def test_living_tissue_and_rubber_stiffen_and_gelatin_does_not():
    stiffens = [name for name, preset in MATERIALS.items() if preset.material.stiffens]
    assert stiffens == ["liver", "kidney", "skin", "fat", "muscle", "silicone"]


def test_gelatin_is_as_tough_as_wires_found_it_at_any_speed():
    """Forte et al. 2015: 1.1 J/m2 up to 10 mm/min, and a slope of 0.5 of the logarithms above."""
    gelatin = MATERIALS["gelatin"].material
    for speed in (1.0 / 60.0, 0.06):
        measured = 1.1 * (speed / (10e-3 / 60.0)) ** 0.5
        rise = (speed / gelatin.toughness_speed) ** gelatin.toughness_exponent
        # The law adds both parts, which is 10 % more at 1,000 mm/min and less above.
        assert measured < gelatin.toughness * (1.0 + rise) < 1.101 * measured


@pytest.mark.parametrize("preset", MATERIALS.values(), ids=list(MATERIALS))
def test_the_material_of_a_preset_has_its_values(preset: Preset):
    material = preset.material
    values = preset.values
    damping_ratio = values.pop("damping_ratio").value
    for name, quantity in values.items():
        assert material.as_keys()[name] == quantity.value
    for frequency in DAMPING_BAND:
        assert material.damping_ratio(frequency) == pytest.approx(damping_ratio)
