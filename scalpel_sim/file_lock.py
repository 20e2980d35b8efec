"""Locks against a second run that would write the same files."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from scalpel_sim.errors import RunError, writing


def take_lock(lock: Path, protected: Path, option: str) -> Callable[[], None]:
    """Take a lock, and return the function that releases it, which may be called twice.

    The system releases it when the process ends, also by `kill -9`: the empty file that is then
    left stops nobody.

    Args:
        lock: The file of the lock, which is there while it is taken.
        protected: The file or folder that it is for.
        option: The option that chose that, for the message.

    Raises:
        RunError: another run has it, or the system refuses.
    """
    from filelock import FileLock, Timeout  # loading it takes 30 ms

    taken = FileLock(lock)
    with writing(protected, f"another {option}"):
        lock.touch()  # or folders that are not there would be made
        try:
            taken.acquire(blocking=False)
        except Timeout:  # an OSError, too
            raise RunError(
                f"{protected}: another run is writing there; wait until it has ended, or choose "
                f"another {option}"
            ) from None

    def release() -> None:
        if taken.is_locked:
            # Before it is released: after that it may be another run's. Windows removes no open
            # file, and leaves an empty one.
            with suppress(OSError):
                lock.unlink()
            taken.release()

    return release
