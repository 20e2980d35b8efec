"""Reads a scene: its file, then what the environment, `--set` and options change in it.

Each layer replaces keys of the one before. What results is converted once, and checked once; an
error names the layer from which the wrong key came.
"""

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from msgspec import structs

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.scene import Scene
from scalpel_sim.tables.problems import (
    Problem,
    kinds_of,
    metas_of,
    problem_of,
    row_table_of,
    table_of,
)
from scalpel_sim.tables.text_files import read_toml

_HERE = Path(__file__).parent

SHIPPED_SCENES = (
    "organ",
    "incision",
    "retract",
    "excise",
    "taut_incision",
    "layers",
    "tumour",
    "gallbladder",
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

TASK_SCENES = (
    "biopsy-v0",
    "dissect-v0",
    "excise-v0",
    "expose-v0",
    "gallbladder-v0",
    "incise-v0",
    "incise_taut-v0",
    "ligament-v0",
    "retract-v0",
    "spare_vessel-v0",
)
"""Names of the tasks that come with it. One never changes what it means: changed, it has another
version."""

DEFAULT_SCENE = "organ"

ENVIRONMENT_PREFIX = "SCALPEL_SIM__"
"""Variables of the environment that begin like this are keys of the scene; between its parts a key
has two underscores: SCALPEL_SIM__MATERIAL__TOUGHNESS."""

_HOW_TO_BEGIN = "`scalpel-sim new FILE.toml` writes a scene to start from"

_SECTION = re.compile(r"\[+(\w+)\]")


class Given(NamedTuple):
    """Where the value of a key came from."""

    source: str
    """A variable, `--set KEY=VALUE`, or an option."""
    value: object = None
    """Value of an option, as the command line has it; None for the others."""


class SceneFile(NamedTuple):
    """A scene as a file describes it, and what later layers have changed."""

    content: dict[str, Any]
    """Its tables, as TOML has them."""
    name: str
    """Name of the scene where the content has none."""
    folder: Path
    """Folder of the files that it names by a relative path."""
    origin: str = ""
    """The file; empty for one that comes with the project."""
    given: Mapping[tuple[str, ...], Given] = {}
    """Keys that later layers have given."""
    origins: Mapping[str, str] = {}
    """Files of single tables."""


def read_scene(path: str | Path) -> Scene:
    """Return the scene in a TOML file, which docs/scenes.md describes.

    Raises:
        UsageError: the file cannot be read, or a table, key or value is wrong.
    """
    return scene_in(read_scene_file(Path(path)))


def read_scene_file(path: Path) -> SceneFile:
    """Return the content of a scene file.

    Raises:
        UsageError: the file cannot be read.
    """
    return SceneFile(read_toml(path, _HOW_TO_BEGIN), path.stem, path.parent, str(path))


def shipped_scene(name: str) -> SceneFile:
    """Return the content of the scene or the task of that name.

    Raises:
        UsageError: there is none; the message lists them.
    """
    known = (*SHIPPED_SCENES, *TASK_SCENES)
    if name not in known:
        raise unknown("scene", name, known)
    return read_scene_file(shipped_path(name))._replace(folder=Path(), origin="")


def shipped_path(name: str) -> Path:
    """Return the file of a scene or a task that comes with the project."""
    return _HERE / ("tasks" if name in TASK_SCENES else "shipped") / f"{name}.toml"


def with_environment(file: SceneFile, environment: Mapping[str, str]) -> SceneFile:
    """Return a scene with the keys that the environment gives.

    Args:
        file: The scene.
        environment: Variables and their values; those that are no keys of a scene are ignored.

    Raises:
        UsageError: there is no such row; the message names the variable.
    """
    for variable in sorted(environment):
        if variable.upper().startswith(ENVIRONMENT_PREFIX):
            key = variable[len(ENVIRONMENT_PREFIX) :].lower().split("__")
            file = with_key(file, key, _value(environment[variable]), Given(variable))
    return file


def with_settings(file: SceneFile, settings: Sequence[str]) -> SceneFile:
    """Return a scene with the keys that `--set` gives.

    Args:
        file: The scene.
        settings: Each "key.of.the.scene=value".

    Raises:
        UsageError: a setting has no value, or there is no such row; the message names the setting.
    """
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key.strip():
            raise UsageError(
                f"--set {setting} has no key and value; write --set material.toughness=50"
            )
        file = with_key(file, key.strip().split("."), _value(value), Given(f"--set {setting}"))
    return file


def with_key(file: SceneFile, key: Sequence[str], value: Any, given: Given) -> SceneFile:
    """Return a scene with one key replaced.

    Args:
        file: The scene.
        key: Parts of the key; a number counts rows from 0, as in stroke.0.speed.
        value: As a file has it.
        given: Where it comes from, for messages.

    Raises:
        UsageError: there is no such row, or a part of the key is a value.
    """
    try:
        content = _replaced(file.content, key, value)
    except UsageError as error:
        raise UsageError(f"{given.source}: {error}") from error
    return file._replace(content=content, given={**file.given, tuple(key): given})


def located(file: SceneFile) -> SceneFile:
    """Return a scene whose files are found from the current folder."""
    content = with_files(file.content, lambda name: str(file.folder / name))
    return file._replace(content=content, folder=Path())


def scene_in(file: SceneFile) -> Scene:
    """Return the scene that a file and later layers describe.

    Raises:
        UsageError: a table, key or value is wrong, or they make no sense together.
    """
    content = located(file).content
    try:
        scene = msgspec.convert(content, Scene)
    except msgspec.ValidationError as error:
        if isinstance(error.__cause__, UsageError):  # a check of the scene
            raise UsageError(_with_origin(str(error.__cause__), file)) from error
        problem = problem_of(content, Scene) or Problem(str(error), ())
        raise UsageError(_explained(problem, file)) from error
    name = content.get("name", file.name)
    return structs.replace(scene, name=name, about=scene.about or f"the scene {name}")


def with_files(
    content: Mapping[str, Any], change: Callable[[str], str], whole: type[msgspec.Struct] = Scene
) -> dict[str, Any]:
    """Return the content of a scene, or of another file, with each name of a file changed."""
    found: dict[str, Any] = _with_files(content, whole, change)
    return found


def _with_files(content: Any, table: type[msgspec.Struct], change: Callable[[str], str]) -> Any:
    """Return the content of a table with each name of a file changed; what is no table stays."""
    if not isinstance(content, Mapping):
        return content
    found = dict(content)
    for key, kind in kinds_of(table).items():
        value, inner, row = found.get(key), table_of(kind), row_table_of(kind)
        if row is not None and isinstance(value, list):
            found[key] = [_with_files(each, row, change) for each in value]
        elif inner is not None and value is not None:
            found[key] = _with_files(value, inner, change)
        elif isinstance(value, str) and any(meta.extra for meta in metas_of(kind)):
            found[key] = change(value)
    return found


def _explained(problem: Problem, file: SceneFile) -> str:
    """Return what is wrong, and from where it came."""
    for key, given in reversed(list(file.given.items())):
        n = min(len(key), len(problem.key))
        if n and key[:n] == problem.key[:n]:
            if given.value is None:
                return f"{given.source}: {problem.text}"
            return f"{given.source} is {given.value}; {problem.text.partition('; ')[2]}"
    return f"{file.origin}: {problem.text}" if file.origin else problem.text


def _with_origin(text: str, file: SceneFile) -> str:
    """Return what makes no sense, and the file in which that stands, if it is in one."""
    section = _SECTION.match(text)
    origin = file.origins.get(section[1] if section else "", file.origin)
    return f"{origin}: {text}" if origin else text


def merged(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a content with some of its keys replaced; tables are merged key by key.

    Where other nodes are held, the stretch between those of before is dropped.
    """
    found = dict(content)
    for key, value in changes.items():
        if isinstance(value, Mapping):
            within = found.get(key, {})
            found[key] = merged(within, value) if isinstance(within, Mapping) else value
        else:
            found[key] = value
    if "fixed" in changes and changes["fixed"] != content.get("fixed") and "stretch" not in changes:
        found.pop("stretch", None)
    return found


def _replaced(content: Any, key: Sequence[str], value: Any) -> Any:
    """Return a content with the value at a key replaced."""
    first, rest = key[0], key[1:]
    if isinstance(content, list):
        if not first.isdecimal():
            raise UsageError(
                f"the scene has {len(content)} of these, each with '{first}'; say which, 0 to "
                f"{len(content) - 1}, as in --set TABLE.0.{first}=VALUE"
            )
        if int(first) >= len(content):
            raise UsageError(
                f"'{first}' is no row; it must be a number from 0 to {len(content) - 1}"
            )
        rows = list(content)
        rows[int(first)] = _replaced(rows[int(first)], rest, value) if rest else value
        return rows
    if not rest:
        return merged(content, {first: value})
    within = content.get(first, {})
    if first == "stroke" and not within:
        within = [{}]  # the usual one
    if not isinstance(within, (Mapping, list)):
        raise UsageError(f"'{first}' is a value; it has no key '{rest[0]}'")
    return {**content, first: _replaced(within, rest, value)}


def _value(text: str) -> Any:
    """Return a value as a file has it, or the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text.strip()


SCENES: dict[str, Scene] = {name: scene_in(shipped_scene(name)) for name in SHIPPED_SCENES}
"""The scenes that come with the project, by name."""

PHANTOM = SCENES["slab"].material
"""A soft gel phantom of springs, as in the paper."""

PARENCHYMA = SCENES["organ"].material
"""Liver that does not stiffen, of a toughness well below the 164 J/m2 of liver with its vessels, so
that one stroke cuts through. `--material liver` is liver as published."""


def scene_called(name: str) -> Scene:
    """Return the scene or the task of that name.

    Raises:
        UsageError: there is none; the message lists them.
    """
    return SCENES[name] if name in SCENES else scene_in(shipped_scene(name))
