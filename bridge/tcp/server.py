"""Holds a tissue for another process: the server's end of the TCP link.

One client at a time, and a fresh tissue for each, so that every run starts the same. Whatever a
client does (silence, half a message, garbage, floods, death) costs only that client its place.
"""

from __future__ import annotations

import contextlib
import logging
import selectors
import signal
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from bridge.link import InProcessLink, LinkError, TissueLink
from bridge.tcp.address import DEFAULT_HOST, DEFAULT_PORT, bound, name_of
from bridge.tcp.messages.body import pack_pieces, pack_snapshot, pack_surface
from bridge.tcp.messages.chunks import pack_chunks
from bridge.tcp.messages.quality import pack_quality
from bridge.tcp.messages.result import pack_result
from bridge.tcp.messages.step import unpack_step
from bridge.tcp.messages.text import pack_description, pack_error
from bridge.tcp.peer import Peer
from bridge.tcp.seal import NONCE_BYTES, direction_keys, new_nonce
from bridge.tcp.wire import LARGEST_REPLY, READ_BYTES, Frame, Kind, MessageError, pack_frame

if TYPE_CHECKING:  # only its maker needs the engine
    from tissue import Tissue

_logger = logging.getLogger(__name__)

MOST_CONNECTIONS = 8
"""Connections that are open at a time: the client's, and those that want to be it."""


def serve(
    make_tissue: Callable[[], Tissue],
    *,
    scene: str = "",
    host: str = DEFAULT_HOST,
    port: int = DEFAULT_PORT,
    key: bytes | None = None,
    on_listening: Callable[[str], None] | None = None,
) -> None:
    """Serve tissues until SIGINT or SIGTERM. Call it from the main thread.

    Args:
        make_tissue: Makes the tissue that a client gets: the same one every time.
        scene: What it makes, as the command line names it.
        host: Where to listen; without a key loopback only.
        port: 0 for any that is free.
        key: What a client must have, too (`keys.read_key`); None: whoever is on this machine.
        on_listening: Told the address "HOST:PORT" once clients can connect.

    Raises:
        ValueError: the host is not loopback and there is no key, or the port is none.
        LinkError: the port is in use or not allowed.
    """
    with TissueServer(make_tissue, scene=scene, host=host, port=port, key=key) as server:
        _logger.info("serving %s at %s", scene or "a tissue", server.address)
        with _terminate_as_interrupt(), contextlib.suppress(KeyboardInterrupt):
            if on_listening is not None:
                on_listening(server.address)
            server.run()
    _logger.info("stopped")


class TissueServer:
    """A listening socket, those who are connected to it, and the tissue that one of them has.

    Args and Raises: see `serve`.
    """

    def __init__(
        self,
        make_tissue: Callable[[], Tissue],
        *,
        scene: str = "",
        host: str = DEFAULT_HOST,
        port: int = DEFAULT_PORT,
        key: bytes | None = None,
    ) -> None:
        self._make_link = lambda: InProcessLink(make_tissue(), scene)
        self._key = key
        try:
            self._listener = bound(host, port, has_key=key is not None)
        except OSError as cause:
            raise LinkError(
                f"cannot listen at {name_of((host, port))}: {cause.strerror}. Choose another port, "
                "or 0 for any that is free"
            ) from cause
        try:
            self._link: TissueLink = self._make_link()
            self._listener.listen(MOST_CONNECTIONS)
        except BaseException:
            self._listener.close()
            raise
        self._listener.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._peers: list[Peer] = []
        self._client: Peer | None = None

    def __enter__(self) -> TissueServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def address(self) -> str:
        """Where it listens, "HOST:PORT"."""
        return name_of(self._listener.getsockname())

    def run(self) -> None:
        """Serve until an exception, such as KeyboardInterrupt, ends it."""
        while True:
            for key, _ in self._selector.select(self._patience()):
                if key.fileobj is self._listener:
                    self._accept()
                else:
                    self._hear(key.data)
            now = time.monotonic()
            for peer in [p for p in self._peers if p.deadline is not None and p.deadline < now]:
                self._refuse(peer, "you were silent for too long")

    def close(self) -> None:
        """Close every connection and the listening socket."""
        for peer in self._peers:
            peer.close()
        self._peers.clear()
        self._selector.close()
        self._listener.close()

    def _patience(self) -> float | None:
        """Return how long nothing needs to be done if nobody speaks [s]."""
        deadlines = [peer.deadline for peer in self._peers if peer.deadline is not None]
        return max(0.0, min(deadlines) - time.monotonic()) if deadlines else None

    def _accept(self) -> None:
        try:
            connection, where = self._listener.accept()
        except OSError as error:  # gone again, or no file descriptor left
            _logger.warning("a connection could not be accepted: %s", error)
            return
        peer = Peer(connection, name_of(where))
        self._peers.append(peer)
        self._selector.register(connection, selectors.EVENT_READ, peer)
        if len(self._peers) > MOST_CONNECTIONS:
            self._refuse(peer, f"{MOST_CONNECTIONS} connections are open; there may be no more")

    def _hear(self, peer: Peer) -> None:
        """Take what has come from a peer, and answer each whole request in it."""
        if peer not in self._peers:
            return  # dropped while an earlier event was handled
        try:
            data = peer.socket.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            return self._drop(peer, f"the connection broke: {error}")
        if not data:
            return self._drop(peer, "it has left")
        peer.channel.feed(data)
        try:
            while peer in self._peers and (frame := peer.take()) is not None:
                if peer is self._client or self._takes_seat(peer, frame):
                    self._answer(peer, frame)
        except MessageError as error:  # nobody knows where the next message begins
            if peer is not self._client and peer.channel.is_sealed:
                _logger.warning("%s has another key", peer.name)
                return self._refuse(peer, "your key is not the one of this server")
            return self._refuse(peer, str(error))

    def _takes_seat(self, peer: Peer, frame: Frame) -> bool:
        """Go on with the handshake; return whether the frame is a HELLO that makes it the client.

        Without a key that is the first one, and empty. With a key the first one brings the client's
        nonce, and is answered by a CHALLENGE with ours; the second one is sealed with the key.
        """
        if frame.kind != Kind.HELLO:
            self._refuse(peer, "the first message must be a HELLO")
        elif self._key is None and frame.payload:
            self._refuse(peer, "you come with a key, and this server has none: serve with --key")
        elif self._key is not None and not peer.channel.is_sealed:
            self._challenge(peer, frame, self._key)
        elif self._client is not None:
            self._refuse(
                peer,
                f"the client {self._client.name} has the tissue, and only one at a time can; "
                "try again when it has left, or start another server on another port",
            )
        else:
            if not peer.channel.is_sealed:
                peer.sequence = frame.sequence - 1
            peer.take_seat()
            self._client = peer
            _logger.info("client %s has the tissue", peer.name)
            return True
        return False

    def _challenge(self, peer: Peer, frame: Frame, key: bytes) -> None:
        """Send our nonce, and ask for seals from now on."""
        if len(frame.payload) != NONCE_BYTES:
            return self._refuse(
                peer, "this server asks for a key: give the one that it has with --key FILE"
            )
        nonce = new_nonce()
        peer.sequence = frame.sequence
        self._send(peer, Kind.CHALLENGE, nonce)
        keys = direction_keys(key, frame.payload, nonce)
        peer.channel.seal(outgoing=keys.to_client, incoming=keys.to_server)

    def _answer(self, peer: Peer, frame: Frame) -> None:
        try:
            peer.check_newer(frame.sequence)
            reply = self._reply(frame)
            if len(reply) > LARGEST_REPLY:
                raise MessageError(f"the reply has {len(reply)} bytes, over {LARGEST_REPLY}")
        except MessageError as error:
            _logger.warning("refused a request of %s: %s", peer.name, error)
            self._send(peer, Kind.ERROR, pack_error(str(error)), frame.sequence)
        except Exception as error:  # the tissue's failure is the client's to hear of, not our end
            _logger.exception("the tissue of %s failed", peer.name)
            text = f"{type(error).__name__}: {error}"
            self._send(peer, Kind.ERROR, pack_error(text), frame.sequence)
        else:
            self._send(peer, Kind(frame.kind), reply, frame.sequence)

    def _reply(self, frame: Frame) -> bytes:
        """Return the payload of the reply to a request.

        Raises:
            MessageError: the request makes no sense.
        """
        if frame.kind == Kind.STEP:
            return pack_result(self._link.step(*unpack_step(frame.payload)))
        if frame.payload:
            raise MessageError(f"a request of kind {frame.kind} carries {len(frame.payload)} bytes")
        if frame.kind == Kind.HELLO:
            return pack_description(self._link.describe())
        if frame.kind == Kind.SNAPSHOT:
            return pack_snapshot(self._link.snapshot())
        if frame.kind == Kind.SURFACE:
            return pack_surface(self._link.surface())
        if frame.kind == Kind.CHUNKS:
            return pack_chunks(self._link.chunks())
        if frame.kind == Kind.PIECES:
            return pack_pieces(self._link.n_pieces())
        if frame.kind == Kind.QUALITY:
            return pack_quality(self._link.quality())
        raise MessageError(f"there is no request of kind {frame.kind}")

    def _send(self, peer: Peer, kind: Kind, payload: bytes, sequence: int | None = None) -> None:
        if sequence is None:
            sequence = peer.sequence
        try:
            peer.send(peer.channel.pack(kind, sequence, payload))
        except OSError as error:
            self._drop(peer, f"it does not take its reply: {error}")

    def _refuse(self, peer: Peer, reason: str) -> None:
        """Say why, if that goes without waiting, and drop the peer."""
        sequence, text = (peer.sequence + 1) % (1 << 32), pack_error(reason)
        # Without a seal during the handshake: who has no key, or another, could not read it.
        plain = pack_frame(Kind.ERROR, sequence, text)
        is_client = peer is self._client
        words = b"".join(peer.channel.pack(Kind.ERROR, sequence, text)) if is_client else plain
        self._drop(peer, reason, words)

    def _drop(self, peer: Peer, reason: str, last_words: bytes = b"") -> None:
        _logger.info("dropped %s: %s", peer.name, reason)
        self._peers.remove(peer)
        self._selector.unregister(peer.socket)
        peer.close(last_words)
        if peer is self._client:
            self._client = None
            self._link = self._make_link()


@contextlib.contextmanager
def _terminate_as_interrupt() -> Iterator[None]:
    """Let SIGTERM end the server as Ctrl-C does, even where a shell switched Ctrl-C off."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
