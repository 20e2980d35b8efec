"""The scene that the command line asks for: a file, the environment, `--set`, and the options."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scalpel_sim.cli.material_file import read_blade, read_material, warn_of_unused_tables
from scalpel_sim.cli.options import (
    ArmOptions,
    BladeOptions,
    BodyOptions,
    MaterialOptions,
    SolverOptions,
    TissueOptions,
)
from scalpel_sim.cli.prony_series import series_of
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import expect_faces
from scalpel_sim.scene_file.build import scene_in
from scalpel_sim.scene_file.layers import merged, with_environment, with_settings
from scalpel_sim.scene_file.reading import SceneFile, read_scene_file, shipped_scene
from scalpel_sim.scene_parts.choices import can_audit
from scalpel_sim.scene_parts.scene import GEL, Scene
from scalpel_sim.scenes import DEFAULT_SCENE
from scalpel_sim.tables.material import given_in
from scalpel_sim.tables.stroke import stroke_called
from scalpel_sim.tables.toml import is_toml_file

OptionGroup = BodyOptions | MaterialOptions | SolverOptions | ArmOptions
"""Options that are keys of a scene, each by itself."""

_KEYS = {
    "fix": "body.fixed",
    "stretch": "body.stretch",
    "gravity": "world.gravity",
    "floor": "world.floor",
    "young": "material.young_modulus",
    "arm": "arm.preset",
    "seconds": "seconds",
}
"""Keys of a scene that options set whose names are others."""

_BLADE_KEYS = {
    "blade_thickness": "thickness",
    "blade_bevel": "bevel_degrees",
    "blade_height": "height",
    "blade_edge_radius": "edge_radius",
}
"""Keys of `[blade]` that options set, thickness first."""

_TABLE_OF = {MaterialOptions: "material", SolverOptions: "solver", ArmOptions: "arm"}
"""The table of the other options of a group, whose keys have their names."""

_NO_KEYS = ("mesh", "scale", "material", "calibrate", "spring_error", "stroke", "speed")
"""Options that are no single key of a scene."""


def chosen_scene(
    name: str | None,
    tissue: TissueOptions,
    arm: ArmOptions = ArmOptions(),
    *,
    relaxation: str | None = None,
    audits: bool = False,
) -> Scene:
    """Return the scene, or one around the user's mesh, with the changes that the user asks for.

    Args:
        name: A scene that comes with the project, or a FILE.toml; None for the default one.
        tissue: What the command line asks for of body, material, blade and solver.
        arm: What it asks for of the arm and the strokes.
        relaxation: How the motion is advanced where nothing is said of it, and the tissue does not
            stiffen; None: as the scene has it.
        audits: Whether an account of the energy is kept where nothing is said of it.

    Raises:
        MeshError: the mesh cannot be cut.
        UsageError: there is no such scene, a key or a value is wrong, or they make no sense
            together.
    """
    body, material, blade = tissue.body, tissue.material, tissue.blade
    file = _scene_or_mesh(name, body.mesh, body.scale)
    file = with_settings(with_environment(file, os.environ), tissue.settings)
    _warn_of_unused_tables(material, blade)
    file = _with_material(file, material.material)
    file = _with_blade(file, blade)
    file = _with_strokes(file, arm)
    for group in (body, material, tissue.solver, arm):
        file = _with_options(file, group)
    try:
        scene = scene_in(file)
    except UsageError as error:
        raise _with_path(error, name, material.material, blade.blade) from error
    expect_faces(scene.blade, vars(material))
    solver = file.content.get("solver", {})
    if relaxation is not None and "relaxation" not in solver and not scene.material.stiffens:
        scene = replace(scene, relaxation=relaxation)
    if audits and "audit" not in solver and can_audit(scene.relaxation):
        scene = replace(scene, audit=True)
    return scene


def scene_in_file(path: str) -> Scene:
    """Return the scene in a FILE.toml, as the environment has it.

    Raises:
        UsageError: the file cannot be read, or a key or a value is wrong.
    """
    file = with_environment(read_scene_file(Path(path)), os.environ)
    try:
        return scene_in(file)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error


def _scene_or_mesh(name: str | None, mesh: Path | None, scale: float | None) -> SceneFile:
    """Return the scene of that name, or one around a mesh."""
    if mesh is None:
        if scale is not None:
            raise UsageError("--scale is for a --mesh; the scenes come in metres")
        if name is not None and is_toml_file(name):
            return read_scene_file(Path(name))
        return shipped_scene(name or DEFAULT_SCENE)
    if name is not None:
        raise UsageError(f"both the scene '{name}' and --mesh {mesh} are given; choose one")
    if scale is not None and not (np.isfinite(scale) and scale > 0.0):
        raise UsageError(
            f"--scale is {scale}; it must be positive: the metres in one unit of {mesh}"
        )
    body = {"shape": "mesh", "file": str(mesh)} | ({} if scale is None else {"scale": scale})
    # The gel that a scene without a material has, for options to change.
    material = {key: getattr(GEL, key) for key in ("law", "young_modulus", "blade_friction")}
    content = {"about": f"the mesh {mesh.name}", "body": body, "material": material}
    return SceneFile(content, mesh.stem, Path())


def _warn_of_unused_tables(material: MaterialOptions, blade: BladeOptions) -> None:
    """Log a warning where a file has a table that no option asks for."""
    name = material.material
    is_file = name is not None and is_toml_file(name)
    # A material by name is a choice, which a `[material]` beside the blade does not question.
    if name is None or is_file:
        warn_of_unused_tables(Path(name) if name is not None else None, blade.blade)


def _with_material(file: SceneFile, material: str | None) -> SceneFile:
    """Return a scene with the material by name, or with what a file of one gives."""
    content = file.content
    if material is not None and is_toml_file(material):
        content = merged(content, {"material": read_material(Path(material))})
    elif material is not None:
        content = {**content, "material": {"preset": material}}
    return file._replace(content=content)


def _with_blade(file: SceneFile, options: BladeOptions) -> SceneFile:
    """Return a scene with the measures of the blade in a file, and those of the options.

    Measures of a blade with faces turn a line into a scalpel. A thickness of 0 makes a line, on
    which the other measures of the file do not act.
    """
    in_file = {} if options.blade is None else read_blade(options.blade)
    given = {key: getattr(options, option) for option, key in _BLADE_KEYS.items()}
    given = {key: value for key, value in given.items() if value is not None}
    if not (in_file or given):
        return file
    if given.get("thickness") == 0.0 and len(given) > 1:
        option = next(option for option, key in _BLADE_KEYS.items() if key in list(given)[1:])
        raise UsageError(
            f"--{option.replace('_', '-')} is about a blade with faces, and --blade-thickness 0 is "
            "a line; omit one of them"
        )
    measures = in_file | given
    if measures.get("thickness") == 0.0:
        measures = {"thickness": 0.0}
    usual = dict(file.content.get("blade", {}))
    if usual.get("thickness") == 0.0 or measures.get("thickness") == 0.0:
        usual = {}
    return file._replace(content={**file.content, "blade": usual | measures})


def _with_strokes(file: SceneFile, arm: ArmOptions) -> SceneFile:
    """Return a scene with the stroke that is asked for, and its speed."""
    rows = file.content.get("stroke", [{}])
    if arm.stroke is not None:
        row = given_in(stroke_called(arm.stroke))
        if "file" in row and file.folder != Path():
            row["file"] = str(Path(row["file"]).absolute())
        rows = [row]
    if arm.speed is not None:
        rows = [row if "file" in row else row | {"speed": arm.speed} for row in rows]
    return file if rows == [{}] else file._replace(content={**file.content, "stroke": rows})


def _with_options(file: SceneFile, group: OptionGroup) -> SceneFile:
    """Return a scene with the keys that a group of options gives.

    Raises:
        UsageError: a value is wrong; the message names the option.
    """
    for option, given in vars(group).items():
        if given is None or option in _NO_KEYS:
            continue
        value: Any = series_of(given) if option == "prony" else given
        key = _KEYS.get(option) or f"{_TABLE_OF[type(group)]}.{option}"
        changes: Any = value
        for part in reversed(key.split(".")):
            changes = {part: changes}
        changed = file._replace(content=merged(file.content, changes))
        try:
            changed.tables()
        except UsageError as error:
            remedy = str(error).partition("; ")[2]
            raise UsageError(f"--{option.replace('_', '-')} is {given}; {remedy}") from error
        file = changed
    return file


def _with_path(
    error: UsageError, scene: str | None, material: str | None, blade: Path | None
) -> UsageError:
    """Return an error that names the file from which the wrong table came, if one did."""
    text = str(error)
    if text.startswith("[material]") and material is not None and is_toml_file(material):
        return UsageError(f"{material}: {text}")
    if text.startswith("[blade]") and blade is not None:
        return UsageError(f"{blade}: {text}")
    if scene is not None and is_toml_file(scene):
        return UsageError(f"{scene}: {text}")
    return error
