"""Writes a file to start from, which is replaced only on request."""

from pathlib import Path

from scalpel_sim.errors import RunError, UsageError


def write_new_file(path: Path, text: str, *, force: bool, instead: str) -> None:
    """Write a text to a file that does not exist yet.

    Args:
        path: The file.
        text: What it is to hold.
        force: Whether a file that exists is replaced.
        instead: What to choose where the file cannot be written, for the message.

    Raises:
        UsageError: the file exists, and `force` is not given.
        RunError: the system refuses.
    """
    try:
        with path.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError as error:
        raise UsageError(
            f"{path} exists already; choose another file, or add --force to replace it"
        ) from error
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose {instead}"
        ) from error
