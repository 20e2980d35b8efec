"""Writes a file to start from, which is replaced only on request."""

from pathlib import Path

from scalpel_sim.errors import RunError, UsageError
from tissue import new_whole_file, whole_file


def write_new_file(path: Path, text: str, *, force: bool, instead: str) -> None:
    """Write a text to a file that does not exist yet; an error leaves what was there.

    Args:
        path: The file.
        text: What it is to hold.
        force: Whether a file that exists is replaced.
        instead: What to choose where the file cannot be written, for the message.

    Raises:
        UsageError: the file exists, and `force` is not given.
        RunError: the system refuses.
    """
    placed = whole_file if force else new_whole_file
    try:
        with placed(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8")
    except FileExistsError as error:
        raise UsageError(
            f"{path} exists already; choose another file, or add --force to replace it"
        ) from error
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose {instead}"
        ) from error
