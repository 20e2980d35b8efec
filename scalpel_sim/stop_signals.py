"""Ctrl-C and the system's requests to end: a run obeys them between two frames."""

import signal
import threading
import time
from types import FrameType, TracebackType
from typing import Any

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Ctrl-C; the system's request to end; the end of the terminal."""

SAME_WISH = 1.0
"""Time within which further signals mean the same wish [s]: a terminal and a launcher, such as
`uv run`, may both pass on one Ctrl-C, and people press it twice."""

_raised: str | None = None
"""What `raised_signal` returns."""


class SignalInterrupt(KeyboardInterrupt):
    """A signal came. Its message says which.

    No plain KeyboardInterrupt: where one passes through `exec`, as in the making of a dataclass,
    Python ends by SIGINT although it was caught.
    """


class StopSignals:
    """While entered, the first signal sets `reason`; one more, later on, is raised as an exception.

    So a run ends between two frames with its files whole, and one that hangs can still be ended.
    A signal that the process ignores stays ignored, as with `nohup`. Outside the main thread, where
    Python gets no signals, it does nothing.
    """

    def __init__(self) -> None:
        self.reason: str | None = _raised
        """Which signal came, or None."""
        self._noted_at = time.monotonic()
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> "StopSignals":
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before.clear()

    @property
    def seconds(self) -> float:
        """Time since the first signal [s]; 0 before it."""
        return 0.0 if self.reason is None else time.monotonic() - self._noted_at

    def _note(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if self.reason is None:
            self.reason, self._noted_at = interruption(number), now
        elif now - self._noted_at > SAME_WISH:
            raise SignalInterrupt(interruption(number))


def interrupt_on_signals() -> None:
    """Have every signal of `SIGNALS` raise `SignalInterrupt`, unless it is ignored.

    For the start of a program: where nobody waits for a signal, the work stops at once.
    """
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _raise)


def ignore_signals() -> None:
    """Ignore them from now on: all is done, and the process ends with its exit code."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def raised_signal() -> str | None:
    """Return which signal `interrupt_on_signals` has raised, or None.

    Python drops an exception that is raised in a callback, and extensions replace it by another.
    """
    return _raised


def interruption(number: int) -> str:
    """Return what a signal did, for a message."""
    return f"interrupted by {signal.Signals(number).name}"


def _raise(number: int, frame: FrameType | None) -> None:
    global _raised
    _raised = interruption(number)
    raise SignalInterrupt(_raised)
