"""The lock of a run's folder: two runs that wrote into one would mix their files."""

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
        """Let another run have the folder. May be called twice."""
        self._lock.release()
