"""Errors that a user can act on, and the exit code that each one means."""

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

EXIT_OK = 0
EXIT_RUN_FAILED = 1
EXIT_WRONG_USE = 2
EXIT_CHECK_FAILED = 3
EXIT_WARNED = 4


class UsageError(ValueError):
    """The request is impossible: an unknown name, a file that is no mesh. Exit code 2."""


class RunError(RuntimeError):
    """The request is possible, and failed: a port in use, a full disk. Exit code 1."""


class CheckError(RunError):
    """A validation ran to its end, and a check is out of its bounds. Exit code 3."""


class WarnedError(RunError):
    """A run that was to be without warnings ended with some. Exit code 4."""


class Interrupted(RunError):
    """The user, or the system, ended the run early. Exit code 1."""


EXPECTED = (ValueError, RuntimeError, OSError)
"""Errors that are raised on purpose. Any other is a fault of the program itself."""


def one_line(error: Exception) -> str:
    """Return the message of an error for the user, in one line."""
    text = " ".join(str(error).split()) or type(error).__name__
    if isinstance(error, EXPECTED):
        return text
    return f"{type(error).__name__}: {text}. This is a fault of the program; -v shows where"


@contextmanager
def writing(path: Path, instead: str) -> Iterator[None]:
    """Turn an error of the system into one line that names the path that cannot be written.

    Args:
        path: The file or folder.
        instead: What to choose where it cannot be written.

    Raises:
        RunError: the system refuses.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise RunError(f"{path}: cannot be written ({reason}); choose {instead}") from error


def exit_code(error: BaseException) -> int:
    """Return the exit code for an error that reached the command line.

    All parts of the project raise a `ValueError` for a wrong argument; every other error means that
    the run failed, a check of a validation did, or it ended with warnings.
    """
    if isinstance(error, WarnedError):
        return EXIT_WARNED
    if isinstance(error, CheckError):
        return EXIT_CHECK_FAILED
    return EXIT_WRONG_USE if isinstance(error, ValueError) else EXIT_RUN_FAILED


def unknown(kind: str, name: str, choices: Iterable[str]) -> UsageError:
    """Return the error for a name that is not among `choices`: it names the nearest, then all."""
    choices = list(choices)
    near = difflib.get_close_matches(name.lower(), choices, n=1, cutoff=0.5)
    hint = f"Did you mean '{near[0]}'? " if near else ""
    return UsageError(f"no {kind} is called '{name}'. {hint}Known: {', '.join(choices)}.")
