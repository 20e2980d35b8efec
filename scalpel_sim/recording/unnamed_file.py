"""A temporary file without a name: nothing is left of it, however the process ends."""

import os
import tempfile
from io import FileIO
from pathlib import Path


def unnamed_file(folder: Path | None = None) -> FileIO:
    """Return such a file, open to read and to write, without a buffer.

    Args:
        folder: On whose disk it is; None: where the system has temporary files.

    Raises:
        OSError: it cannot be made.
    """
    with tempfile.TemporaryFile(buffering=0, dir=folder) as file:
        return FileIO(os.dup(file.fileno()), "r+b")
