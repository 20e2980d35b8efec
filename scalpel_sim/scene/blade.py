"""The blade that the arm holds: a scalpel, one with other measures, or the paper's line."""

import math
from dataclasses import replace

from scalpel_sim.errors import UsageError
from tissue import BladeShape

SCALPEL = BladeShape()
"""A new scalpel blade of the usual sizes, with the defaults of `tissue.BladeShape`."""

ON_FACES = ("blade_friction", "blade_viscosity")
"""Properties of a material that act on the faces of a blade."""


def chosen_blade(
    usual: BladeShape | None,
    *,
    thickness: float | None = None,
    bevel: float | None = None,
    height: float | None = None,
    edge_radius: float | None = None,
) -> BladeShape | None:
    """Return the blade that is asked for; None is a line, the blade of the paper.

    Args:
        usual: The blade where nothing is asked for.
        thickness: Thickness [m]; 0 for a line.
        bevel: Angle between each bevel and the plane of the blade [degree].
        height: Distance from the edge to the back [m].
        edge_radius: Radius of the edge [m].

    Raises:
        UsageError: a line is asked for, and something of a body beside it.
        ValueError: there can be no such blade; `tissue.BladeShape` says why.
    """
    measures = {"bevel": bevel, "height": height, "edge_radius": edge_radius}
    given = {name: value for name, value in measures.items() if value is not None}
    if thickness == 0.0:
        if given:
            option = next(iter(given)).replace("_", "-")
            raise UsageError(
                f"--blade-{option} is about a blade with faces, and --blade-thickness 0 is a line; "
                "omit one of them"
            )
        return None
    if thickness is not None:
        given["thickness"] = thickness
    if "bevel" in given:
        given["bevel_angle"] = math.radians(given.pop("bevel"))
    return replace(usual or SCALPEL, **given) if given else usual


def expect_faces(blade: BladeShape | None, asked: dict[str, object]) -> None:
    """Refuse properties that would change nothing, because this blade has no faces or no radius.

    Args:
        blade: The blade that was chosen.
        asked: The options by name, None for what was not asked for.

    Raises:
        UsageError: friction on the faces of a line, or what a blunt edge adds to a sharp one.
    """
    for name in ON_FACES:
        if blade is None and asked[name] is not None:
            raise UsageError(
                f"--{name.replace('_', '-')} acts on the faces of the blade, and this one is a "
                f"line; add --blade-thickness {SCALPEL.thickness:g}"
            )
    if asked["work_to_rupture"] is not None and (blade is None or blade.edge_radius == 0.0):
        raise UsageError(
            "--work-to-rupture is what a blunt edge adds, and this one has no radius; add "
            f"--blade-edge-radius {SCALPEL.edge_radius:g}"
        )
