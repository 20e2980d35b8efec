"""A place for one message between two threads, of which only the newest matters."""

import threading
from typing import Generic, TypeVar

_Message = TypeVar("_Message")


class NewestMessage(Generic[_Message]):
    """Holds the newest message until it is taken. One that comes before replaces it."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: _Message | None = None
        self._is_closed = False

    def put(self, message: _Message) -> None:
        """Leave a message, and return immediately."""
        with self._changed:
            self._waiting = message
            self._changed.notify()

    def take(self) -> _Message | None:
        """Wait for a message and return it; None when it was closed and holds none."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting is not None or self._is_closed)
            message, self._waiting = self._waiting, None
            return message

    def close(self) -> None:
        """Let the thread that takes know that no more messages come."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
