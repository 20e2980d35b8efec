"""Reads a text file whose name may come from somebody else's file."""

import stat
from pathlib import Path

from scalpel_sim.errors import UsageError


def read_text_file(path: Path, most_bytes: int) -> str:
    """Return the text of a regular file, without a byte order mark.

    Args:
        path: The file.
        most_bytes: Size of the largest that is read [byte].

    Raises:
        UsageError: it cannot be read, or is too large; the message has the reason alone.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise UsageError("it is a folder, a device or a pipe; give a file")
        if status.st_size > most_bytes:
            raise UsageError(f"it has {status.st_size} bytes; give one of at most {most_bytes}")
        with path.open(encoding="utf-8-sig") as file:
            return file.read(status.st_size)  # a file of /proc may never end
    except OSError as error:
        raise UsageError(error.strerror or str(error)) from error
    except UnicodeDecodeError as error:
        raise UsageError("it is not a text file") from error
