"""The materials that come with the project, as a table with the source of each figure."""

import json
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from scalpel_sim.errors import unknown
from scalpel_sim.scenes import SCENES
from tissue import DAMPING_BAND, MATERIALS, Preset, SourcedValue

_KPA_PER_PA = 1e-3
_MM_PER_M = 1e3

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
            line = _line(name, figure)
            console.print(line, markup=False, highlight=False, soft_wrap=True)


def _marked(figure: SourcedValue, scale: float = 1.0) -> str:
    """Return the number, with a mark if it could not be traced to a measurement."""
    return f"{figure.value * scale:.4g}{'' if figure.is_confirmed else _NOT_CONFIRMED}"


def _line(name: str, figure: SourcedValue) -> str:
    """Return one line on how a figure was measured, and by whom."""
    mark = "" if figure.is_confirmed else _NOT_CONFIRMED
    source = f" [{figure.source}]" if figure.source else ""
    return f"  {name}{mark}: {figure.measured}{source}"


def _as_numbers(preset: Preset) -> dict[str, Any]:
    """Return a preset as numbers and text, for JSON."""
    figures = {name: figure._asdict() for name, figure in preset.values.items()}
    return {"name": preset.name, "about": preset.about, "law": preset.law} | figures
