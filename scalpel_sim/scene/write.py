"""From a scene to a file that gives the same run."""

import os
from pathlib import Path
from typing import Any

import msgspec
import tomlkit

from scalpel_sim.scene.blade import table_of_blade
from scalpel_sim.scene.body import GivenBody, HeldBodyTable
from scalpel_sim.scene.checks import OF_OWN_ARM, OF_PLACE
from scalpel_sim.scene.read import with_files
from scalpel_sim.scene.scene import Scene

_HEAD = """\
# The scene of a run, with every number as it was. `scalpel-sim run` and this file do it again.
"""


def scene_text(scene: Scene, path: Path) -> str | None:
    """Return the text of a scene file; None where the scene's body is in no table.

    Args:
        scene: The scene.
        path: Where the file will be: files that the scene names are relative to it.
    """
    if isinstance(scene.body, GivenBody):
        return None
    return f"{_HEAD}\n{tomlkit.dumps(content_of(scene, path.parent))}"


def content_of(scene: Scene, folder: Path) -> dict[str, Any]:
    """Return the tables of a scene, with every number that decides what it does.

    Args:
        scene: A scene whose body is in a table.
        folder: Folder that its relative paths are relative to.
    """
    content = msgspec.to_builtins(scene)
    if isinstance(scene.body, HeldBodyTable):
        content["body"]["stretch"] = scene.stretched_by
    for row, body in zip(content["body"] if scene.bodies else (), scene.bodies, strict=True):
        row["material"] = msgspec.to_builtins(scene.material_of_body(body).as_keys())
    content["material"] = msgspec.to_builtins(scene.material.as_keys())
    content["blade"] = {"thickness": 0.0}
    if scene.blade is not None:
        content["blade"] = msgspec.to_builtins(table_of_blade(scene.blade))
    content["solver"]["snap_floor"] = scene.cut.floor
    if scene.arm.model is None:
        content["arm"] = _without(content["arm"], OF_OWN_ARM)
        content["world"] = _without(content["world"], OF_PLACE)
    else:
        del content["arm"]["preset"]
    return with_files(_given(content), lambda name: relative_path(Path(name), folder))


def relative_path(path: Path, folder: Path) -> str:
    """Return a path seen from a folder, with slashes; as it is where they share no root."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive
        return path.absolute().as_posix()


def _without(table: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    """Return a table without some keys."""
    return {key: value for key, value in table.items() if key not in keys}


def _given(content: Any) -> Any:
    """Return a content without what is not given: None, and arrays of tables without a row."""
    if isinstance(content, dict):
        return {
            key: _given(value)
            for key, value in content.items()
            if value is not None and (key == "prony" or value not in ([], ()))
        }
    return [_given(each) for each in content] if isinstance(content, (list, tuple)) else content
