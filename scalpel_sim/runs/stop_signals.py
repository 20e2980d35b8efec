"""Ctrl-C and the system's requests to end: a run obeys them between two frames."""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Iterator
from types import FrameType
from typing import Any

from scalpel_sim.errors import EXIT_RUN_FAILED

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Ctrl-C; the system's request to end; the end of the terminal."""

SAME_WISH = 1.0
"""Time within which further signals mean the same wish [s]: a terminal and a launcher, such as
`uv run`, may both pass on one Ctrl-C, and people press it twice."""

_STDERR = 2
"""File descriptor of the standard error."""

_SHOW_CURSOR = "\r\x1b[K\x1b[?25h"
"""Clears the line of a progress bar on a terminal, and shows the cursor that it hides."""


class SignalInterrupt(KeyboardInterrupt):
    """A signal came. Its message says which.

    No plain KeyboardInterrupt: where one passes through `exec`, as in the making of a dataclass,
    Python ends by SIGINT although it was caught.
    """


_raised: SignalInterrupt | None = None
"""The one that was raised last. It keeps alive all that was interrupted: llvmlite frees twice what
it is freeing when an exception comes, if that is taken down."""

_is_loading = True
"""Whether the program loads libraries or kernels, as it does first."""


class StopSignals:
    """While entered, the first signal sets `reason`; one more, later on, is raised as an exception.

    So a run ends between two frames with its files whole, and one that hangs can still be ended.
    While `is_writing`, none is raised: what is being written would be lost.
    A signal that the process ignores stays ignored, as with `nohup`. Outside the main thread, where
    Python gets no signals, it does nothing.
    """

    def __init__(self) -> None:
        self.reason: str | None = raised_signal()
        """Which signal came, or None."""
        self.is_writing = False
        """Whether the last files are being written."""
        self._noted_at = self._last_at = time.monotonic()
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> "StopSignals":
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before.clear()

    @property
    def seconds(self) -> float:
        """Time since the first signal [s]; 0 before it."""
        return 0.0 if self.reason is None else time.monotonic() - self._noted_at

    def _note(self, number: int, frame: FrameType | None) -> None:
        before, self._last_at = self._last_at, time.monotonic()
        if self.reason is None:
            self.reason, self._noted_at = interruption(number), self._last_at
        elif self._last_at - before > SAME_WISH:
            if not self.is_writing:
                raise SignalInterrupt(interruption(number))
            _tell(f"the last files are being written; kill -9 {os.getpid()} ends it without them")


def interrupt_on_signals() -> None:
    """Stop the work at once on every signal of `SIGNALS`, unless it is ignored.

    For a program where nobody waits for a signal. While it loads (`loading`), the process ends with
    one line; afterwards `SignalInterrupt` is raised. An exception that passes through a library
    that is half loaded has crashed the process, and Python drops one that comes in a callback and
    prints its traceback. Nothing is lost: what has been written until then was written aside.
    """
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


@contextlib.contextmanager
def loading() -> Iterator[None]:
    """Load libraries or kernels. The program has loaded when this is left for the first time."""
    global _is_loading
    _is_loading = True
    try:
        yield
    finally:
        _is_loading = False


def ignore_signals() -> None:
    """Ignore them from now on: all is done, and the process ends with its exit code."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def raised_signal() -> str | None:
    """Return which signal `interrupt_on_signals` has raised, or None.

    Python drops an exception that is raised in a callback, and extensions replace it by another.
    """
    return None if _raised is None else str(_raised)


def interruption(number: int) -> str:
    """Return what a signal did, for a message."""
    return f"interrupted by {signal.Signals(number).name}"


def _stop(number: int, frame: FrameType | None) -> None:
    global _raised
    if _is_loading:
        _end(number)
    _raised = SignalInterrupt(interruption(number))
    raise _raised


def _end(number: int) -> None:
    _tell(f"error: {interruption(number)}")
    os._exit(EXIT_RUN_FAILED)


def _tell(text: str) -> None:
    """Write a line for the user; not by `sys.stderr`, in the midst of whose writing it may be."""
    with contextlib.suppress(OSError):  # nobody reads it any more
        shown = _SHOW_CURSOR if os.isatty(_STDERR) else ""
        os.write(_STDERR, f"{shown}{text}\n".encode())
