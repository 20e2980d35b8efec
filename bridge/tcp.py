"""A tissue in another process: the client's end of the TCP link."""

import socket
import time
from collections.abc import Callable
from typing import TypeVar

from bridge.link import LinkError, TissueDescription
from bridge.messages import (
    LARGEST_DESCRIPTION,
    LARGEST_ERROR,
    PIECES_BYTES,
    QUALITY_BYTES,
    RESULT_BYTES,
    pack_step,
    snapshot_bytes,
    surface_bytes,
    unpack_description,
    unpack_error,
    unpack_pieces,
    unpack_quality,
    unpack_result,
    unpack_snapshot,
    unpack_surface,
)
from bridge.wire import LARGEST_REPLY, Frame, FrameReader, Kind, MessageError, pack_frame
from tissue.quality import QualityReport
from tissue.types import BladeSweep, Snapshot, StepResult, Surface

Value = TypeVar("Value")

DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 8766

CONNECT_SECONDS = 5.0
"""How long to wait for a connection [s]. On loopback it is there at once or not at all."""
ANSWER_SECONDS = 60.0
"""How long to wait for an answer [s]. A step takes a millisecond, but the first steps of a freshly
installed server compile."""
READ_BYTES = 1 << 16
"""How much to take from a socket at once [byte]. From 128 KiB on, every read would map fresh memory
from the system, which takes longer than the rest of a round trip."""


class TcpLink:
    """A tissue that `bridge.server.serve` holds. Not to be shared between threads.

    When the tissue refuses a request, the link stays; when the connection fails, it is closed.

    Args:
        address: "HOST:PORT".
        timeout: How long to wait for an answer [s].

    Raises:
        ValueError: the address is malformed.
        LinkError: nobody listens there, another client holds the tissue, or the other side is not
            a tissue of this version.
    """

    def __init__(self, address: str, timeout: float = ANSWER_SECONDS) -> None:
        self._address = address
        self._timeout = timeout
        self._sequence = 0
        self._reader = FrameReader(LARGEST_ERROR)
        self._socket: socket.socket | None = _connect(address, timeout)
        try:
            self.describe()
        except LinkError:
            self.close()
            raise

    def describe(self) -> TissueDescription:
        """See `TissueLink.describe`."""
        description = self._ask(Kind.HELLO, b"", LARGEST_DESCRIPTION, unpack_description)
        self._n_nodes, self._n_tetrahedra = description.n_nodes, description.n_tetrahedra
        return description

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """See `TissueLink.step`."""
        result = self._ask(Kind.STEP, pack_step(sweep, dt), RESULT_BYTES, unpack_result)
        self._n_nodes, self._n_tetrahedra = result.n_nodes, result.n_tetrahedra
        return result

    def snapshot(self) -> Snapshot:
        """See `TissueLink.snapshot`."""
        limit = snapshot_bytes(self._n_nodes, self._n_tetrahedra)
        return self._ask(Kind.SNAPSHOT, b"", limit, unpack_snapshot)

    def surface(self) -> Surface:
        """See `TissueLink.surface`."""
        limit = surface_bytes(self._n_tetrahedra)
        return self._ask(Kind.SURFACE, b"", limit, unpack_surface)

    def n_pieces(self) -> int:
        """See `TissueLink.n_pieces`."""
        return self._ask(Kind.PIECES, b"", PIECES_BYTES, unpack_pieces)

    def quality(self) -> QualityReport:
        """See `TissueLink.quality`."""
        return self._ask(Kind.QUALITY, b"", QUALITY_BYTES, unpack_quality)

    def close(self) -> None:
        """See `TissueLink.close`."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _ask(
        self, kind: Kind, payload: bytes, limit: int, unpack: Callable[[bytes], Value]
    ) -> Value:
        """Send a request and return what its reply of at most `limit` bytes says."""
        if self._socket is None:
            raise LinkError(f"the link to the tissue at {self._address} is closed")
        # The limit only grows: the reply to a request that Ctrl-C interrupted may still come.
        self._reader.limit = min(max(self._reader.limit, limit), LARGEST_REPLY)
        sequence = self._sequence
        self._sequence = (sequence + 1) % (1 << 32)
        try:
            self._socket.sendall(pack_frame(kind, sequence, payload))
            frame = self._answer_to(sequence, self._socket)
            if frame.kind == Kind.ERROR:
                error = unpack_error(frame.payload)
            elif frame.kind != kind:
                raise MessageError(f"a reply of kind {frame.kind} to a request of kind {kind}")
            else:
                return unpack(frame.payload)
        except TimeoutError as cause:
            self.close()
            raise LinkError(
                f"the tissue at {self._address} did not answer within {self._timeout:g} s"
            ) from cause
        except (OSError, MessageError) as cause:
            self.close()
            raise LinkError(f"the link to the tissue at {self._address} broke: {cause}") from cause
        raise LinkError(f"the tissue at {self._address} refused: {error}")

    def _answer_to(self, sequence: int, connection: socket.socket) -> Frame:
        """Return the reply to the request of this number; drop replies to earlier ones."""
        deadline = time.monotonic() + self._timeout
        while True:
            frame = self._reader.take()
            if frame is not None and frame.sequence == sequence:
                return frame
            if frame is not None:
                continue
            if time.monotonic() > deadline:  # each read has its own limit; this is for a trickle
                raise TimeoutError
            data = connection.recv(READ_BYTES)
            if not data:
                raise ConnectionResetError("the other side has gone")
            self._reader.feed(data)


def parse_address(address: str) -> tuple[str, int]:
    """Return host and port of "HOST:PORT", or of "[HOST]:PORT" where the host has colons.

    Raises:
        ValueError: it is neither.
    """
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not colon or not host or not (port.isascii() and port.isdigit()) or int(port) > 65535:
        raise ValueError(f"{address!r} is no address; wanted HOST:PORT, as in 127.0.0.1:8766")
    return host, int(port)


def _connect(address: str, timeout: float) -> socket.socket:
    where = parse_address(address)
    seconds = min(timeout, CONNECT_SECONDS)
    try:
        connection = socket.create_connection(where, seconds)
    except TimeoutError as cause:
        raise LinkError(f"nobody answers at {address} within {seconds:g} s") from cause
    except ConnectionRefusedError as cause:
        raise LinkError(
            f"no tissue is served at {address}; start one there with: scalpel-sim serve"
        ) from cause
    except OSError as cause:
        raise LinkError(f"{address} cannot be reached: {cause.strerror or cause}") from cause
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.settimeout(timeout)
    return connection
