"""The blade that the arm holds: a scalpel, one with other measures, or the paper's line."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.schema import BladeTable
from tissue import BladeShape

SCALPEL = BladeShape()
"""A new scalpel blade of the usual sizes, with the defaults of `tissue.BladeShape`."""

ON_FACES = ("blade_friction", "blade_viscosity")
"""Properties of a material that act on the faces of a blade."""


def blade_of(table: BladeTable) -> BladeShape | None:
    """Return a blade: a scalpel with some measures replaced, or None for a line.

    Raises:
        UsageError: a line has other measures.
        ValueError: there can be no such blade; `tissue.BladeShape` says why.
    """
    measures = {key: getattr(table, key) for key in BladeTable.__struct_fields__}
    given = {key: value for key, value in measures.items() if value is not None}
    if given.get("thickness") == 0.0:
        if len(given) > 1:
            raise UsageError("it has thickness 0, a line, on which its other measures do not act")
        return None
    if "bevel_degrees" in given:
        given["bevel_angle"] = math.radians(given.pop("bevel_degrees"))
    return replace(SCALPEL, **given)


def table_of_blade(blade: BladeShape | None) -> BladeTable:
    """Return the table of a blade, with all its measures."""
    if blade is None:
        return BladeTable(thickness=0.0)
    return BladeTable(
        thickness=blade.thickness,
        bevel_degrees=_in_degrees(blade.bevel_angle),
        height=blade.height,
        edge_radius=blade.edge_radius,
    )


def expect_faces(blade: BladeShape | None, given: Mapping[str, Any]) -> None:
    """Refuse properties that would change nothing, because this blade has no faces or no radius.

    Args:
        blade: The blade that was chosen.
        given: Options of the material that were given, by name.

    Raises:
        UsageError: friction on the faces of a line, or what a blunt edge adds to a sharp one.
    """
    for name in ON_FACES:
        if blade is None and name in given:
            raise UsageError(
                f"--{name.replace('_', '-')} acts on the faces of the blade, and this one is a "
                f"line; add --blade-thickness {SCALPEL.thickness:g}"
            )
    if "work_to_rupture" in given and (blade is None or blade.edge_radius == 0.0):
        raise UsageError(
            "--work-to-rupture is what a blunt edge adds, and this one has no radius; add "
            f"--blade-edge-radius {SCALPEL.edge_radius:g}"
        )


def _in_degrees(angle: float) -> float:
    """Return an angle in degrees that gives the same bits in radians again, if one does."""
    degrees = math.degrees(angle)
    near = [round(degrees, 9), degrees]
    near += [math.nextafter(degrees, to) for to in (-math.inf, math.inf)]
    return next((each for each in near if math.radians(each) == angle), degrees)
