"""From a scene to a file that gives the same run."""

import math
import os
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import tomlkit

from scalpel_sim.scene_parts.scene import Scene
from scalpel_sim.tables.body import BodySource, BodyTable
from scalpel_sim.tables.grasper import GrasperTable
from scalpel_sim.tables.material import given_in
from tissue import BladeShape

_HEAD = """\
# The scene of a run, with every number as it was. `scalpel-sim run` and this file do it again.
"""


def scene_text(scene: Scene, path: Path) -> str | None:
    """Return the text of a scene file; None where the scene's body is in no table.

    Args:
        scene: The scene.
        path: Where the file will be: files that the scene names are relative to it.
    """
    if not isinstance(scene.mesh, BodySource):
        return None
    return f"{_HEAD}\n{tomlkit.dumps(content_of(scene, path.parent))}"


def content_of(scene: Scene, folder: Path) -> dict[str, Any]:
    """Return the tables of a scene, with every number that decides what it does.

    Args:
        scene: A scene whose mesh is a `BodySource`.
        folder: What its relative paths shall be relative to.
    """
    assert isinstance(scene.mesh, BodySource)
    strokes = [given_in(stroke) for stroke in scene.strokes]
    for stroke in strokes:
        if "file" in stroke:
            stroke["file"] = relative_path(Path(stroke["file"]), folder)
    attachments = [given_in(attachment) for attachment in scene.attachments]
    graspers = [_grasper(grasper, folder) for grasper in scene.graspers]
    run = {} if scene.seconds is None else {"seconds": scene.seconds}
    return {
        "name": scene.name,
        "about": scene.about,
        **run,
        "body": _body(scene, folder),
        "material": {
            field.name: _as_list(getattr(scene.material, field.name))
            for field in fields(scene.material)
        },
        "blade": _blade(scene.blade),
        "world": _given(
            {
                "gravity": scene.gravity,
                "floor": scene.floor,
                "table": scene.table,
                "table_friction": scene.table_friction,
            }
            | _place(scene)
        ),
        "solver": _given(
            {
                "scheme": scene.scheme,
                "relaxation": scene.relaxation,
                "mass_scaling": scene.mass_scaling,
                "precision": scene.precision,
                "threads": scene.threads,
                "snap": scene.cut.snap,
                "snap_floor": scene.cut.floor,
                "guard": scene.cut.guard,
                "crumb": scene.cut.crumb,
                "audit": scene.audit,
            }
        ),
        "arm": _given(
            {
                **_arm(scene, folder),
                "tissue_every": scene.tissue_every,
                "coupling": scene.coupling,
                "coupling_stiffness": scene.coupling_stiffness,
                "coupling_damping": scene.coupling_damping,
                "passivity": scene.passivity,
            }
        ),
        **({"attachment": attachments} if attachments else {}),
        **({"grasper": graspers} if graspers else {}),
        "stroke": strokes,
        **_views(scene),
    }


def _grasper(grasper: GrasperTable, folder: Path) -> dict[str, Any]:
    """Return a row of `[[grasper]]`."""
    given = given_in(grasper)
    if grasper.recorded is not None:
        del given["motion"]  # it is empty
    for key in ("model", "recorded"):
        if key in given:
            given[key] = relative_path(Path(given[key]), folder)
    return given


def _views(scene: Scene) -> dict[str, Any]:
    """Return the rows of `[[view]]`, if there are any."""
    views = [given_in(view) for view in scene.views]
    return {"view": views} if views else {}


def _arm(scene: Scene, folder: Path) -> dict[str, Any]:
    """Return the keys of `[arm]` that say which arm it is."""
    if scene.own_arm is None:
        return {"preset": scene.arm}
    found = _given(asdict(scene.own_arm))
    found["model"] = relative_path(Path(found["model"]), folder)
    return {key: value for key, value in found.items() if key not in ("pos", "quat")}


def _place(scene: Scene) -> dict[str, Any]:
    """Return the keys of `[world]` that say where the tissue lies in the world of an own arm."""
    own = scene.own_arm
    return {} if own is None else {"pos": own.pos, "quat": own.quat}


def _body(scene: Scene, folder: Path) -> dict[str, Any]:
    """Return the table `[body]`."""
    assert isinstance(scene.mesh, BodySource)
    table = scene.mesh.table
    given = _given({key: getattr(table, key) for key in BodyTable.__struct_fields__})
    if table.file is not None:
        given["file"] = relative_path(scene.mesh.folder / table.file, folder)
    return given | {"fixed": scene.fixed, "stretch": scene.stretch}


def _blade(blade: BladeShape | None) -> dict[str, float]:
    """Return the table `[blade]`."""
    if blade is None:
        return {"thickness": 0.0}
    return {
        "thickness": blade.thickness,
        "bevel_degrees": _in_degrees(blade.bevel_angle),
        "height": blade.height,
        "edge_radius": blade.edge_radius,
    }


def _in_degrees(angle: float) -> float:
    """Return an angle in degrees that gives the same bits in radians again, if one does."""
    degrees = math.degrees(angle)
    near = [round(degrees, 9), degrees]
    near += [math.nextafter(degrees, to) for to in (-math.inf, math.inf)]
    return next((each for each in near if math.radians(each) == angle), degrees)


def relative_path(path: Path, folder: Path) -> str:
    """Return a path seen from a folder, with slashes; as it is where they share no root."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive
        return path.absolute().as_posix()


def _given(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table without what is not given."""
    return {key: _as_list(value) for key, value in table.items() if value is not None}


def _as_list(value: Any) -> Any:
    """Return nested tuples as lists."""
    return [_as_list(each) for each in value] if isinstance(value, tuple) else value
