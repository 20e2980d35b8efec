"""Lock of a run's folder, and space on its disk that is kept for the last files."""

import os
from pathlib import Path

from scalpel_sim.errors import RunError

LOCK = ".lock"
"""Name of the file that is locked. It stays when the run has ended, and means nothing then."""


class FolderLock:
    """The right of one run to write into a folder. The system takes it back if the run is killed.

    Args:
        folder: The folder, which exists.

    Raises:
        RunError: another run has it.
        OSError: the folder cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        from filelock import FileLock, Timeout  # loading it takes 30 ms

        self._lock = FileLock(folder / LOCK)
        try:
            self._lock.acquire(blocking=False)
        except Timeout:
            raise RunError(
                f"{folder}: another run is writing there; wait until it has ended, or choose "
                "another --out"
            ) from None

    def release(self) -> None:
        """Release the folder for other runs. May be called twice."""
        self._lock.release()


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
