"""A server with one client at a time: its socket, its peers, and the handshake.

A client that is silent, sends half a message, garbage or too much, or dies, loses only its own
connection.
"""

from __future__ import annotations

import abc
import logging
import selectors
import time
from typing import Self

from bridge.link import LinkError
from bridge.tcp.address import bound_socket, format_address
from bridge.tcp.channel import NONCE_BYTES, direction_keys, new_nonce
from bridge.tcp.messages.text import pack_error
from bridge.tcp.peer import SEND_SECONDS, Peer
from bridge.tcp.wire import LARGEST_REPLY, READ_BYTES, Frame, MessageError, MessageKind, pack_frame

_logger = logging.getLogger(__name__)

MAX_STRANGERS = 64
"""Largest number of open connections of peers that are not the client. So many newcomers must come
between the connection of a client and its first message before it loses its place: of 8 it lost it
when a busy machine delayed it by 80 ms."""

_BACKLOG = 4 * MAX_STRANGERS
"""Connections that the system keeps until they are accepted. One that finds no room waits for a
second until the system tries again."""

_ACCEPTED_AT_ONCE = 64
"""Connections that are accepted before the client is heard again."""


class SingleClientServer(abc.ABC):
    """A listening socket, the peers that are connected to it, and the one that is the client.

    Args:
        served: What the client has and no other peer can have: "the tissue".
        host: Host to listen on; without a key only loopback.
        port: Port to listen on; 0 for a free one.
        key: Key that a client must have too; None to serve any client on this machine.

    Raises:
        ValueError: the host is not on loopback and there is no key, or the port is out of range.
        LinkError: the port is in use or not allowed.
    """

    _send_seconds = SEND_SECONDS
    """Longest time for a peer to read a reply [s]."""

    def __init__(self, served: str, host: str, port: int, key: bytes | None) -> None:
        self._served, self._key = served, key
        try:
            self._listener = bound_socket(host, port, has_key=key is not None)
            self._listener.listen(_BACKLOG)
        except OSError as cause:
            raise LinkError(
                f"cannot listen at {format_address((host, port))}: {cause.strerror}. Choose "
                "another port, or 0 for a free one"
            ) from cause
        self._listener.setblocking(False)
        # Others round a time-out up to milliseconds.
        self._selector = selectors.SelectSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._peers: list[Peer] = []
        self._client: Peer | None = None
        self._failure = ""

    @abc.abstractmethod
    def _reply(self, frame: Frame) -> bytes:
        """Return the payload of the reply to a request of the client.

        Raises:
            MessageError: the request is malformed or of an unknown kind.
        """

    @abc.abstractmethod
    def _forget_client(self) -> None:
        """Reset what belongs to the client, which has left."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def address(self) -> str:
        """Address that the server listens on, "HOST:PORT"."""
        return format_address(self._listener.getsockname())

    def run(self) -> None:
        """Serve until an exception such as KeyboardInterrupt."""
        while True:
            self._serve_once(self._seconds_to_deadline())

    def close(self) -> None:
        """Close every connection and the listening socket."""
        for peer in self._peers:
            peer.close()
        self._peers.clear()
        self._selector.close()
        self._listener.close()

    def _serve_once(self, seconds: float | None) -> None:
        """Wait for messages, at most so long [s], answer them, and drop who was silent too long."""
        ready = [key for key, _ in self._selector.select(seconds)]
        for key in ready:
            if key.fileobj is not self._listener:
                self._receive(key.data)
        # Newcomers last: one may take the place of a peer, but not of what that has sent.
        if any(key.fileobj is self._listener for key in ready):
            self._accept()
        now = time.monotonic()
        for peer in [p for p in self._peers if p.deadline < now]:
            self._refuse(peer, "you were silent for too long")

    def _seconds_to_deadline(self) -> float | None:
        """Return the time to the next deadline of a peer [s]; None if there is none."""
        deadlines = [peer.deadline for peer in self._peers]
        return max(0.0, min(deadlines) - time.monotonic()) if deadlines else None

    def _accept(self) -> None:
        """Accept who has connected. Where there are too many, one that is no client has to go."""
        for _ in range(_ACCEPTED_AT_ONCE):
            try:
                connection, where = self._listener.accept()
                peer = Peer(connection, format_address(where))
            except BlockingIOError:
                return
            except OSError as error:  # the peer has gone again, or no file descriptor is left
                _logger.warning("a connection could not be accepted: %s", error)
                return
            self._peers.append(peer)
            self._selector.register(connection, selectors.EVENT_READ, peer)
            self._receive(peer)  # what it has sent counts before the next one comes
            strangers = [each for each in self._peers if each is not self._client]
            if len(strangers) > MAX_STRANGERS:
                self._refuse(
                    _one_too_many(strangers),
                    f"{MAX_STRANGERS} connections without a client are open; there may be no more",
                )

    def _receive(self, peer: Peer) -> None:
        """Read from a peer, and answer each complete request."""
        if peer not in self._peers:
            return  # dropped while an earlier event was handled
        try:
            data = peer.socket.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            return self._drop(peer, f"the connection broke: {error}")
        if not data:
            return self._drop(peer, "it has closed the connection")
        peer.channel.feed(data)
        try:
            while peer in self._peers and (frame := peer.take()) is not None:
                if peer is self._client or self._becomes_client(peer, frame):
                    self._answer(peer, frame)
        except MessageError as error:  # the start of the next message is unknown
            if peer is not self._client and peer.channel.is_authenticated:
                _logger.warning("%s has another key", peer.name)
                return self._refuse(peer, "your key is not the one of this server")
            return self._refuse(peer, str(error))

    def _becomes_client(self, peer: Peer, frame: Frame) -> bool:
        """Continue the handshake; return whether the frame is a HELLO that ends it.

        Without a key that is the first HELLO, which is empty. With a key the first HELLO has the
        client's nonce, and is answered by a CHALLENGE with the server's; the second HELLO has an
        authentication tag.
        """
        if frame.kind != MessageKind.HELLO:
            self._refuse(peer, "the first message must be a HELLO")
        elif self._key is None and frame.payload:
            self._refuse(peer, "you have a key, and this server has none: start it with that key")
        elif self._key is not None and not peer.channel.is_authenticated:
            self._challenge(peer, frame, self._key)
        elif self._client is not None:
            self._refuse(
                peer,
                f"the client {self._client.name} has {self._served}, and only one at a time "
                "can; try again when it has disconnected, or start another server on another port",
            )
        else:
            if not peer.channel.is_authenticated:
                peer.sequence = frame.sequence - 1
            peer.become_client()
            self._client = peer
            _logger.info("client %s has %s", peer.name, self._served)
            return True
        return False

    def _challenge(self, peer: Peer, frame: Frame, key: bytes) -> None:
        """Send the server's nonce, and require authentication tags from now on."""
        if len(frame.payload) != NONCE_BYTES:
            return self._refuse(
                peer, "this server requires a key: give the same one with --key FILE"
            )
        nonce = new_nonce()
        peer.sequence = frame.sequence
        self._send(peer, MessageKind.CHALLENGE, nonce)
        keys = direction_keys(key, frame.payload, nonce)
        peer.channel.authenticate(outgoing=keys.to_client, incoming=keys.to_server)

    def _answer(self, peer: Peer, frame: Frame) -> None:
        try:
            peer.check_sequence(frame.sequence)
            reply = self._reply(frame)
            if len(reply) > LARGEST_REPLY:
                raise MessageError(f"the reply has {len(reply)} bytes, over {LARGEST_REPLY}")
        except MessageError as error:
            self._note_refusal(peer, error)
            self._send(peer, MessageKind.ERROR, pack_error(str(error)), frame.sequence)
        except Exception as error:  # a failure is reported and does not end the server
            text = f"{type(error).__name__}: {error}"
            self._note_failure(peer, text)
            self._send(peer, MessageKind.ERROR, pack_error(text), frame.sequence)
        else:
            self._send(peer, MessageKind(frame.kind), reply, frame.sequence)
        peer.wait_for_a_request()  # however long the answer took

    def _note_refusal(self, peer: Peer, error: MessageError) -> None:
        """Log that a request of the client is refused."""
        _logger.warning("refused a request of %s: %s", peer.name, error)

    def _note_failure(self, peer: Peer, reason: str) -> None:
        """Log why a request of the client failed; once if the next ones fail of the same."""
        if reason != self._failure:
            _logger.exception("%s of %s failed: %s", self._served, peer.name, reason)
        self._failure = reason

    def _send(
        self, peer: Peer, kind: MessageKind, payload: bytes, sequence: int | None = None
    ) -> None:
        if sequence is None:
            sequence = peer.sequence
        try:
            peer.send(peer.channel.pack(kind, sequence, payload), self._send_seconds)
        except OSError as error:
            self._drop(peer, f"its reply cannot be sent: {error}")

    def _refuse(self, peer: Peer, reason: str) -> None:
        """Send the reason, if that is possible without waiting, and drop the peer."""
        sequence, text = (peer.sequence + 1) % (1 << 32), pack_error(reason)
        if peer is self._client:
            frame = b"".join(peer.channel.pack(MessageKind.ERROR, sequence, text))
        else:  # without a tag: a peer with no key, or another one, could not verify it
            frame = pack_frame(MessageKind.ERROR, sequence, text)
        self._drop(peer, reason, frame)

    def _drop(self, peer: Peer, reason: str, final_frame: bytes = b"") -> None:
        _logger.info("dropped %s: %s", peer.name, reason)
        self._peers.remove(peer)
        self._selector.unregister(peer.socket)
        peer.close(final_frame)
        if peer is self._client:
            self._client, self._failure = None, ""
            self._forget_client()


def _one_too_many(strangers: list[Peer]) -> Peer:
    """Return the peer that has to go: the oldest of the host that has the most connections.

    So a newcomer always has a place, and time for a handshake: no number of connections that prove
    no key keeps out a client that has it, nor those of one host a client on another. Who is about
    to prove a key goes after those who have said nothing.
    """
    silent = [peer for peer in strangers[:-1] if not peer.channel.is_authenticated]
    hosts = [peer.host for peer in strangers]
    return max(silent or strangers, key=lambda peer: hosts.count(peer.host))
