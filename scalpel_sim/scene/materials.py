"""Materials of a scene: from their tables to those of the engine."""

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
from msgspec import structs

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.schema import PresetMaterialTable
from tissue import MATERIALS, Material

Made = TypeVar("Made")
"""Type that `naming_table` returns."""


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
    return Material.of_keys(given)


def material_in(where: str, table: PresetMaterialTable | None, usual: Material) -> Material:
    """Return the material of a part: a preset, or figures that replace those of another.

    Args:
        where: Name of the table that it is in, as a file writes it.
        table: Its material; None: the other.
        usual: The other.

    Raises:
        UsageError: there is no such preset, or the figures make no sense together.
    """
    if table is None:
        return usual

    def made() -> Material:
        if table.preset is not None:
            return material_of(table)
        return usual.changed(**given_in(table))

    return naming_table(where, made)


def given_in(table: msgspec.Struct) -> dict[str, Any]:
    """Return the keys of a table that are given, and their values; rows of it as such too."""
    return {
        key: [given_in(row) for row in value]
        if isinstance(value, list) and value and isinstance(value[0], msgspec.Struct)
        else value
        for key, value in structs.asdict(table).items()
        if value is not None
    }


def naming_table(where: str, make: Callable[[], Made]) -> Made:
    """Return what a function makes; an error of its input says where in the file that stands.

    Args:
        where: Name of a table, as a file writes it.
        make: The function.

    Raises:
        UsageError: the input is wrong.
    """
    try:
        return make()
    except ValueError as error:
        raise UsageError(f"{where}: {error}") from error
