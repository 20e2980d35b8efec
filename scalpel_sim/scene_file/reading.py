"""Reads scene files: a user's, and those that come with the project."""

from pathlib import Path
from typing import Any, NamedTuple

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.tables.scene import SceneContent
from scalpel_sim.tables.stroke import check_kind
from scalpel_sim.tables.toml import as_tables, read_toml

_SHIPPED = Path(__file__).parent / "shipped"

SHIPPED_SCENES = (
    "organ",
    "incision",
    "retract",
    "excise",
    "taut_incision",
    "liver",
    "kidney",
    "skin",
    "fat",
    "muscle",
    "gelatin",
    "silicone",
    "slab",
    "grid2",
    "grid7",
)
"""Names of the scenes that come with the project."""

_HOW_TO_BEGIN = "`scalpel-sim new FILE.toml` writes a scene to start from"


class SceneFile(NamedTuple):
    """A scene as a file describes it."""

    content: dict[str, Any]
    """Its tables, as TOML has them."""
    name: str
    """Name of the scene where the content has none."""
    folder: Path
    """What its relative paths are relative to."""

    def tables(self) -> SceneContent:
        """Return the content as tables.

        Raises:
            UsageError: a table, key or value is wrong, or there is no such stroke.
        """
        tables = as_tables(self.content, SceneContent)
        for stroke in tables.stroke:
            check_kind(stroke)
        return tables


def read_scene_file(path: Path) -> SceneFile:
    """Return the scene in a file.

    Raises:
        UsageError: the file cannot be read, or a table, key or value is wrong.
    """
    found = SceneFile(read_toml(path, _HOW_TO_BEGIN), path.stem, path.parent)
    try:
        found.tables()
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
    return found


def shipped_scene(name: str) -> SceneFile:
    """Return the scene of that name.

    Raises:
        UsageError: there is none; the message lists them.
    """
    if name not in SHIPPED_SCENES:
        raise unknown("scene", name, SHIPPED_SCENES)
    return read_scene_file(shipped_path(name))._replace(folder=Path())


def shipped_path(name: str) -> Path:
    """Return the file of a scene that comes with the project."""
    return _SHIPPED / f"{name}.toml"
