"""The client's end of the TCP link to a tissue in another process."""

import contextlib
import functools
import socket
import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from bridge.led_frames import FrameHold, FrameLoad, FramePose, FrameTie, expect_each
from bridge.led_geoms import NO_GEOMS, GeomLoads, GeomPoses, expect_pose_of_each, no_geom_loads
from bridge.link import LinkError, TissueDescription
from bridge.tcp.address import is_loopback, parse_address
from bridge.tcp.authentication import NONCE_BYTES, direction_keys, new_nonce
from bridge.tcp.channel import LARGEST_PART, Channel
from bridge.tcp.messages.body import (
    PIECES_BYTES,
    snapshot_bytes,
    surface_bytes,
    unpack_pieces,
    unpack_snapshot,
    unpack_surface,
)
from bridge.tcp.messages.chunks import LARGEST_CHUNKS, unpack_chunks
from bridge.tcp.messages.cut_report import CUT_REPORT_BYTES, unpack_cut_report
from bridge.tcp.messages.geoms import pack_geoms
from bridge.tcp.messages.led_frames import (
    LOAD_BYTES,
    MAX_FRAMES,
    pack_hold,
    pack_number,
    pack_tie,
    unpack_all_loads,
    unpack_loads,
)
from bridge.tcp.messages.result import LARGEST_RESULT, unpack_result
from bridge.tcp.messages.step import pack_step
from bridge.tcp.messages.text import (
    LARGEST_DESCRIPTION,
    LARGEST_ERROR,
    unpack_description,
    unpack_error,
)
from bridge.tcp.messages.values import pack_quantity, unpack_values, values_bytes
from bridge.tcp.wire import LARGEST_REPLY, MORE, READ_BYTES, Frame, MessageError, MessageKind
from tissue import (
    BladeSweep,
    Chunks,
    CutReport,
    FloatArray,
    Geom,
    Snapshot,
    StepResult,
    Surface,
    SurfaceQuantity,
)

_Value = TypeVar("_Value")

CONNECT_SECONDS = 5.0
"""Longest wait for a connection [s]. On loopback it is there at once or not at all."""
ANSWER_SECONDS = 60.0
"""Longest wait for an answer [s]. A step takes a millisecond, but the first steps of a newly
installed server compile."""


class TcpLink:
    """A link to a tissue that `serve` holds. Not to be shared between threads.

    When the tissue refuses a request, the link stays open; when the connection fails, it is closed.

    Args:
        address: Address of the server, "HOST:PORT".
        timeout: Longest wait for an answer [s].
        key: Key that both sides share (`keys.read_key`); None for a server on this machine without
            a key.

    Raises:
        ValueError: the address is malformed, or of another machine and there is no key.
        LinkError: there is no server at the address, another client holds the tissue, or the server
            has another key or another version of the protocol.
    """

    def __init__(
        self, address: str, timeout: float = ANSWER_SECONDS, *, key: bytes | None = None
    ) -> None:
        self._address = address
        self._timeout = timeout
        self._sequence = 0
        self._n_led = 0
        self._loads: Sequence[FrameLoad] | None = None
        self._geom_loads = no_geom_loads(0)
        self._channel = Channel()
        self._socket: socket.socket | None = _connect(address, timeout, has_key=key is not None)
        try:
            if key is not None:
                self._authenticate(key)
            self.describe()
        except LinkError:
            self.close()
            raise

    def describe(self) -> TissueDescription:
        """Return what the arm side must know of the body now."""
        description = self._ask(MessageKind.HELLO, b"", LARGEST_DESCRIPTION, unpack_description)
        self._n_nodes, self._n_tetrahedra = description.n_nodes, description.n_tetrahedra
        return description

    def step(
        self,
        sweep: BladeSweep | None,
        dt: float,
        poses: Sequence[FramePose] = (),
        geoms: GeomPoses = NO_GEOMS,
    ) -> StepResult:
        """Advance the tissue by `dt` [s]; see `TissueLink.step`.

        Raises:
            ValueError: there is another number of poses than frames that were attached, or geoms
                that it touches.
            LinkError: the tissue refuses the request, or did not answer.
        """
        n_geoms = len(self._geom_loads.forces)
        expect_each(poses, self._n_led)
        expect_pose_of_each(geoms, n_geoms)
        request = pack_step(sweep, dt, poses, geoms)
        unpack = functools.partial(_checked_result, self._loads, n_geoms)
        answer = self._ask(MessageKind.STEP, request, LARGEST_RESULT, unpack)
        result, self._loads, self._geom_loads = answer
        self._n_nodes, self._n_tetrahedra = result.n_nodes, result.n_tetrahedra
        return result

    def attach(self, hold: FrameHold) -> int:
        """Attach a frame to the body; see `TissueLink.attach`."""
        return self._added(MessageKind.ATTACH, pack_hold(hold))

    def tie(self, tie: FrameTie) -> int:
        """Tie the body by strands to a frame; see `TissueLink.tie`."""
        return self._added(MessageKind.TIE, pack_tie(tie))

    def _added(self, kind: MessageKind, request: bytes) -> int:
        """Ask for a frame, and return its number."""
        before = self.loads()
        reply = self._ask(kind, request, LOAD_BYTES, _one_load)
        self._loads = [*before, reply]
        self._n_led += 1
        return len(before)

    def release(self, number: int) -> None:
        """Let the frame of that number go."""
        loads = [*self.loads()]
        loads[number] = self._ask(MessageKind.RELEASE, pack_number(number), LOAD_BYTES, _one_load)
        self._loads = loads

    def loads(self) -> Sequence[FrameLoad]:
        """Return what the body did to each frame in the last step."""
        if self._loads is None:
            limit = LOAD_BYTES * MAX_FRAMES
            self._loads = self._ask(MessageKind.FRAMES, b"", limit, unpack_all_loads)
        return self._loads

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        """Let the body touch rigid geoms; see `TissueLink.collide_with`."""
        expect_pose_of_each(poses, len(geoms))
        self._ask(MessageKind.COLLIDE, pack_geoms(geoms, poses), 0, _nothing)
        self._geom_loads = no_geom_loads(len(geoms))

    def geom_loads(self) -> GeomLoads:
        """Return what the body did to each of these geoms in the last step."""
        return self._geom_loads

    def snapshot(self) -> Snapshot:
        """Return the whole state of the body."""
        limit = snapshot_bytes(self._n_nodes, self._n_tetrahedra)
        return self._ask(MessageKind.SNAPSHOT, b"", limit, unpack_snapshot)

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body, and the speed of its fastest node."""
        return self._ask(MessageKind.CHUNKS, b"", LARGEST_CHUNKS, unpack_chunks)

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""
        limit = surface_bytes(self._n_tetrahedra)
        return self._ask(MessageKind.SURFACE, b"", limit, unpack_surface)

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`; see `Tissue.surface_values`."""
        limit, request = values_bytes(self._n_nodes), pack_quantity(quantity)
        return self._ask(MessageKind.VALUES, request, limit, unpack_values)

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        return self._ask(MessageKind.PIECES, b"", PIECES_BYTES, unpack_pieces)

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and their effect on elements and time step."""
        return self._ask(MessageKind.QUALITY, b"", CUT_REPORT_BYTES, unpack_cut_report)

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _authenticate(self, key: bytes) -> None:
        """Exchange nonces with the server, and authenticate all messages that follow.

        The server is authenticated too: without the key, the tag of its next reply would be wrong.
        """
        mine = new_nonce()
        theirs = self._ask(
            MessageKind.HELLO, mine, NONCE_BYTES, _checked_nonce, reply_kind=MessageKind.CHALLENGE
        )
        keys = direction_keys(key, mine, theirs)
        self._channel.authenticate(keys.to_server, keys.to_client, plain_error_may_come=True)

    def _ask(
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
        """
        if self._socket is None:
            raise LinkError(f"the link to the tissue at {self._address} is closed")
        if len(payload) > LARGEST_PART:
            raise LinkError(
                f"a request of {len(payload):,} bytes for the tissue at {self._address}; at most "
                f"{LARGEST_PART:,} are allowed. Hold fewer points, or give meshes of fewer vertices"
            )
        sequence = self._sequence
        self._sequence = (sequence + 1) % (1 << 32)
        try:
            for message in self._channel.pack(kind, sequence, payload):
                self._socket.sendall(message)
            answer = self._answer_to(sequence, max(limit, LARGEST_ERROR), self._socket)
            if answer.kind == MessageKind.ERROR:
                error = unpack_error(answer.payload)
            elif answer.kind != (reply_kind or kind):
                raise MessageError(f"a reply of kind {answer.kind} to a request of kind {kind}")
            else:
                return unpack(answer.payload)
        except TimeoutError as cause:
            self.close()
            raise LinkError(
                f"the tissue at {self._address} did not answer within {self._timeout:g} s"
            ) from cause
        except (OSError, MessageError) as cause:
            self.close()
            raise LinkError(f"the link to the tissue at {self._address} broke: {cause}") from cause
        raise LinkError(f"the tissue at {self._address} refused: {error}")

    def _answer_to(self, sequence: int, limit: int, connection: socket.socket) -> Frame:
        """Return the reply to the request with this number; drop replies to earlier requests."""
        deadline = time.monotonic() + self._timeout
        limit = min(limit, LARGEST_REPLY)
        parts: list[bytes] = []
        n_bytes = 0
        while True:
            frame = self._channel.take()
            if frame is None:
                if time.monotonic() > deadline:  # for a slow trickle: a read has its own limit
                    raise TimeoutError
                data = connection.recv(READ_BYTES)
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


def _checked_result(
    before: Sequence[FrameLoad] | None, n_geoms: int, payload: bytes
) -> tuple[StepResult, list[FrameLoad], GeomLoads]:
    """Return the content of the reply to a step.

    Raises:
        MessageError: see `unpack_result`; or there are other frames than before.
    """
    found = unpack_result(payload, n_geoms)
    n = len(found[1])
    if before is not None and n != len(before):
        raise MessageError(f"a step reply with the loads on {n} frames; there are {len(before)}")
    return found


def _nothing(payload: bytes) -> None:
    if payload:
        raise MessageError(f"a reply of {len(payload)} bytes; wanted none")


def _one_load(payload: bytes) -> FrameLoad:
    return unpack_loads(payload, 1)[0]


def _checked_nonce(payload: bytes) -> bytes:
    if len(payload) != NONCE_BYTES:
        raise MessageError(f"a challenge of {len(payload)} bytes; wanted {NONCE_BYTES}")
    return payload


def _connect(address: str, timeout: float, *, has_key: bool) -> socket.socket:
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
        connection = _first_that_answers([where for *_, where in found], seconds)
    except TimeoutError as cause:
        raise LinkError(f"no server answers at {address} within {seconds:g} s") from cause
    except ConnectionRefusedError as cause:
        raise LinkError(
            f"no tissue is served at {address}; start one there with: scalpel-sim serve"
        ) from cause
    except OSError as cause:
        raise LinkError(f"{address} cannot be reached: {cause.strerror or cause}") from cause
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.settimeout(timeout)
    return connection


def _first_that_answers(addresses: list[Any], seconds: float) -> socket.socket:
    """Return a connection to one of the addresses of a host; raise the error of the last one."""
    for where in addresses[:-1]:
        with contextlib.suppress(OSError):
            return socket.create_connection(where[:2], seconds)
    return socket.create_connection(addresses[-1][:2], seconds)
