"""Disk space that is kept for the last files of a run, in case others fill the disk before."""

import os
from pathlib import Path

RESERVE = ".reserve"
"""Name of the file that takes the space."""


class DiskReserve:
    """Space on the disk of a folder, in a file, until it is given back.

    Args:
        folder: The folder.
        n_bytes: How much to keep [bytes].

    Raises:
        OSError: there is not as much.
    """

    def __init__(self, folder: Path, n_bytes: int) -> None:
        self._path = folder / RESERVE
        try:
            with self._path.open("wb") as file:
                _allocate(file.fileno(), n_bytes)
        except OSError:
            self.give_back()
            raise

    def give_back(self) -> None:
        """Free the space. May be called twice."""
        self._path.unlink(missing_ok=True)


def _allocate(file: int, n_bytes: int) -> None:
    """Give a new file blocks on the disk for so many bytes."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, n_bytes)
        return
    os.write(file, bytes(n_bytes))  # where the system has no other way
