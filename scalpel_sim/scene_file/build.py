"""From the tables of a scene file to a scene."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import SCALPEL, chosen_blade
from scalpel_sim.scene_file.reading import SceneFile
from scalpel_sim.scene_parts.own_arm_settings import OwnArm
from scalpel_sim.scene_parts.scene import DEFAULT_CUT_SETTINGS, GEL, Scene
from scalpel_sim.tables.body import KEYS_OF_SHAPE, BodySource
from scalpel_sim.tables.grasper import GrasperTable
from scalpel_sim.tables.kinds import check_keys
from scalpel_sim.tables.material import BladeTable, given_in, material_of
from scalpel_sim.tables.problems import naming_table
from scalpel_sim.tables.scene import SceneContent, SolverTable
from scalpel_sim.tables.stroke import StrokeTable
from tissue import BladeShape, CutSettings

USUAL_FIXED, USUAL_STRETCH = "left,right", 0.05
"""Sides that are held where a scene says nothing else, and how far they are pulled apart."""

_OF_CUT = {"snap": "snap", "snap_floor": "floor", "guard": "guard", "crumb": "crumb"}
"""Keys of `[solver]` that are fields of `tissue.CutSettings`, and their names there."""


_OF_OWN_ARM = ("model", "heel", "tip", "forward", "force", "torque")
"""Keys of `[arm]` that describe an arm of the user's own."""

_OF_PLACE = ("pos", "quat")
"""Keys of `[world]` that say where the tissue lies in its world."""


def scene_in(file: SceneFile) -> Scene:
    """Return the scene that a file describes.

    Raises:
        UsageError: a table, key or value is wrong, or they make no sense together.
    """
    tables = file.tables()
    body = tables.body
    check_keys(body, "[body]", "shape", KEYS_OF_SHAPE)
    stretch = body.stretch
    if stretch is None:
        stretch = USUAL_STRETCH if body.fixed == USUAL_FIXED else 0.0
    name = tables.name or file.name
    solver, world = given_in(tables.solver), given_in(tables.world)
    material = tables.material
    given = {
        "seconds": tables.seconds,
        **{key: value for key, value in world.items() if key not in _OF_PLACE},
        **{key: value for key, value in solver.items() if key not in _OF_CUT},
        **_of_arm(tables, file.folder),
    }
    return Scene(
        name,
        tables.about or f"the scene {name}",
        BodySource(body, file.folder),
        material=GEL
        if material is None
        else naming_table("[material]", lambda: material_of(material)),
        fixed=body.fixed,
        stretch=stretch,
        cut=naming_table("[solver]", lambda: _cut(tables.solver)),
        blade=naming_table("[blade]", lambda: _blade(tables.blade)),
        attachments=tuple(tables.attachment),
        strokes=tuple(_located(stroke, file.folder) for stroke in tables.stroke),
        graspers=tuple(_with_files(grasper, file.folder) for grasper in tables.grasper),
        views=tuple(tables.view),
        **{key: value for key, value in given.items() if value is not None},
    )


def _of_arm(tables: SceneContent, folder: Path) -> dict[str, Any]:
    """Return the fields of a scene that `[arm]` gives, and those of `[world]` that place it."""
    given, world = given_in(tables.arm), given_in(tables.world)
    own = {key: given.pop(key) for key in _OF_OWN_ARM if key in given}
    own |= {key: world[key] for key in _OF_PLACE if key in world}
    if "model" in own:
        if "preset" in given:
            raise UsageError("[arm] has a preset and a model; choose one")
        own["model"] = str(folder / own["model"])
        given["own_arm"] = OwnArm(**own)
    elif own:
        key = next(iter(own))
        table = "world" if key in _OF_PLACE else "arm"
        raise UsageError(f"[{table}] {key} is for an arm of your own; add [arm] model, or omit it")
    if "preset" in given:
        given["arm"] = given.pop("preset")
    return given


def _cut(solver: SolverTable) -> CutSettings:
    """Return how closely cuts follow the blade. A `snap` alone is its own floor."""
    given = {
        own: value for key, own in _OF_CUT.items() if (value := getattr(solver, key)) is not None
    }
    if "snap" in given:
        given.setdefault("floor", given["snap"])
    return replace(DEFAULT_CUT_SETTINGS, **given)


def _blade(table: BladeTable) -> BladeShape | None:
    """Return the blade: a scalpel with some measures replaced, or None for a line."""
    given = given_in(table)
    if "bevel_degrees" in given:
        given["bevel"] = given.pop("bevel_degrees")
    if given.get("thickness") == 0.0 and len(given) > 1:
        raise UsageError("it has thickness 0, a line, on which its other measures do not act")
    return chosen_blade(SCALPEL, **given)


def _located(stroke: StrokeTable, folder: Path) -> StrokeTable:
    """Return a stroke whose file is found from anywhere."""
    if stroke.file is None:
        return stroke
    return msgspec.structs.replace(stroke, file=str(folder / stroke.file))


def _with_files(grasper: GrasperTable, folder: Path) -> GrasperTable:
    """Return a grasper whose files are found from anywhere."""
    given = {"model": grasper.model, "recorded": grasper.recorded}
    found = {key: str(folder / file) for key, file in given.items() if file is not None}
    return msgspec.structs.replace(grasper, **found)
