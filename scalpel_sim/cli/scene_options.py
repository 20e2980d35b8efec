"""The scene that the command line requests: a file, the environment, `--set`, and the options."""

import logging
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scalpel_sim.cli.options import (
    KEY_OF,
    ArmOptions,
    BladeOptions,
    TissueOptions,
)
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import expect_faces
from scalpel_sim.scene.checks import moves_together
from scalpel_sim.scene.materials import given_in
from scalpel_sim.scene.read import (
    DEFAULT_SCENE,
    Given,
    SceneFile,
    located,
    merged,
    read_scene_file,
    scene_in,
    shipped_scene,
    with_environment,
    with_key,
    with_settings,
)
from scalpel_sim.scene.scene import GEL, Scene, changed
from scalpel_sim.scene.schema import BladeTable, MaterialTable
from scalpel_sim.strokes.kind import stroke_called
from scalpel_sim.tables.text_files import as_tables, is_toml_file, read_toml
from scalpel_sim.tables.values import TomlTable

_log = logging.getLogger("scalpel_sim")

_HOW_TO_WRITE_ONE = "`scalpel-sim materials --write FILE.toml` writes a file to start from"


class _MaterialFile(TomlTable, kw_only=True, frozen=True):
    """A file of figures of a material and a blade."""

    material: MaterialTable | None = None
    blade: BladeTable | None = None


def chosen_scene(
    name: str | None,
    tissue: TissueOptions,
    arm: ArmOptions = ArmOptions(),
    *,
    relaxation: str | None = None,
    audits: bool = False,
) -> Scene:
    """Return the scene, or one around the user's mesh, with the changes that the user requests.

    Args:
        name: A scene or task that comes with the project, or a FILE.toml; None for the default one.
        tissue: Options of body, material, blade and solver.
        arm: Options of the arm and the strokes.
        relaxation: How the motion is advanced where no layer gives it, and the tissue does not
            stiffen; None: as the scene has it.
        audits: Whether an account of the energy is kept where no layer gives it.

    Raises:
        MeshError: the mesh cannot be cut.
        UsageError: there is no such scene, a key or a value is wrong, or they make no sense
            together.
    """
    file = _scene_or_mesh(name, tissue.body.mesh, tissue.body.scale)
    file = with_settings(with_environment(file, os.environ), tissue.settings)
    file = _with_figures(located(file), tissue.material.material, tissue.blade)
    file = _with_labels(file, tissue.material.label)
    file = _with_strokes(file, arm)
    given = _given_keys(tissue, arm)
    for option, value in given.items():
        source = Given(f"--{option.replace('_', '-')}", value)
        file = with_key(file, KEY_OF[option].split("."), _parsed(option, value), source)
    scene = scene_in(file)
    expect_faces(scene.blade, given)
    solver, how = file.content.get("solver", {}), dict[str, Any]()
    if relaxation is not None and "relaxation" not in solver and not scene.material.stiffens:
        how["relaxation"] = relaxation
    if audits and "audit" not in solver:
        how["audit"] = moves_together(how.get("relaxation", scene.solver.relaxation))
    return changed(scene, **how)


def scene_in_file(path: str) -> Scene:
    """Return the scene in a FILE.toml, as the environment has it.

    Raises:
        UsageError: the file cannot be read, or a key or a value is wrong.
    """
    return scene_in(with_environment(read_scene_file(Path(path)), os.environ))


def led_elsewhere(scene: Scene, arm: ArmOptions) -> Scene:
    """Return a scene whose tissue is in another process, with the options of the arm.

    Raises:
        UsageError: a value is wrong.
    """
    given = {name: value for name, value in vars(arm).items() if value is not None}
    return changed(
        scene, **{KEY_OF.get(name, name).split(".")[-1]: value for name, value in given.items()}
    )


def read_figures(path: Path, table: str, unused: str | None = None) -> dict[str, Any]:
    """Return the figures of a material or a blade that a file gives.

    Args:
        path: The file.
        table: `material` or `blade`.
        unused: The other table, if no option requests it: a file that has it gets a warning.

    Raises:
        UsageError: the file cannot be read, has no such table, or a key or value is wrong.
    """
    content = read_toml(path, _HOW_TO_WRITE_ONE)
    try:
        figures = as_tables(content, _MaterialFile)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
    found = getattr(figures, table)
    if found is None:
        raise UsageError(f"{path} has no table [{table}]; {_HOW_TO_WRITE_ONE}")
    if unused is not None and getattr(figures, unused) is not None:
        _log.warning("%s: its [%s] is not used; add --%s %s", path, unused, unused, path)
    return given_in(found)


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
    material = {key: GEL.as_keys()[key] for key in ("law", "young_modulus", "blade_friction")}
    content = {"about": f"the mesh {mesh.name}", "body": body, "material": material}
    return SceneFile(content, mesh.stem, Path())


def _with_figures(file: SceneFile, material: str | None, blade: BladeOptions) -> SceneFile:
    """Return a scene with a material by name, or figures of files, and the measures of a blade."""
    content, origins = dict(file.content), dict[str, str]()
    if material is not None and is_toml_file(material):
        unused = "blade" if blade.blade is None else None
        figures = read_figures(Path(material), "material", unused)
        content = merged(content, {"material": figures})
        origins["material"] = material
    elif material is not None:
        content["material"] = {"preset": material}
    in_file: dict[str, Any] = {}
    if blade.blade is not None:
        # A material by name is a choice, which a `[material]` near the blade does not question.
        in_file = read_figures(blade.blade, "blade", "material" if material is None else None)
        origins["blade"] = str(blade.blade)
    given = _given_measures(blade)
    if in_file or given:
        content["blade"] = _measures(content.get("blade", {}), in_file | given)
    return file._replace(content=content, origins=origins)


def _with_labels(file: SceneFile, given: Sequence[str]) -> SceneFile:
    """Return a scene with the materials that options give to labels.

    Raises:
        UsageError: an option is no `LABEL=MATERIAL`.
    """
    rows: list[dict[str, Any]] = [dict(row) for row in file.content.get("label", ())]
    for text in given:
        label, equals, material = text.partition("=")
        if not (label and equals and material):
            raise UsageError(
                f"--label {text} has no label and no material; write --label 2=fat, or a name that "
                "the label has: --label vessel=mine.toml"
            )
        if is_toml_file(material):
            table = read_figures(Path(material), "material", "blade")
        else:
            table = {"preset": material}
        key: dict[str, Any] = {"label": int(label)} if label.isdecimal() else {"name": label}
        known = next((row for row in rows if key.items() <= row.items()), None)
        if known is None:
            # A part without a name of its own is called by its material.
            known = {"name": Path(material).stem} | key
            rows.append(known)
        known["material"] = table
    return file._replace(content={**file.content, "label": rows}) if given else file


def _given_measures(blade: BladeOptions) -> dict[str, Any]:
    """Return the keys of `[blade]` that options give.

    Raises:
        UsageError: a line is chosen, and a measure of a body with it.
    """
    options = {name: value for name, value in vars(blade).items() if value is not None}
    options.pop("blade", None)
    if options.get("blade_thickness") == 0.0 and len(options) > 1:
        other = next(name for name in options if name != "blade_thickness")
        raise UsageError(
            f"--{other.replace('_', '-')} is about a blade with faces, and --blade-thickness 0 is "
            "a line; omit one of them"
        )
    return {KEY_OF[name].partition(".")[2]: value for name, value in options.items()}


def _measures(usual: Any, given: dict[str, Any]) -> dict[str, Any]:
    """Return the table `[blade]` of a scene with some measures replaced.

    Measures of a blade with faces turn a line into a scalpel. A thickness of 0 makes a line, on
    which the other measures of a file do not act.
    """
    if given.get("thickness") == 0.0:
        return {"thickness": 0.0}
    is_line = not isinstance(usual, dict) or usual.get("thickness") == 0.0
    return given if is_line else usual | given


def _with_strokes(file: SceneFile, arm: ArmOptions) -> SceneFile:
    """Return a scene with the stroke that options give, and its speed."""
    if arm.stroke is None and arm.speed is None:
        return file
    rows = file.content.get("stroke", [{}])
    if arm.stroke is not None:
        rows = [given_in(stroke_called(arm.stroke))]
    file = file._replace(content={**file.content, "stroke": rows})
    if arm.speed is not None:
        given = Given("--speed", arm.speed)
        for i, row in enumerate(rows):
            if "file" not in row:
                file = with_key(file, ["stroke", str(i), "speed"], arm.speed, given)
    return file


def _given_keys(tissue: TissueOptions, arm: ArmOptions) -> dict[str, Any]:
    """Return the options that are keys of a scene, and their values."""
    groups = (tissue.body, tissue.material, tissue.blade, tissue.solver, arm)
    return {
        name: value
        for group in groups
        for name, value in vars(group).items()
        if name in KEY_OF and value is not None
    }


def _parsed(option: str, value: Any) -> Any:
    """Return the value of an option as a file has it.

    Raises:
        UsageError: the text is no number or vector, or no Prony series, `0.3:0.1,0.2:5`.
    """
    if option == "gravity":
        return _number_or_vector(option, str(value))
    if option != "prony":
        return value
    pairs = []
    for term in value.split(","):
        share, _, time = term.partition(":")
        try:
            pairs.append([float(share), float(time)])
        except ValueError:
            raise UsageError(
                f"--prony has the term '{term}'; write g:tau for each, separated by commas, such "
                "as 0.3:0.1,0.2:5"
            ) from None
    return pairs


def _number_or_vector(option: str, text: str) -> float | list[float]:
    """Return a number, or the three numbers of X,Y,Z.

    Raises:
        UsageError: a part of the text is no number.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise UsageError(
            f"--{option} is '{text}'; write a number, or three separated by commas, such as "
            "0,0,-9.81"
        ) from None
    return numbers if len(numbers) > 1 else numbers[0]
