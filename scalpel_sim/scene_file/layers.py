"""What the environment and the command line change in a scene file.

A later layer overrides an earlier one: the file, the environment, `--set`, and the other options.
"""

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

from scalpel_sim.errors import UsageError
from scalpel_sim.scene_file.reading import SceneFile

ENVIRONMENT_PREFIX = "SCALPEL_SIM__"
"""Variables of the environment that begin like this are keys of the scene; between its parts a key
has two underscores: SCALPEL_SIM__MATERIAL__TOUGHNESS."""


def with_environment(file: SceneFile, environment: Mapping[str, str]) -> SceneFile:
    """Return a scene with the keys that the environment gives.

    Args:
        file: The scene.
        environment: Variables and their values; those that are no keys of a scene are ignored.

    Raises:
        UsageError: a key or a value is wrong; the message names the variable.
    """
    for variable in sorted(environment):
        if variable.upper().startswith(ENVIRONMENT_PREFIX):
            key = variable[len(ENVIRONMENT_PREFIX) :].lower().split("__")
            file = _with_key(file, key, environment[variable], variable)
    return file


def with_settings(file: SceneFile, settings: Sequence[str]) -> SceneFile:
    """Return a scene with the keys that `--set` gives.

    Args:
        file: The scene.
        settings: Each "key.of.the.scene=value".

    Raises:
        UsageError: a key or a value is wrong; the message names the setting.
    """
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key.strip():
            raise UsageError(
                f"--set {setting} has no key and value; write --set material.toughness=50"
            )
        file = _with_key(file, key.strip().split("."), value, f"--set {setting}")
    return file


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


def _with_key(file: SceneFile, key: Sequence[str], value: str, source: str) -> SceneFile:
    """Return a scene with one key replaced.

    Args:
        file: The scene.
        key: Parts of the key; a number counts rows from 0, as in stroke.0.speed.
        value: As a file has it; a text needs no quotes.
        source: Where it comes from, for messages.
    """
    try:
        content = _replaced(file.content, key, _value(value))
        changed = file._replace(content=content)
        changed.tables()
    except UsageError as error:
        raise UsageError(f"{source}: {error}") from error
    return changed


def _replaced(content: Any, key: Sequence[str], value: Any) -> Any:
    """Return a content with the value at a key replaced."""
    first, rest = key[0], key[1:]
    if isinstance(content, list):
        if not (first.isdecimal() and int(first) < len(content)):
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
