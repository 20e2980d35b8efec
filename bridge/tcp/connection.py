"""A client's connection: requests, their replies, and the handshake with a key."""

import contextlib
import logging
import socket
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeVar

from bridge.link import LinkError
from bridge.tcp.address import is_loopback, keep_alive, parse_address
from bridge.tcp.channel import LARGEST_PART, NONCE_BYTES, Channel, direction_keys, new_nonce
from bridge.tcp.messages.text import LARGEST_DESCRIPTION, LARGEST_ERROR, unpack_error
from bridge.tcp.wire import LARGEST_REPLY, MORE, READ_BYTES, Frame, MessageError, MessageKind

_logger = logging.getLogger(__name__)

_Value = TypeVar("_Value")

HEARTBEAT_SECONDS = 15.0
"""Silence after which a client sends a request to keep its place [s]: a quarter of the limit."""

CONNECT_SECONDS = 5.0
"""Longest wait for a connection [s]. On loopback it is there at once or not at all."""

RETRY_SECONDS = 0.2
"""Time between two tries where a server may not listen yet [s]."""

ANSWER_SECONDS = 60.0
"""Longest wait for an answer [s]. A step takes a millisecond, but the first steps of a newly
installed server compile."""

WAIT_SECONDS = 0.1
"""Time from one call of `while_waiting` to the next [s]: who presses Ctrl-C waits no longer."""


class Served(NamedTuple):
    """The other side, as messages to a person name it."""

    name: str
    """Such as "the tissue"."""
    missing: str
    """Such as "no tissue is served"."""
    remedy: str
    """Advice where it is missing."""


class Connection:
    """A connection to a server, for one request at a time. Not to be shared between threads.

    When the server refuses a request, the connection stays open; when it fails, it is closed. While
    its owner pauses, its heartbeat keeps its place.

    Args:
        address: Address of the server, "HOST:PORT".
        served: What is there.
        timeout: Longest wait for an answer [s].
        key: Key that both sides share; None for a server on this machine without a key.
        patience: Longest wait for a server that does not listen yet [s].

    Raises:
        ValueError: the address is malformed, or of another machine and there is no key.
        LinkError: there is no server at the address, or it has another version of the protocol.
    """

    def __init__(
        self,
        address: str,
        served: Served,
        timeout: float,
        key: bytes | None,
        patience: float = 0.0,
    ) -> None:
        self._address, self._timeout = address, timeout
        self._where = f"{served.name} at {address}"
        self._sequence = 0
        self._channel = Channel()
        self._turn = threading.Lock()  # of the owner and the heartbeat
        self._broken_by = ""
        self._heartbeat: Heartbeat | None = None
        self._requested_at = time.monotonic()
        self.while_waiting: Callable[[], object] = lambda: None
        """Called ten times a second while the owner waits for an answer. It may raise an error to
        end that; the connection can still be used, unless a request was only sent in part."""
        self._socket: socket.socket | None = _connect(
            address, served, timeout, patience, has_key=key is not None
        )
        try:
            if key is not None:
                self._authenticate(key)
        except BaseException:
            self.close()
            raise
        self._heartbeat = Heartbeat(self)

    def close(self) -> None:
        """Close the connection."""
        if self._heartbeat is not None:
            self._heartbeat.stop()
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def show_presence(self, silence: float) -> bool:
        """Send a request if none was sent for so long [s]; return whether that is still due."""
        if not self._turn.acquire(blocking=False):
            return True  # a request is under way
        try:
            if self._socket is None:
                return False
            if time.monotonic() - self._requested_at > silence:
                self._exchange(MessageKind.HELLO, b"", LARGEST_DESCRIPTION, lambda: None)
        except LinkError as error:
            if self._socket is None:
                self._broken_by = str(error)
        finally:
            self._turn.release()
        return self._socket is not None

    def request(
        self,
        kind: MessageKind,
        payload: bytes,
        limit: int,
        unpack: Callable[[bytes], _Value],
        reply_kind: MessageKind | None = None,
    ) -> _Value:
        """Send a request and return the content of its reply.

        Args:
            kind: Kind of the request.
            payload: Content of the request.
            limit: Largest content of the reply [byte].
            unpack: Function from the content of the reply to the value to return.
            reply_kind: Kind of the reply; None for that of the request.

        Raises:
            LinkError: the server refuses the request, or did not answer.
        """
        if len(payload) > LARGEST_PART:
            raise LinkError(
                f"a request of {len(payload):,} bytes for {self._where}; at most "
                f"{LARGEST_PART:,} are allowed. Attach fewer points, or give meshes of fewer "
                "vertices"
            )
        while not self._turn.acquire(timeout=WAIT_SECONDS):
            self.while_waiting()
        try:
            answer = self._exchange(kind, payload, limit, self.while_waiting)
            if answer.kind != (reply_kind or kind):
                raise MessageError(f"a reply of kind {answer.kind} to a request of kind {kind}")
            return unpack(answer.payload)
        except MessageError as cause:
            self.close()
            raise LinkError(f"the link to {self._where} broke: {cause}") from cause
        finally:
            self._turn.release()

    def _exchange(
        self, kind: MessageKind, payload: bytes, limit: int, while_waiting: Callable[[], object]
    ) -> Frame:
        """Send a request and return its reply, of which only the length is checked.

        Raises:
            LinkError: the server refuses the request, or did not answer.
        """
        if self._socket is None:
            raise LinkError(self._broken_by or f"the link to {self._where} is closed")
        sequence = self._sequence
        self._sequence = (sequence + 1) % (1 << 32)
        wait = _Wait(self._timeout, while_waiting)
        try:
            self._send(self._channel.pack(kind, sequence, payload), self._socket, wait)
            answer = self._answer_to(sequence, max(limit, LARGEST_ERROR), self._socket, wait)
            error = unpack_error(answer.payload) if answer.kind == MessageKind.ERROR else None
        except TimeoutError as cause:
            self.close()
            raise LinkError(f"{self._where} did not answer within {self._timeout:g} s") from cause
        except LinkError:  # of `while_waiting`
            raise
        except (OSError, MessageError) as cause:
            self.close()
            raise LinkError(f"the link to {self._where} broke: {cause}") from cause
        finally:
            self._requested_at = time.monotonic()
        if error is not None:
            raise LinkError(f"{self._where} refused: {error}")
        return answer

    def _send(self, messages: Iterator[bytes], connection: socket.socket, wait: "_Wait") -> None:
        """Send a request, all its frames."""
        try:
            for message in messages:
                rest = memoryview(message)
                while rest:
                    try:
                        rest = rest[connection.send(rest) :]
                    except TimeoutError:
                        wait.end_piece()
        except BaseException:  # the server would take the next request for the rest of this one
            self.close()
            raise

    def _authenticate(self, key: bytes) -> None:
        """Exchange nonces with the server, and authenticate all messages that follow.

        The server is authenticated too: without the key, the tag of its next reply would be wrong.
        """
        mine = new_nonce()
        theirs = self.request(
            MessageKind.HELLO, mine, NONCE_BYTES, _checked_nonce, reply_kind=MessageKind.CHALLENGE
        )
        keys = direction_keys(key, mine, theirs)
        self._channel.authenticate(keys.to_server, keys.to_client, plain_error_may_come=True)

    def _answer_to(
        self, sequence: int, limit: int, connection: socket.socket, wait: "_Wait"
    ) -> Frame:
        """Return the reply to the request with this number; drop replies to earlier requests."""
        limit = min(limit, LARGEST_REPLY)
        parts: list[bytes] = []
        n_bytes = 0
        while True:
            frame = self._channel.take()
            if frame is None:
                wait.check()  # for a slow trickle
                try:
                    data = connection.recv(READ_BYTES)
                except TimeoutError:
                    wait.end_piece()
                    continue
                if not data:
                    raise ConnectionResetError("the other side has closed it")
                self._channel.feed(data)
            elif frame.sequence == sequence:  # others answer a request that Ctrl-C interrupted
                n_bytes += len(frame.payload)
                if n_bytes > limit:
                    raise MessageError(f"a reply of {n_bytes} bytes; at most {limit} are allowed")
                if not (frame.kind & MORE or parts):
                    return frame
                parts.append(frame.payload)
                if not frame.kind & MORE:
                    return frame._replace(payload=b"".join(parts))


class _Wait:
    """A wait for the other side, in pieces of `WAIT_SECONDS`.

    Args:
        seconds: How long it may take [s].
        while_waiting: Called after each piece.
    """

    def __init__(self, seconds: float, while_waiting: Callable[[], object]) -> None:
        self._deadline = time.monotonic() + seconds
        self._while_waiting = while_waiting

    def check(self) -> None:
        """Raise TimeoutError if it has taken too long."""
        if time.monotonic() > self._deadline:
            raise TimeoutError

    def end_piece(self) -> None:
        """Handle what is due after a piece."""
        self.check()
        self._while_waiting()


def _checked_nonce(payload: bytes) -> bytes:
    if len(payload) != NONCE_BYTES:
        raise MessageError(f"a challenge of {len(payload)} bytes; wanted {NONCE_BYTES}")
    return payload


def _connect(
    address: str, served: Served, timeout: float, patience: float, *, has_key: bool
) -> socket.socket:
    """Return a connection that sends small messages at once.

    Raises:
        ValueError: the address is malformed, or of another machine and there is no key.
        LinkError: no server can be reached there.
    """
    host, port = parse_address(address)
    seconds = min(timeout, CONNECT_SECONDS)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        if not has_key and not all(is_loopback(where) for *_, where in found):
            raise ValueError(
                f"{address} is another machine, and that takes a key: give the key of its server "
                "with --key FILE, or connect through an SSH tunnel"
            )
        places = [where for *_, where in found]
        connection = _once_it_listens(places, seconds, patience, f"{served.missing} at {address}")
    except TimeoutError as cause:
        raise LinkError(f"no server answers at {address} within {seconds:g} s") from cause
    except ConnectionRefusedError as cause:
        raise LinkError(f"{served.missing} at {address}; {served.remedy}") from cause
    except OSError as cause:
        raise LinkError(f"{address} cannot be reached: {cause.strerror or cause}") from cause
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    keep_alive(connection)
    connection.settimeout(min(timeout, WAIT_SECONDS))
    return connection


def _once_it_listens(
    addresses: list[Any], seconds: float, patience: float, missing: str
) -> socket.socket:
    """Return a connection to one of the addresses of a host, which may not listen yet.

    Args:
        addresses: Addresses of the host.
        seconds: Longest wait for each connection [s].
        patience: Longest wait for a host that refuses it [s].
        missing: Warning that is logged once meanwhile.

    Raises:
        OSError: no connection can be made.
    """
    end, is_said = time.monotonic() + patience, False
    while True:
        try:
            return _first_that_answers(addresses, seconds)
        except ConnectionRefusedError:
            if time.monotonic() >= end:
                raise
        if not is_said:
            _logger.warning("%s yet; waiting for it, up to %g s", missing, patience)
            is_said = True
        time.sleep(RETRY_SECONDS)


def _first_that_answers(addresses: list[Any], seconds: float) -> socket.socket:
    """Return a connection to one of the addresses of a host; raise the error of the last one."""
    for where in addresses[:-1]:
        with contextlib.suppress(OSError):
            return socket.create_connection(where[:2], seconds)
    return socket.create_connection(addresses[-1][:2], seconds)


class Heartbeat:
    """Calls `show_presence` of a connection until that is closed, or nobody refers to it any more.

    A process that hangs, or is stopped, has no heartbeat. One that pauses has.
    """

    def __init__(self, client: Connection) -> None:
        self._ended = threading.Event()
        # A client that nobody refers to any more closes its connection: not to be kept alive.
        threading.Thread(
            target=_beat, args=(weakref.ref(client), self._ended), name="heartbeat", daemon=True
        ).start()

    def stop(self) -> None:
        """End the thread, without waiting for it."""
        self._ended.set()


def _beat(client: "weakref.ref[Connection]", ended: threading.Event) -> None:
    while not ended.wait(HEARTBEAT_SECONDS / 4.0):
        found = client()
        if found is None or not found.show_presence(HEARTBEAT_SECONDS):
            return
        del found
