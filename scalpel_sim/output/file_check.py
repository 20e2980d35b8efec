"""Whether a file that an option names can be written, before the work whose result it is for."""

from pathlib import Path

from scalpel_sim.errors import RunError, UsageError


def check_file(path: Path, suffix: str, option: str) -> None:
    """Make sure that a file can be written, before the work whose result it is for.

    Args:
        path: The file; one that is there will be overwritten.
        suffix: What its name must end in.
        option: The option that chose it, for the message.

    Raises:
        UsageError: another suffix, a folder, or a file in a folder that does not exist.
        RunError: the system refuses.
    """
    if path.suffix.lower() != suffix:
        raise UsageError(f"{option} is {path}; its name must end in {suffix}")
    if path.is_dir() or not path.parent.is_dir():
        reason = "it is a folder" if path.is_dir() else f"there is no folder {path.parent}"
        raise UsageError(f"{option} is {path}, and {reason}; choose another file")
    is_new = not path.exists()
    try:
        with path.open("ab"):
            pass
        if is_new:
            path.unlink()
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror or error}); choose another {option}"
        ) from error
