"""The scenes that come with the project, and scenes around other bodies."""

from dataclasses import replace
from pathlib import Path

from bridge import TissueLink, sent_scene_name
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene_file.build import scene_in
from scalpel_sim.scene_file.reading import SHIPPED_SCENES, read_scene_file, shipped_scene
from scalpel_sim.scene_parts.scene import Scene
from scalpel_sim.tables.view import received_views
from tissue import TetrahedralMesh

SCENES: dict[str, Scene] = {name: scene_in(shipped_scene(name)) for name in SHIPPED_SCENES}
"""The scenes that come with the project, by name."""

PHANTOM = SCENES["slab"].material
"""A soft gel phantom of springs, as in the paper."""

PARENCHYMA = SCENES["organ"].material
"""Liver that does not stiffen, of a toughness well below the 164 J/m2 of liver with its vessels, so
that one stroke cuts through. `--material liver` is liver as published."""

DEFAULT_SCENE = "organ"


def scene_called(name: str) -> Scene:
    """Return the scene of that name.

    Raises:
        UsageError: there is none; the message lists them.
    """
    if name not in SCENES:
        raise unknown("scene", name, SCENES)
    return SCENES[name]


def read_scene(path: str | Path) -> Scene:
    """Return the scene in a TOML file, which docs/scenes.md describes.

    Raises:
        UsageError: the file cannot be read, or a table, key or value is wrong.
    """
    file = read_scene_file(Path(path))
    try:
        return scene_in(file)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error


def scene_of(link: TissueLink, scene: Scene | None = None) -> Scene:
    """Return a scene around a body that already exists.

    Args:
        link: To the body.
        scene: What is done with it; None: what the scene of its name does, if that comes with the
            project, seen as the server says.

    Raises:
        LinkError: the body is in another process, and cannot be reached.
        UsageError: the body is that of another scene.
    """
    body = link.describe()
    if scene is not None:
        if body.scene not in (scene.name, sent_scene_name(scene.name)):
            raise UsageError(f"the body there is that of '{body.scene}', not of '{scene.name}'")
        return replace(scene, material=body.material)
    views = received_views(body.views)
    known = SCENES.get(body.scene)
    if known is not None:
        return replace(known, material=body.material, views=views)
    rest = link.snapshot()
    mesh = TetrahedralMesh(rest.rest_positions, rest.tetrahedra)
    about = f"the body '{body.scene}'"
    return Scene(body.scene, about, lambda: mesh, material=body.material, views=views)
