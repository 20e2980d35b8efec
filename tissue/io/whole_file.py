"""Files that appear under their name only when they are whole."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

UNFINISHED = ".part"
"""Ending of a file that is still being written; a process that is killed leaves it."""


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a name near `path` to write a file at, which then replaces the one at `path`.

    Whoever opens `path` finds the old file or the new one, whatever ends the process, and after a
    loss of power too. An error leaves the old file, and nothing else.

    Raises:
        OSError: The file cannot be written.
    """
    target = Path(path)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}{UNFINISHED}")
    try:
        yield unfinished
        with unfinished.open("rb+") as file:
            os.fsync(file.fileno())
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def new_whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a name near `path` to write a file at, which then appears at `path`.

    From the first moment there is an empty file at `path`, so that no other process can take the
    name. An error leaves none.

    Raises:
        FileExistsError: There is a file at `path`; it stays as it is.
        OSError: The file cannot be written.
    """
    target = Path(path)
    os.close(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    try:
        with whole_file(target) as unfinished:
            yield unfinished
    except BaseException:
        target.unlink()
        raise


def remove_unfinished(path: str | os.PathLike[str]) -> None:
    """Remove what processes that were killed have left near `path`.

    Raises:
        OSError: It cannot be removed.
    """
    target = Path(path)
    start = f".{target.name}."
    for sibling in target.parent.iterdir():
        if sibling.name.startswith(start) and sibling.name.endswith(UNFINISHED):
            sibling.unlink(missing_ok=True)
