"""The tables `[material]` and `[blade]`."""

from typing import Any

import msgspec

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.tables.values import (
    LawName,
    NotNegative,
    Positive,
    Ratio,
    Series,
    Text,
    TomlTable,
)
from tissue import MATERIALS, Material


class MaterialTable(TomlTable, kw_only=True, frozen=True):
    """The table `[material]`, with the fields of `tissue.Material`; None for what is not given."""

    law: LawName | None = None
    young_modulus: Positive | None = None
    poisson_ratio: Ratio | None = None
    stiffening: NotNegative | None = None
    yeoh_second: NotNegative | None = None
    yeoh_third: NotNegative | None = None
    prony: Series | None = None
    density: Positive | None = None
    toughness: NotNegative | None = None
    skin_toughness: NotNegative | None = None
    toughness_exponent: NotNegative | None = None
    toughness_speed: Positive | None = None
    work_to_rupture: NotNegative | None = None
    friction: NotNegative | None = None
    blade_friction: NotNegative | None = None
    blade_viscosity: NotNegative | None = None
    viscous_damping: NotNegative | None = None
    retardation_time: NotNegative | None = None
    spring_calibration: Positive | None = None


class PresetMaterialTable(MaterialTable, kw_only=True, frozen=True):
    """`[material]`: a preset and single figures that replace its own, or figures alone."""

    preset: Text | None = None


class BladeTable(TomlTable, kw_only=True, frozen=True):
    """The measures of `[blade]`, as `tissue.BladeShape` has them; None for what is not given.

    The angle of the bevels is in degrees, as on the command line.
    """

    thickness: NotNegative | None = None
    bevel_degrees: Positive | None = None
    height: Positive | None = None
    edge_radius: NotNegative | None = None


def given_in(table: msgspec.Struct) -> dict[str, Any]:
    """Return the keys of a table that are given, and their values; rows of it as such too."""
    given = {
        key: value for key, value in msgspec.structs.asdict(table).items() if value is not None
    }
    return {key: _rows_given(value) for key, value in given.items()}


def _rows_given(value: Any) -> Any:
    """Return rows of a table as the keys that they give; another value as it is."""
    is_rows = isinstance(value, list) and all(isinstance(row, msgspec.Struct) for row in value)
    return [given_in(row) for row in value] if is_rows else value


def material_called(name: str) -> Material:
    """Return the material of that name.

    Raises:
        UsageError: there is none; the message lists them.
    """
    if name not in MATERIALS:
        raise unknown("material", name, MATERIALS)
    return MATERIALS[name].material


def material_of(table: PresetMaterialTable) -> Material:
    """Return the material: figures that are given, those of a preset, and the usual ones.

    Raises:
        UsageError: there is no such preset, or neither a preset nor law and stiffness.
        ValueError: the figures make no sense together.
    """
    given = given_in(table)
    preset = given.pop("preset", None)
    if preset is not None:
        return material_called(preset).changed(**given)
    if "law" not in given or "young_modulus" not in given:
        raise UsageError("it needs a preset, or a law and a young_modulus")
    return Material(**given)
