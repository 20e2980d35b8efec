"""Somebody who is connected to a server: a socket, and how far the conversation has come."""

import contextlib
import socket
import time
from collections.abc import Iterable

from bridge.tcp.channel import Channel
from bridge.tcp.seal import NONCE_BYTES, SEAL_BYTES
from bridge.tcp.wire import LARGEST_FRAME, Frame, MessageError

HANDSHAKE_SECONDS = 2.0
"""How long somebody may be connected without having taken the place [s]."""
FRAME_SECONDS = 2.0
"""How long the rest of a message may take once it has begun [s]. On loopback: microseconds."""
SEND_SECONDS = 10.0
"""How long somebody may take to read a reply, all its parts [s]. The largest is a gibibyte."""
HANDSHAKE_BYTES = NONCE_BYTES + SEAL_BYTES
"""Largest payload of somebody who has not taken the place [byte]: strangers get no memory."""


class Peer:
    """A connection to one client, or to one who wants to be it.

    Args:
        connection: Just accepted.
        name: "HOST:PORT" of the other end.
    """

    def __init__(self, connection: socket.socket, name: str) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket = connection
        self.name = name
        self.channel = Channel(HANDSHAKE_BYTES)
        self.sequence = -1
        """Number of the last request."""
        self.deadline: float | None = time.monotonic() + HANDSHAKE_SECONDS
        """When to stop waiting for it [s on the monotonic clock]; None while nothing is due."""
        self._is_seated = False

    def take_seat(self) -> None:
        """Let it make requests from now on."""
        self._is_seated = True
        self.channel.accept(LARGEST_FRAME)
        self.deadline = None

    def take(self) -> Frame | None:
        """Return the next request, or None when it has not come completely.

        From a message's first byte to its last there is a deadline. The handshake has one for all
        of it, so that nobody can stay by talking.

        Raises:
            MessageError: it cannot be read, or its seal is wrong.
        """
        frame = self.channel.take()
        if self._is_seated:
            if frame is not None or not self.channel.is_within_a_frame:
                self.deadline = None
            elif self.deadline is None:
                self.deadline = time.monotonic() + FRAME_SECONDS
        return frame

    def check_newer(self, sequence: int) -> None:
        """Take note of a request's number. Numbers wrap; a gap is no harm.

        Raises:
            MessageError: it is not newer than the last one.
        """
        if not 0 < (sequence - self.sequence) % (1 << 32) < 1 << 31:
            raise MessageError(f"request {sequence} came after request {self.sequence}")
        self.sequence = sequence

    def send(self, frames: Iterable[bytes]) -> None:
        """Send all of it, and wait for a slow reader, but not for ever.

        Raises:
            OSError: the other end is gone, or reads too slowly.
        """
        deadline = None
        for frame in frames:
            try:
                n_sent = self.socket.send(frame)
            except BlockingIOError:
                n_sent = 0
            if n_sent == len(frame):
                continue
            deadline = deadline or time.monotonic() + SEND_SECONDS
            self.socket.settimeout(max(deadline - time.monotonic(), 1e-3))
            self.socket.sendall(memoryview(frame)[n_sent:])
            self.socket.setblocking(False)

    def close(self, last_words: bytes = b"") -> None:
        """Hang up, after a last frame if that goes without waiting."""
        with contextlib.suppress(OSError):
            if last_words:
                self.socket.send(last_words)
            self.socket.shutdown(socket.SHUT_WR)
        self.socket.close()
