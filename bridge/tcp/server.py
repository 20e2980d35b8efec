"""The server's end of the TCP link: holds a tissue for another process.

It serves one client at a time, with a new tissue for each, so that every run starts the same. A
client that is silent, sends half a message, garbage or too much, or dies, loses only its own
connection.
"""

from __future__ import annotations

import contextlib
import logging
import selectors
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from bridge.link import InProcessLink, LinkError, SceneView
from bridge.tcp.address import DEFAULT_HOST, DEFAULT_PORT, bound_socket, format_address
from bridge.tcp.authentication import NONCE_BYTES, direction_keys, new_nonce
from bridge.tcp.messages.body import pack_pieces, pack_snapshot, pack_surface
from bridge.tcp.messages.chunks import pack_chunks
from bridge.tcp.messages.cut_report import pack_cut_report
from bridge.tcp.messages.geoms import unpack_geoms
from bridge.tcp.messages.led_frames import (
    MAX_FRAMES,
    pack_loads,
    unpack_hold,
    unpack_number,
    unpack_tie,
)
from bridge.tcp.messages.result import pack_result
from bridge.tcp.messages.step import unpack_step
from bridge.tcp.messages.text import MAX_VIEWS, pack_description, pack_error
from bridge.tcp.messages.values import pack_values, unpack_quantity
from bridge.tcp.peer import Peer
from bridge.tcp.wire import LARGEST_REPLY, READ_BYTES, Frame, MessageError, MessageKind, pack_frame

if TYPE_CHECKING:  # only the function that makes a tissue loads the compiler
    from tissue import Tissue

_logger = logging.getLogger(__name__)

MAX_CONNECTIONS = 8
"""Largest number of open connections: that of the client, and of peers that want to become it."""


def serve(
    make_tissue: Callable[[], Tissue],
    *,
    scene: str = "",
    views: Sequence[SceneView] = (),
    host: str = DEFAULT_HOST,
    port: int = DEFAULT_PORT,
    key: bytes | None = None,
    on_listening: Callable[[str], None] | None = None,
) -> None:
    """Serve tissues until SIGINT or SIGTERM. Call it from the main thread.

    Args:
        make_tissue: Function that makes the tissue for a client, the same every time.
        scene: Name of what it makes, as the command line gives it.
        views: Where that is to be looked at from.
        host: Host to listen on; without a key only loopback.
        port: Port to listen on; 0 for a free one.
        key: Key that a client must have too (`keys.read_key`); None to serve any client on this
            machine.
        on_listening: Called with the address "HOST:PORT" once clients can connect.

    Raises:
        ValueError: the host is not on loopback and there is no key, the port is out of range, or
            there are more than `MAX_VIEWS`.
        LinkError: the port is in use or not allowed.
    """
    with TissueServer(
        make_tissue, scene=scene, views=views, host=host, port=port, key=key
    ) as server:
        _logger.info("serving %s at %s", scene or "a tissue", server.address)
        with _terminate_as_interrupt(), contextlib.suppress(KeyboardInterrupt):
            if on_listening is not None:
                on_listening(server.address)
            server.run()
    _logger.info("stopped")


class TissueServer:
    """A listening socket, the peers that are connected to it, and the tissue of the client.

    Args:
        make_tissue: Function that makes the tissue for a client, the same every time.
        scene: Name of what it makes, as the command line gives it.
        views: Where that is to be looked at from.
        host: Host to listen on; without a key only loopback.
        port: Port to listen on; 0 for a free one.
        key: Key that a client must have too; None to serve any client on this machine.

    Raises:
        ValueError: the host is not on loopback and there is no key, the port is out of range, or
            there are more than `MAX_VIEWS`.
        LinkError: the port is in use or not allowed.
    """

    def __init__(
        self,
        make_tissue: Callable[[], Tissue],
        *,
        scene: str = "",
        views: Sequence[SceneView] = (),
        host: str = DEFAULT_HOST,
        port: int = DEFAULT_PORT,
        key: bytes | None = None,
    ) -> None:
        if len(views) > MAX_VIEWS:
            raise ValueError(
                f"the scene has {len(views)} views; a client takes {MAX_VIEWS} at most"
            )
        self._make_tissue = make_tissue
        self._scene, self._views = scene, tuple(views)
        self._key = key
        try:
            self._listener = bound_socket(host, port, has_key=key is not None)
        except OSError as cause:
            raise LinkError(
                f"cannot listen at {format_address((host, port))}: {cause.strerror}. Choose "
                "another port, or 0 for a free one"
            ) from cause
        try:
            self._link = self._new_link()
            self._listener.listen(MAX_CONNECTIONS)
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
        """Address that the server listens on, "HOST:PORT"."""
        return format_address(self._listener.getsockname())

    def run(self) -> None:
        """Serve until an exception such as KeyboardInterrupt."""
        while True:
            for key, _ in self._selector.select(self._seconds_to_deadline()):
                if key.fileobj is self._listener:
                    self._accept()
                else:
                    self._receive(key.data)
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

    def _new_link(self) -> InProcessLink:
        """Return a link to a new tissue."""
        return InProcessLink(self._make_tissue(), self._scene, self._views)

    def _seconds_to_deadline(self) -> float | None:
        """Return the time to the next deadline of a peer [s]; None if there is none."""
        deadlines = [peer.deadline for peer in self._peers if peer.deadline is not None]
        return max(0.0, min(deadlines) - time.monotonic()) if deadlines else None

    def _accept(self) -> None:
        try:
            connection, where = self._listener.accept()
        except OSError as error:  # the peer has gone again, or no file descriptor is left
            _logger.warning("a connection could not be accepted: %s", error)
            return
        peer = Peer(connection, format_address(where))
        self._peers.append(peer)
        self._selector.register(connection, selectors.EVENT_READ, peer)
        if len(self._peers) > MAX_CONNECTIONS:
            self._refuse(peer, f"{MAX_CONNECTIONS} connections are open; there may be no more")

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
            self._refuse(peer, "you have a key, and this server has none: serve with --key")
        elif self._key is not None and not peer.channel.is_authenticated:
            self._challenge(peer, frame, self._key)
        elif self._client is not None:
            self._refuse(
                peer,
                f"the client {self._client.name} has the tissue, and only one at a time can; "
                "try again when it has disconnected, or start another server on another port",
            )
        else:
            if not peer.channel.is_authenticated:
                peer.sequence = frame.sequence - 1
            peer.become_client()
            self._client = peer
            _logger.info("client %s has the tissue", peer.name)
            return True
        return False

    def _challenge(self, peer: Peer, frame: Frame, key: bytes) -> None:
        """Send the server's nonce, and require authentication tags from now on."""
        if len(frame.payload) != NONCE_BYTES:
            return self._refuse(
                peer, "this server asks for a key: give the same one with --key FILE"
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
            _logger.warning("refused a request of %s: %s", peer.name, error)
            self._send(peer, MessageKind.ERROR, pack_error(str(error)), frame.sequence)
        except (
            Exception
        ) as error:  # a failure of the tissue is reported and does not end the server
            _logger.exception("the tissue of %s failed", peer.name)
            text = f"{type(error).__name__}: {error}"
            self._send(peer, MessageKind.ERROR, pack_error(text), frame.sequence)
        else:
            self._send(peer, MessageKind(frame.kind), reply, frame.sequence)

    def _reply(self, frame: Frame) -> bytes:
        """Return the payload of the reply to a request.

        Raises:
            MessageError: the request is malformed or of an unknown kind.
        """
        if frame.kind == MessageKind.STEP:
            link = self._link
            result = link.step(*unpack_step(frame.payload, link.n_led, link.n_geoms))
            return pack_result(result, link.loads(), link.geom_loads())
        if frame.kind == MessageKind.ATTACH:
            return self._added(partial(self._link.attach, unpack_hold(frame.payload)))
        if frame.kind == MessageKind.TIE:
            return self._added(partial(self._link.tie, unpack_tie(frame.payload)))
        if frame.kind == MessageKind.COLLIDE:
            return self._touched(frame.payload)
        if frame.kind == MessageKind.RELEASE:
            number = unpack_number(frame.payload, len(self._link.loads()))
            self._link.release(number)
            return pack_loads([self._link.loads()[number]])
        if frame.kind == MessageKind.VALUES:
            return pack_values(self._link.surface_values(unpack_quantity(frame.payload)))
        if frame.payload:
            raise MessageError(f"a request of kind {frame.kind} carries {len(frame.payload)} bytes")
        if frame.kind == MessageKind.HELLO:
            return pack_description(self._link.describe())
        if frame.kind == MessageKind.SNAPSHOT:
            return pack_snapshot(self._link.snapshot())
        if frame.kind == MessageKind.SURFACE:
            return pack_surface(self._link.surface())
        if frame.kind == MessageKind.FRAMES:
            return pack_loads(self._link.loads())
        if frame.kind == MessageKind.CHUNKS:
            return pack_chunks(self._link.chunks())
        if frame.kind == MessageKind.PIECES:
            return pack_pieces(self._link.n_pieces())
        if frame.kind == MessageKind.QUALITY:
            return pack_cut_report(self._link.cut_report())
        raise MessageError(f"there is no request of kind {frame.kind}")

    def _added(self, add: Callable[[], int]) -> bytes:
        """Let a frame hold tissue, and return the load on it.

        Raises:
            MessageError: it cannot hold it so, or there are too many.
        """
        if len(self._link.loads()) == MAX_FRAMES:
            raise MessageError(f"there are {MAX_FRAMES} frames, and there may be no more")
        try:
            number = add()
        except ValueError as error:
            raise MessageError(str(error)) from error
        return pack_loads(self._link.loads()[number:])

    def _touched(self, payload: bytes) -> bytes:
        """Let the tissue touch geoms, and return an empty reply.

        Raises:
            MessageError: the request is malformed, or the tissue cannot touch them.
        """
        geoms, poses = unpack_geoms(payload)
        try:
            self._link.collide_with(geoms, poses)
        except ValueError as error:
            raise MessageError(str(error)) from error
        return b""

    def _send(
        self, peer: Peer, kind: MessageKind, payload: bytes, sequence: int | None = None
    ) -> None:
        if sequence is None:
            sequence = peer.sequence
        try:
            peer.send(peer.channel.pack(kind, sequence, payload))
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
            self._client = None
            self._link = self._new_link()


@contextlib.contextmanager
def _terminate_as_interrupt() -> Iterator[None]:
    """Let SIGTERM end the server as Ctrl-C does, even where a shell has disabled Ctrl-C."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
