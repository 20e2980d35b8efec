"""Materials by name: liver, kidney, skin, fat, muscle, gelatin, silicone; with the sources.

Values for soft tissue differ by orders of magnitude between methods of measurement, so each value
states how the tissue was loaded. Values that could not be traced to a measurement are marked.
"""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tissue.material import Material

TABLES = Path(__file__).with_name("materials.toml")
"""The materials and their sources."""

DAMPING_BAND = (5.0, 1000.0)
"""Band of frequencies [Hz] at both ends of which the presets have their damping ratio, and less
between: from the first bending mode of a palm-sized body to the rate of haptic devices. With an
upper end of 200 Hz the ratio at 20 Hz would be 0.06, not 0.05, and once a cut has made small
tetrahedra a second would take three times the steps."""


class SourcedValue(NamedTuple):
    """A value of a material, and where it comes from."""

    value: float
    """The value in SI units."""
    measured: str
    """Loading of the material and scatter; or why the value was chosen."""
    source: str = ""
    """Publication of the measurement; empty for a choice of ours."""
    is_confirmed: bool = True
    """Whether the value was found in the source. If not, it is an estimate."""


class Preset(NamedTuple):
    """A material by name."""

    name: str
    """Name of the material."""
    about: str
    """Description in a few words."""
    law: str
    """Name of its law."""
    young_modulus: SourcedValue
    """Young's modulus at small strain [Pa]."""
    poisson_ratio: SourcedValue
    """Poisson's ratio."""
    density: SourcedValue
    """Density [kg/m3]."""
    toughness: SourcedValue
    """Fracture toughness [J/m2]."""
    damping_ratio: SourcedValue
    """Damping ratio of bending and stretching at both ends of `DAMPING_BAND`: half the loss
    tangent."""
    blade_friction: SourcedValue
    """Coulomb's coefficient of friction on the steel of a blade."""
    stiffening: SourcedValue | None = None
    """b of the law `exponential`; None under a law without it."""
    yeoh_second: SourcedValue | None = None
    """C20 / C10 of the law `yeoh`; None under a law without it."""
    toughness_exponent: SourcedValue | None = None
    """Exponent with which toughness rises with speed; None where no rise was measured."""
    toughness_speed: SourcedValue | None = None
    """Speed at which toughness is twice that of a slow cut [m/s]; None where no rise was
    measured."""

    @property
    def values(self) -> dict[str, SourcedValue]:
        """The sourced values that this material has, by the names of their fields."""
        fields = self._asdict().items()
        return {name: value for name, value in fields if isinstance(value, SourcedValue)}

    @property
    def material(self) -> Material:
        """The material, as `Tissue` takes it."""
        numbers: dict[str, Any] = {name: sourced.value for name, sourced in self.values.items()}
        del numbers["damping_ratio"]
        plain = Material(law=self.law, **numbers)
        low, high = DAMPING_BAND
        return plain.with_damping(self.damping_ratio.value, low, up_to=high)


def _presets() -> Iterator[Preset]:
    """Yield the materials of `TABLES`. A text in place of a value names one that they share."""
    tables = tomllib.loads(TABLES.read_text(encoding="utf-8"))
    shared = {name: SourcedValue(**table) for name, table in tables.pop("shared").items()}
    for name, given in tables.items():
        about, law = given.pop("about"), given.pop("law")
        values = {
            key: shared[value] if isinstance(value, str) else SourcedValue(**value)
            for key, value in given.items()
        }
        yield Preset(name, about, law, **values)


MATERIALS = {preset.name: preset for preset in _presets()}
"""The materials by name."""
