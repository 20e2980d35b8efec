"""A process with limits of time and memory for code that may crash, hang or fill the memory."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from scalpel_sim.errors import RunError, UsageError

_POLL = 0.1
"""Interval at which the process is looked at [s]."""

_TAIL = 4096
"""Bytes at the end of the log in which progress is looked for."""

_BYTES_PER_GB = 1e9

PROCESS_LOG = "log.txt"
REFUSAL = "refusal.txt"
"""File with the sentence for which the input was refused."""


class ProcessLimits(NamedTuple):
    """Bounds of what a process may use."""

    time: float = 300.0
    """[s]"""
    memory: float = 4.0
    """[GB]; kept on Linux alone."""


OnProcess = Callable[[str, float], None]
"""Called from time to time with the end of the log, and the time that has passed [s]."""


@contextlib.contextmanager
def limited_process(
    module: str, arguments: Sequence[str], what: str, limits: ProcessLimits, on_progress: OnProcess
) -> Iterator[Path]:
    """Run a module with a folder as its first argument, and yield that folder with its results.

    Args:
        module: The module, which calls `limit_memory` and `refusing` itself.
        arguments: Its other arguments.
        what: What it does, for messages: "filling liver.stl".
        limits: At which it is ended.
        on_progress: Called while it runs.

    Raises:
        UsageError: the module refused its input.
        RunError: the process crashed, or met a limit. Its log stays, and the message names it.
    """
    folder = Path(tempfile.mkdtemp(prefix="scalpel-sim-mesh-"))
    is_kept = False
    try:
        code = _run([module, str(folder), *arguments], folder, what, limits, on_progress)
        refusal = folder / REFUSAL
        if refusal.exists():
            raise UsageError(refusal.read_text(encoding="utf-8"))
        if code:
            is_kept = True
            raise RunError(
                f"{what} failed: {_reason(code, folder, limits)}; see {folder / PROCESS_LOG}"
            )
        yield folder
    except _TimeIsUp as error:
        is_kept = True
        raise RunError(f"{error}; see {folder / PROCESS_LOG}") from None
    finally:
        if not is_kept:
            for file in folder.iterdir():
                file.unlink()
            folder.rmdir()


class _TimeIsUp(Exception):
    """The limit of time is reached."""


def _run(
    command: Sequence[str], folder: Path, what: str, limits: ProcessLimits, on_progress: OnProcess
) -> int:
    """Run `python -m` of a command, and return its exit code."""
    began = time.monotonic()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with (folder / PROCESS_LOG).open("wb") as log:
        # A session of its own: Ctrl-C reaches this process, which then ends that one.
        process = subprocess.Popen(
            [sys.executable, "-m", *command],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
            env=environment,
            cwd=folder,  # fTetWild writes files of its own
        )
    try:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                return process.wait(_POLL)
            passed = time.monotonic() - began
            if passed > limits.time:
                raise _TimeIsUp(
                    f"{what} took more than {limits.time:g} s. A larger --tolerance is faster, "
                    "and so are fewer triangles; --time-limit allows more"
                )
            on_progress(_tail(folder / PROCESS_LOG), passed)
    finally:
        process.kill()
        process.wait()


def _tail(log: Path) -> str:
    """Return the end of a log."""
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - _TAIL))
        return file.read().decode("utf-8", errors="replace")


def _reason(code: int, folder: Path, limits: ProcessLimits) -> str:
    """Return why a process ended with a code."""
    text = _tail(folder / PROCESS_LOG)
    if "MemoryError" in text or "bad_alloc" in text:
        return f"it needs more than {limits.memory:g} GB; --memory-limit allows more"
    if code < 0:
        return f"the mesher crashed ({signal.Signals(-code).name})"
    last = text.strip().rpartition("\n")[2]
    return last or f"exit code {code}"


def limit_memory(gigabytes: float) -> None:
    """Limit the memory of this process, where the system can: on Linux."""
    if sys.platform == "linux":
        import resource

        n_bytes = int(gigabytes * _BYTES_PER_GB)
        resource.setrlimit(resource.RLIMIT_AS, (n_bytes, n_bytes))


@contextlib.contextmanager
def refusing(folder: Path) -> Iterator[None]:
    """Write the sentence for which an input is refused to the folder, for `limited_process`."""
    try:
        yield
    except UsageError as error:
        (folder / REFUSAL).write_text(str(error), encoding="utf-8")
