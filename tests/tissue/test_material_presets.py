import pytest

from tissue import DAMPING_BAND, MATERIALS, Preset

QUANTITIES = (
    "young_modulus",
    "poisson_ratio",
    "density",
    "toughness",
    "blade_friction",
    "damping_ratio",
)


def test_there_are_presets_of_common_tissues_and_phantoms():
    assert list(MATERIALS) == ["liver", "kidney", "skin", "fat", "muscle", "gelatin", "silicone"]


@pytest.mark.parametrize("preset", MATERIALS.values(), ids=list(MATERIALS))
def test_every_value_has_a_method_and_a_measured_one_a_source(preset: Preset):
    for name in (*QUANTITIES, *(["stiffening"] if preset.stiffening else [])):
        quantity = getattr(preset, name)
        assert quantity.measured
        assert (
            quantity.source or not quantity.is_confirmed or quantity.measured.startswith("chosen")
        )


def test_living_tissue_stiffens_and_phantoms_do_not():
    stiffens = [name for name, preset in MATERIALS.items() if preset.material.stiffens]
    assert stiffens == ["liver", "kidney", "skin", "fat", "muscle"]


@pytest.mark.parametrize("preset", MATERIALS.values(), ids=list(MATERIALS))
def test_the_material_of_a_preset_has_its_values(preset: Preset):
    material = preset.material
    for name in QUANTITIES[:-1]:
        assert getattr(material, name) == getattr(preset, name).value
    assert material.stiffening == (preset.stiffening.value if preset.stiffening else 0.0)
    for frequency in DAMPING_BAND:
        assert material.damping_ratio(frequency) == pytest.approx(preset.damping_ratio.value)
