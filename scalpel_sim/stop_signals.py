"""Ctrl-C and the system's request to end, which a run obeys between two frames."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """While entered, the first signal sets `reason`; the second has its usual effect.

    So a run ends between two frames with its files whole, and one that hangs can still be killed.
    Outside the main thread, where Python gets no signals, it does nothing.
    """

    def __init__(self) -> None:
        self.reason: str | None = None
        """Which signal came, or None."""
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> "StopSignals":
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
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

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.reason = f"interrupted by {signal.Signals(number).name}"
        self.__exit__(None, None, None)
