"""A thread that speaks for a client that has nothing to say, so that it keeps its place."""

import threading
import weakref
from typing import Protocol

HEARTBEAT_SECONDS = 15.0
"""Silence after which a client says that it is there [s]: a quarter of what a server allows."""


class Pausing(Protocol):
    """A client that may pause."""

    def show_presence(self, silence: float) -> bool:
        """Say something if nothing was said for so long [s]; return whether that is still due."""


class Heartbeat:
    """Calls a client's `show_presence` until it is closed, or there is no such client any more.

    A process that hangs, or is stopped, has no heartbeat. One that pauses has.
    """

    def __init__(self, client: Pausing) -> None:
        self._ended = threading.Event()
        # A client that nobody refers to any more closes its connection: not to be kept alive.
        threading.Thread(
            target=_beat, args=(weakref.ref(client), self._ended), name="heartbeat", daemon=True
        ).start()

    def stop(self) -> None:
        """End the thread, without waiting for it."""
        self._ended.set()


def _beat(client: "weakref.ref[Pausing]", ended: threading.Event) -> None:
    while not ended.wait(HEARTBEAT_SECONDS / 4.0):
        found = client()
        if found is None or not found.show_presence(HEARTBEAT_SECONDS):
            return
        del found
