"""Reads the numbers of a material and of a blade from a TOML file: `[material]` and `[blade]`."""

import logging
from pathlib import Path
from typing import Any

import msgspec

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.material import BladeTable, MaterialTable, given_in
from scalpel_sim.tables.toml import as_tables, read_toml
from scalpel_sim.tables.values import TomlTable

HOW_TO_WRITE_ONE = "`scalpel-sim materials --write FILE.toml` writes a file to start from"


class _File(TomlTable, kw_only=True, frozen=True):
    """The whole file."""

    material: MaterialTable | None = None
    blade: BladeTable | None = None


_log = logging.getLogger("scalpel_sim")


def read_material(path: Path) -> dict[str, Any]:
    """Return the fields of `tissue.Material` that a file gives.

    Raises:
        UsageError: the file cannot be read, holds no material, or a key or value is wrong.
    """
    return _given(_read(path).material, path, "material")


def read_blade(path: Path) -> dict[str, float]:
    """Return the measures of a blade that a file gives, under the names of `BladeTable`.

    Raises:
        UsageError: the file cannot be read, holds no blade, or a key or value is wrong.
    """
    return _given(_read(path).blade, path, "blade")


def warn_of_unused_tables(material: Path | None, blade: Path | None) -> None:
    """Log a warning where a file has a table that no option asks for.

    Args:
        material: The file that is given as --material; None without one.
        blade: The file that is given as --blade; None without one.

    Raises:
        UsageError: a file cannot be read, or a key or value is wrong.
    """
    if material is not None and blade is None and _read(material).blade is not None:
        _log.warning("%s: its [blade] is not used; add --blade %s to use it", material, material)
    if blade is not None and material is None and _read(blade).material is not None:
        _log.warning("%s: its [material] is not used; add --material %s to use it", blade, blade)


def _given(table: msgspec.Struct | None, path: Path, name: str) -> dict[str, Any]:
    """Return the keys and values of a table."""
    if table is None:
        raise UsageError(f"{path} has no table [{name}]; {HOW_TO_WRITE_ONE}")
    return given_in(table)


def _read(path: Path) -> _File:
    """Return what is in a file."""
    content = read_toml(path, HOW_TO_WRITE_ONE)
    try:
        return as_tables(content, _File)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
