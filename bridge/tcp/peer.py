"""The server's connection to one peer: its socket, its deadline, and its last request."""

import contextlib
import socket
import time
from collections.abc import Iterable

from bridge.tcp.address import keep_alive
from bridge.tcp.channel import NONCE_BYTES, TAG_BYTES, Channel
from bridge.tcp.wire import LARGEST_FRAME, Frame, MessageError

HANDSHAKE_SECONDS = 2.0
"""Longest time from a connection to the end of its handshake [s]."""
FRAME_SECONDS = 2.0
"""Longest time from the first to the last byte of a message [s]. On loopback: microseconds."""
SILENCE_SECONDS = 60.0
"""Longest time from one request of the client to the next [s]. Our clients keep
their place while they pause; see `connection.Heartbeat`."""
SEND_SECONDS = 10.0
"""Longest time for a peer to read a reply, all its parts [s]. The largest is a gibibyte."""
HANDSHAKE_BYTES = NONCE_BYTES + TAG_BYTES
"""Largest payload before the end of the handshake [byte]: unknown peers get no memory."""


class Peer:
    """A connection to the client, or to a peer that wants to become it.

    Args:
        connection: Socket, just accepted.
        name: "HOST:PORT" of the other end.
    """

    def __init__(self, connection: socket.socket, name: str) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        keep_alive(connection)
        self.socket = connection
        self.name = name
        self.channel = Channel(HANDSHAKE_BYTES)
        self.sequence = -1
        """Number of the last request."""
        self.deadline = time.monotonic() + HANDSHAKE_SECONDS
        """Time at which the server stops waiting [s on the monotonic clock]."""
        self._is_client = self._is_within_a_frame = False

    @property
    def host(self) -> str:
        """Host of the other end."""
        return self.name.rpartition(":")[0]

    def become_client(self) -> None:
        """End the handshake: accept requests from now on."""
        self._is_client = True
        self.channel.limit = LARGEST_FRAME
        self.wait_for_a_request()

    def wait_for_a_request(self) -> None:
        """Begin to wait for the client's next request."""
        self.deadline = time.monotonic() + SILENCE_SECONDS

    def take(self) -> Frame | None:
        """Return the next request, or None if it is incomplete.

        From the first byte of a message to its last there is a deadline. The whole handshake has
        one, so that a peer cannot stay connected by sending.

        Raises:
            MessageError: the request cannot be read, or its authentication tag is wrong.
        """
        frame = self.channel.take()
        was_within, self._is_within_a_frame = self._is_within_a_frame, False
        if self._is_client and frame is None and self.channel.is_within_a_frame:
            self._is_within_a_frame = True
            if not was_within:
                self.deadline = time.monotonic() + FRAME_SECONDS
        return frame

    def check_sequence(self, sequence: int) -> None:
        """Record the number of a request. Numbers wrap; gaps are allowed.

        Raises:
            MessageError: the number is not newer than the last one.
        """
        if not 0 < (sequence - self.sequence) % (1 << 32) < 1 << 31:
            raise MessageError(f"request {sequence} came after request {self.sequence}")
        self.sequence = sequence

    def send(self, frames: Iterable[bytes], seconds: float) -> None:
        """Send all frames. A slow reader is waited for until so many seconds have passed.

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
            deadline = deadline or time.monotonic() + seconds
            self.socket.settimeout(max(deadline - time.monotonic(), 1e-3))
            self.socket.sendall(memoryview(frame)[n_sent:])
            self.socket.setblocking(False)

    def close(self, final_frame: bytes = b"") -> None:
        """Close the connection, after a final frame if that can be sent without waiting."""
        with contextlib.suppress(OSError):
            if final_frame:
                self.socket.send(final_frame)
            self.socket.shutdown(socket.SHUT_WR)
        self.socket.close()
