"""Reads the numbers of a material and of a blade from a TOML file: `[material]` and `[blade]`."""

import logging
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import msgspec
from msgspec import Meta

from scalpel_sim.errors import UsageError, unknown
from tissue import Law

SUFFIX = ".toml"

HOW_TO_WRITE_ONE = "`scalpel-sim materials --write FILE.toml` writes a file to start from"

_LARGEST = sys.float_info.max  # refuses infinity

# The description of each is what an error says the value must be.
_Positive = Annotated[float, Meta(gt=0.0, le=_LARGEST, description="a number above 0")]
_NotNegative = Annotated[float, Meta(ge=0.0, le=_LARGEST, description="a number, 0 or more")]
_Ratio = Annotated[float, Meta(ge=0.0, lt=0.5, description="a number from 0 to below 0.5")]
_Series = Annotated[
    list[tuple[float, float]],
    Meta(description="a list of pairs of numbers, [[g, tau], ...]"),
]
_Law = Annotated[Law, Meta(description=" or ".join(f'"{law}"' for law in get_args(Law)))]


class MaterialTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """The table `[material]`, with the fields of `tissue.Material`; None for what is not given."""

    law: _Law | None = None
    young_modulus: _Positive | None = None
    poisson_ratio: _Ratio | None = None
    stiffening: _NotNegative | None = None
    yeoh_second: _NotNegative | None = None
    yeoh_third: _NotNegative | None = None
    prony: _Series | None = None
    density: _Positive | None = None
    toughness: _NotNegative | None = None
    skin_toughness: _NotNegative | None = None
    toughness_exponent: _NotNegative | None = None
    toughness_speed: _Positive | None = None
    work_to_rupture: _NotNegative | None = None
    friction: _NotNegative | None = None
    blade_friction: _NotNegative | None = None
    blade_viscosity: _NotNegative | None = None
    viscous_damping: _NotNegative | None = None
    retardation_time: _NotNegative | None = None
    spring_calibration: _Positive | None = None


class BladeTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """The table `[blade]`, with the fields of `tissue.BladeShape`; None for what is not given.

    The angle of the bevels is in degrees, as on the command line.
    """

    thickness: _NotNegative | None = None
    bevel_degrees: _Positive | None = None
    height: _Positive | None = None
    edge_radius: _NotNegative | None = None


class _File(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """The whole file."""

    material: MaterialTable | None = None
    blade: BladeTable | None = None


_TABLES: dict[str, type[msgspec.Struct]] = {"material": MaterialTable, "blade": BladeTable}

_log = logging.getLogger("scalpel_sim")


def is_material_file(name: str) -> bool:
    """Whether what was given as a material is the name of a file, rather than of a material."""
    return name.lower().endswith(SUFFIX)


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
    return {key: value for key, value in msgspec.structs.asdict(table).items() if value is not None}


def _read(path: Path) -> _File:
    """Return what is in a file."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UsageError(
            f"{path} cannot be read: {error.strerror or error}; {HOW_TO_WRITE_ONE}"
        ) from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path} is not a text file; {HOW_TO_WRITE_ONE}") from error
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{path} is not valid TOML: {error}; {HOW_TO_WRITE_ONE}") from error
    try:
        return msgspec.convert(content, _File)
    except msgspec.ValidationError as error:
        raise UsageError(f"{path}: {_problem(content) or error}") from error


def _problem(content: Mapping[str, Any]) -> str:
    """Return what is wrong with the first table, key or value that is: for people."""
    for name, table in content.items():
        if name not in _TABLES:
            owner = _owner_of(name)
            if owner is not None:
                return f"{name} stands in no table; write [{owner}] on a line above it"
            return str(unknown("table", name, _TABLES))
        if not isinstance(table, dict):
            return f"{name} is {_as_toml(table)}; it must be a table: [{name}], then a key a line"
        for key, value in table.items():
            problem = _problem_of_key(name, key, value)
            if problem:
                return problem
    return ""


def _problem_of_key(table: str, key: str, value: object) -> str:
    """Return what is wrong with one key and its value; empty if nothing is."""
    types = get_type_hints(_TABLES[table], include_extras=True)
    if key not in types:
        owner = _owner_of(key)
        if owner is not None:
            return f"[{table}] has the key {key}, which belongs to [{owner}]"
        return str(unknown(f"key of [{table}]", key, types))
    wanted = get_args(types[key])[0]
    try:
        msgspec.convert(value, wanted)
    except msgspec.ValidationError:
        allowed = wanted.__metadata__[0].description
        return f"[{table}] {key} is {_as_toml(value)}; it must be {allowed}"
    return ""


def _owner_of(key: str) -> str | None:
    """Return the table that has such a key."""
    return next((name for name, table in _TABLES.items() if key in table.__struct_fields__), None)


def _as_toml(value: object) -> str:
    """Return a value as it stands in the file, cut short if it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
