"""A folder that appears under its name only when it is whole."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scalpel_sim.errors import UsageError, writing

_INSTEAD = "another --output"

_UNFINISHED = ".part"
"""Ending of a folder that is still being written; a process that is killed leaves it."""


def expect_new_folder(folder: Path) -> None:
    """Make sure that a folder can be made, before the work whose result it is for.

    Raises:
        UsageError: there is something already, or no folder that it is in.
        RunError: the system refuses.
    """
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise UsageError(
            f"{folder}: is there already, and a dataset is written to a new folder; remove it, or "
            f"choose {_INSTEAD}"
        )
    if not folder.absolute().parent.is_dir():
        raise UsageError(
            f"{folder}: there is no folder {folder.parent} to write it in; choose {_INSTEAD}"
        )
    with writing(folder, _INSTEAD):
        unfinished = _unfinished(folder)
        unfinished.mkdir()
        unfinished.rmdir()


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Yield a folder near `folder` to write to, which then appears as `folder`.

    An error leaves nothing. There is no folder of that name, or an empty one.

    Raises:
        OSError: it cannot be written.
    """
    target, unfinished = folder.absolute(), _unfinished(folder)
    unfinished.mkdir()
    try:
        yield unfinished
        for path in unfinished.rglob("*"):
            if path.is_file():
                with path.open("rb+") as file:
                    os.fsync(file.fileno())
        if target.is_dir():
            target.rmdir()
        unfinished.rename(target)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _unfinished(folder: Path) -> Path:
    """Return the name of a folder until it is whole."""
    target = folder.absolute()
    return target.with_name(f".{target.name}.{os.getpid()}{_UNFINISHED}")
