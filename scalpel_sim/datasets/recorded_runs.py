"""Runs in folders, of which demonstrations are made."""

import hashlib
import json
from pathlib import Path
from typing import Any, NamedTuple

from scalpel_sim.errors import UsageError
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.runs.file_names import FORCES, SCENE, SUMMARY
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.scene import Scene
from scalpel_sim.version import version

_PROGRAM = "scalpel_sim"
"""Name of this program among the versions of a summary."""


class RecordedRun(NamedTuple):
    """A run whose files are in a folder."""

    folder: Path
    """The folder."""
    scene: Scene
    """Scene that repeats it."""
    scene_text: str
    """The same, as its file has it."""

    def rows(self) -> Recording:
        """Return the rows of `forces.csv`.

        Raises:
            UsageError: the file is no such table.
            OSError: it cannot be read.
        """
        return read_forces(self.folder / FORCES)

    @property
    def is_led(self) -> bool:
        """Whether a hand led the blade."""
        return any(each.file is not None for each in self.scene.strokes)

    def sums(self) -> dict[str, str]:
        """Return the SHA-256 of the scene, and of each motion that it repeats, by file name.

        Raises:
            OSError: one cannot be read.
        """
        files = [self.folder / SCENE, *self.scene.recorded_files]
        return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def recorded_run(folder: Path) -> RecordedRun:
    """Return the run whose files are in a folder.

    Raises:
        UsageError: there is none, or another version of the program did it; the message says what
            to do.
        OSError: a file cannot be read.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder}: there is no such folder; give one that `run` or `view` wrote")
    if not (folder / FORCES).exists():
        raise UsageError(f"{folder}: it has no {FORCES}, and so no run; give one that `run` wrote")
    if not (folder / SCENE).exists():
        raise UsageError(
            f"{folder}: it has no {SCENE}, from which the run would be done again: its tissue was "
            "in another process (--connect), or the file was removed"
        )
    _expect_this_version(folder)
    text = (folder / SCENE).read_text(encoding="utf-8")
    return RecordedRun(folder, read_scene(folder / SCENE), text)


def _expect_this_version(folder: Path) -> None:
    """Refuse a run of another version, whose tissue would meet the hand otherwise.

    Raises:
        UsageError: it is one.
    """
    then = _versions_in(folder).get(_PROGRAM)
    if then is not None and then != version():
        raise UsageError(
            f"{folder}: version {then} of the program did this run, and this is {version()}; its "
            "tissue may meet the hand otherwise. Do the run again, which scores it, and give its "
            f"new folder: scalpel-sim run {folder / SCENE} --out NEW"
        )


def _versions_in(folder: Path) -> dict[str, Any]:
    """Return the versions of a summary; none where there is no summary, as of a killed run."""
    try:
        found = json.loads((folder / SUMMARY).read_text("utf-8"))["versions"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return found if isinstance(found, dict) else {}
