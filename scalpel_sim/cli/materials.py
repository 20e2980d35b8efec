"""The materials that come with the project: a table with the source of each figure, and a file."""

import json
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import tomlkit
from rich.console import Console
from rich.table import Table

from scalpel_sim.cli.new_command import write_new_file
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.blade import SCALPEL, table_of_blade
from scalpel_sim.scene.read import PHANTOM, SCENES
from scalpel_sim.scene.schema import BladeTable, MaterialTable
from scalpel_sim.tables.key_texts import texts_of
from scalpel_sim.tables.text_files import SUFFIX
from tissue import DAMPING_BAND, MATERIALS, Material, Preset, SourcedValue

_KPA_PER_PA = 1e-3
_MM_PER_M = 1e3

_WIDTH = 96
"""Length of the lines of a comment."""

_NOT_CONFIRMED = "*"
"""Marks a figure that could not be traced to a measurement."""

HEADINGS = ("name", "E, kPa", "b", "nu", "kg/m³", "J, J/m²", "damping", "friction", "J / E, mm")


def chosen_presets(name: str | None) -> list[Preset]:
    """Return the preset of that name, or all presets.

    Raises:
        UsageError: there is none of that name; the message says which there are.
    """
    if name is None:
        return list(MATERIALS.values())
    if name not in MATERIALS:
        raise unknown("material", name, MATERIALS)
    return [MATERIALS[name]]


def presets_as_json(presets: Sequence[Preset]) -> str:
    """Return the presets and their sources as JSON, SI units."""
    return json.dumps([_as_numbers(preset) for preset in presets], indent=2, ensure_ascii=False)


def print_presets(presets: Sequence[Preset]) -> None:
    """Print a table of the presets, and below it the source of each figure."""
    console = Console()
    table = Table(title="Materials", title_justify="left")
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading == "name" else "right")
    for preset in presets:
        table.add_row(
            preset.name,
            _marked(preset.young_modulus, _KPA_PER_PA),
            _marked(preset.stiffening) if preset.stiffening else "",
            _marked(preset.poisson_ratio),
            _marked(preset.density),
            _marked(preset.toughness),
            _marked(preset.damping_ratio),
            _marked(preset.blade_friction),
            f"{preset.toughness.value / preset.young_modulus.value * _MM_PER_M:.1f}",
        )
    console.print(table)
    low, high = DAMPING_BAND
    console.print(
        f"{_NOT_CONFIRMED} not traced to a measurement: an estimate. E: Young's modulus at small "
        "strain, b: how soon it stiffens, nu: Poisson's ratio, J: toughness of a slow cut. "
        "damping: damping ratio of bending and of stretching at "
        f"{low:g} and {high:g} Hz, less between. friction: on the faces of a blade. J / E: how "
        "far a blade drags tissue along before it parts.",
        markup=False,
        highlight=False,
        soft_wrap=True,
    )
    for preset in presets:
        console.print(
            f"\n[bold]{preset.name}[/bold]: {preset.about}; law {preset.law}", highlight=False
        )
        specimen = SCENES[preset.name].about
        console.print(f"  run {preset.name}: {specimen}", highlight=False, soft_wrap=True)
        for name, figure in preset.values.items():
            mark = "" if figure.is_confirmed else _NOT_CONFIRMED
            line = f"  {name}{mark}: {_measured(figure)}"
            console.print(line, markup=False, highlight=False, soft_wrap=True)


def _marked(figure: SourcedValue, scale: float = 1.0) -> str:
    """Return the number, with a mark if it could not be traced to a measurement."""
    return f"{figure.value * scale:.4g}{'' if figure.is_confirmed else _NOT_CONFIRMED}"


def _as_numbers(preset: Preset) -> dict[str, Any]:
    """Return a preset as numbers and text, for JSON."""
    figures = {name: figure._asdict() for name, figure in preset.values.items()}
    return {"name": preset.name, "about": preset.about, "law": preset.law} | figures


def write_template(path: Path, name: str | None, *, force: bool = False) -> None:
    """Write a file with the numbers of a material and of a scalpel, and a comment on each.

    Args:
        path: The file; its name ends in .toml.
        name: The material; None for the soft gel of the scenes.
        force: Whether a file that exists is replaced.

    Raises:
        UsageError: there is no such material, another suffix, or the file exists and `force` is
            not given.
        RunError: the system refuses.
    """
    if path.suffix.lower() != SUFFIX:
        raise UsageError(f"--write is {path}; its name must end in {SUFFIX}")
    if name is None:
        text = template(PHANTOM, "the soft gel of the scenes")
    else:
        (preset,) = chosen_presets(name)
        text = template(preset.material, f"{preset.name}, {preset.about}", preset)
    write_new_file(path, text, force=force, instead="another --write")


def template(material: Material, about: str, preset: Preset | None = None) -> str:
    """Return the text of a file with all numbers of a material and of a scalpel.

    Args:
        material: Gives the numbers of `[material]`.
        about: What material it is, for the first line.
        preset: Gives the sources of its figures; None without.
    """
    head = (
        f"Start: {about}, and a scalpel. SI units. Use it with `--material FILE --blade FILE`, or "
        "with one of the two. A key that is left out keeps the value of the scene; an option on "
        "the command line, such as --young, overrides the key."
    )
    sources = {} if preset is None else preset.values
    lines = [*_comment(head), "", "[material]", *_keys(MaterialTable, material.as_keys(), sources)]
    lines += ["[blade]", *_keys(BladeTable, msgspec.structs.asdict(table_of_blade(SCALPEL)), {})]
    return "\n".join(lines[:-1]) + "\n"


def _keys(
    table: type[msgspec.Struct], values: dict[str, Any], sources: dict[str, SourcedValue]
) -> list[str]:
    """Return the lines of a table: for each key its meaning, its source and its value."""
    lines = []
    for key, text in texts_of(table).items():
        lines += _comment(re.sub(r"\[([^]]+)\]\([^)]+\)", r"\1", text))  # links are for pages
        if key in sources:
            figure = sources[key]
            confirmed = "" if figure.is_confirmed else " (an estimate: not traced to a measurement)"
            lines += _comment(f"Value: {_measured(figure)}{confirmed}")
        value = msgspec.to_builtins(values[key])
        lines += [f"{key} = {tomlkit.item(value).as_string()}", ""]
    return lines


def _measured(figure: SourcedValue) -> str:
    """Return how a figure was measured, and by whom."""
    return f"{figure.measured} [{figure.source}]" if figure.source else figure.measured


def _comment(text: str) -> list[str]:
    """Return the lines of a comment."""
    return [f"# {line}" for line in textwrap.wrap(text, _WIDTH, break_on_hyphens=False)]
