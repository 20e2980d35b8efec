"""Holds a tissue for another process: the server's end of the TCP link.

One client at a time, and a fresh tissue for each, so that every run starts the same. Whatever a
client does (silence, half a message, garbage, floods, death) costs only that client its place.
"""

from __future__ import annotations

import contextlib
import ipaddress
import logging
import selectors
import signal
import socket
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from bridge.link import InProcessLink, LinkError, TissueLink
from bridge.messages import (
    pack_description,
    pack_error,
    pack_pieces,
    pack_quality,
    pack_result,
    pack_snapshot,
    pack_surface,
    unpack_step,
)
from bridge.tcp import DEFAULT_HOST, DEFAULT_PORT, READ_BYTES
from bridge.wire import (
    LARGEST_REPLY,
    LARGEST_REQUEST,
    Frame,
    FrameReader,
    Kind,
    MessageError,
    pack_frame,
)

if TYPE_CHECKING:  # only its maker needs the engine
    from tissue.tissue import Tissue

logger = logging.getLogger(__name__)

HANDSHAKE_SECONDS = 2.0
"""How long somebody may be connected without having said HELLO [s]."""
FRAME_SECONDS = 2.0
"""How long the rest of a message may take once it has begun [s]. On loopback: microseconds."""
SEND_SECONDS = 10.0
"""How long a client may take to read a reply [s]. The largest is a gibibyte."""
MOST_CONNECTIONS = 8
"""Connections that are open at a time: the client's, and those that have not said HELLO yet."""


def serve(
    make_tissue: Callable[[], Tissue],
    *,
    scene: str = "",
    host: str = DEFAULT_HOST,
    port: int = DEFAULT_PORT,
    on_listening: Callable[[str], None] | None = None,
) -> None:
    """Serve tissues until SIGINT or SIGTERM. Call it from the main thread.

    Args:
        make_tissue: Makes the tissue that a client gets: the same one every time.
        scene: What it makes, as the command line names it.
        host: Where to listen; loopback only.
        port: 0 for any that is free.
        on_listening: Told the address "HOST:PORT" once clients can connect.

    Raises:
        ValueError: the host is not loopback, or the port is none.
        LinkError: the port is in use or not allowed.
    """
    with TissueServer(make_tissue, scene=scene, host=host, port=port) as server:
        logger.info("serving %s at %s", scene or "a tissue", server.address)
        with _terminate_as_interrupt(), contextlib.suppress(KeyboardInterrupt):
            if on_listening is not None:
                on_listening(server.address)
            server.run()
    logger.info("stopped")


class _Peer:
    """Somebody who is connected."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        self.socket = connection
        self.name = name
        self.reader = FrameReader(LARGEST_REQUEST)
        self.sequence = -1
        """Number of the last request."""
        self.deadline: float | None = time.monotonic() + HANDSHAKE_SECONDS
        """When to stop waiting for the rest of a message [s on the monotonic clock]; or None."""


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
    ) -> None:
        self._make_link = lambda: InProcessLink(make_tissue(), scene)
        self._listener = _bound(host, port)
        try:
            self._link: TissueLink = self._make_link()
            self._listener.listen(MOST_CONNECTIONS)
        except BaseException:
            self._listener.close()
            raise
        self._listener.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._peers: list[_Peer] = []
        self._client: _Peer | None = None

    def __enter__(self) -> TissueServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def address(self) -> str:
        """Where it listens, "HOST:PORT"."""
        return _name(self._listener.getsockname())

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
            peer.socket.close()
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
            logger.warning("a connection could not be accepted: %s", error)
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer = _Peer(connection, _name(where))
        self._peers.append(peer)
        self._selector.register(connection, selectors.EVENT_READ, peer)
        if len(self._peers) > MOST_CONNECTIONS:
            self._refuse(peer, f"{MOST_CONNECTIONS} connections are open; there may be no more")

    def _hear(self, peer: _Peer) -> None:
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
        peer.reader.feed(data)
        try:
            while (frame := peer.reader.take()) is not None:
                self._answer(peer, frame)
                if peer not in self._peers:
                    return
                peer.deadline = None
        except MessageError as error:  # nobody knows where the next message begins
            return self._refuse(peer, str(error))
        if peer.deadline is None and peer.reader.is_within_a_frame:
            peer.deadline = time.monotonic() + FRAME_SECONDS

    def _answer(self, peer: _Peer, frame: Frame) -> None:
        if peer is not self._client and not self._take_seat(peer, frame):
            return
        try:
            _check_sequence(frame.sequence, peer.sequence)
            peer.sequence = frame.sequence
            reply = self._reply(frame)
            if len(reply) > LARGEST_REPLY:
                raise MessageError(f"the reply has {len(reply)} bytes, over {LARGEST_REPLY}")
        except MessageError as error:
            logger.warning("refused a request of %s: %s", peer.name, error)
            self._send(peer, pack_frame(Kind.ERROR, frame.sequence, pack_error(str(error))))
        except Exception as error:  # the tissue's failure is the client's to hear of, not our end
            logger.exception("the tissue of %s failed", peer.name)
            text = f"{type(error).__name__}: {error}"
            self._send(peer, pack_frame(Kind.ERROR, frame.sequence, pack_error(text)))
        else:
            self._send(peer, pack_frame(Kind(frame.kind), frame.sequence, reply))

    def _take_seat(self, peer: _Peer, frame: Frame) -> bool:
        """Make the peer the client if it says HELLO and the place is free; else refuse it."""
        peer.sequence = frame.sequence - 1
        if frame.kind != Kind.HELLO:
            self._refuse(peer, "the first message must be a HELLO")
            return False
        if self._client is not None:
            self._refuse(
                peer,
                f"the client {self._client.name} has the tissue, and only one at a time can; "
                "try again when it has left, or start another server on another port",
            )
            return False
        self._client = peer
        logger.info("client %s has the tissue", peer.name)
        return True

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
        if frame.kind == Kind.PIECES:
            return pack_pieces(self._link.n_pieces())
        if frame.kind == Kind.QUALITY:
            return pack_quality(self._link.quality())
        raise MessageError(f"there is no request of kind {frame.kind}")

    def _send(self, peer: _Peer, message: bytes) -> None:
        try:
            try:
                sent = peer.socket.send(message)
            except BlockingIOError:
                sent = 0
            if sent < len(message):
                peer.socket.settimeout(SEND_SECONDS)
                peer.socket.sendall(memoryview(message)[sent:])
                peer.socket.setblocking(False)
        except OSError as error:
            self._drop(peer, f"it does not take its reply: {error}")

    def _refuse(self, peer: _Peer, reason: str) -> None:
        """Say why, if that goes without waiting, and drop the peer."""
        message = pack_frame(Kind.ERROR, (peer.sequence + 1) % (1 << 32), pack_error(reason))
        with contextlib.suppress(OSError):
            peer.socket.send(message)
        self._drop(peer, reason)

    def _drop(self, peer: _Peer, reason: str) -> None:
        logger.info("dropped %s: %s", peer.name, reason)
        self._peers.remove(peer)
        self._selector.unregister(peer.socket)
        with contextlib.suppress(OSError):
            peer.socket.shutdown(socket.SHUT_WR)
        peer.socket.close()
        if peer is self._client:
            self._client = None
            self._link = self._make_link()


def _check_sequence(sequence: int, last: int) -> None:
    """Refuse a request that is not newer than the last one. Numbers wrap; a gap is no harm."""
    if not 0 < (sequence - last) % (1 << 32) < 1 << 31:
        raise MessageError(f"request {sequence} came after request {last}")


def _bound(host: str, port: int) -> socket.socket:
    """Return a socket bound to a loopback address.

    Raises:
        ValueError: the host is not loopback, or the port is none.
        LinkError: the port is in use or not allowed.
    """
    if not 0 <= port <= 65535:
        raise ValueError(f"port {port} is none; wanted 1 to 65535, or 0 for any that is free")
    try:
        found = socket.getaddrinfo(host or "0.0.0.0", port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as cause:
        raise ValueError(f"there is no host {host!r}: {cause}") from cause
    for *_, address in found:
        if not ipaddress.ip_address(str(address[0]).partition("%")[0]).is_loopback:
            raise ValueError(
                f"{host!r} is open to other machines, and the link has no keys yet; listen on "
                "127.0.0.1, and reach it from elsewhere through an SSH tunnel"
            )
    family, kind, protocol, _, address = found[0]
    listener = socket.socket(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
    except OSError as cause:
        listener.close()
        raise LinkError(
            f"cannot listen at {_name(address)}: {cause.strerror}. Choose another port, or 0 for "
            "any that is free"
        ) from cause
    return listener


def _name(address: tuple[Any, ...]) -> str:
    """Return "HOST:PORT" of a socket's address."""
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


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
