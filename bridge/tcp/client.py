"""The client's end of the TCP link to a tissue in another process."""

import functools
from collections.abc import Callable, Sequence

from bridge.driven import (
    NO_GEOMS,
    FrameAttachment,
    FrameLoad,
    FramePose,
    FrameTie,
    GeomLoads,
    GeomPoses,
    expect_each,
    expect_pose_of_each,
    no_geom_loads,
)
from bridge.link import TissueDescription
from bridge.tcp.connection import ANSWER_SECONDS, Connection, Served
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
    pack_attachment,
    pack_number,
    pack_tie,
    unpack_all_loads,
    unpack_loads,
)
from bridge.tcp.messages.result import LARGEST_RESULT, unpack_result
from bridge.tcp.messages.step import pack_step
from bridge.tcp.messages.text import LARGEST_DESCRIPTION, unpack_description
from bridge.tcp.messages.values import pack_quantity, unpack_values, values_bytes
from bridge.tcp.wire import MessageError, MessageKind
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

_TISSUE = Served("the tissue", "no tissue is served", "start one there with: scalpel-sim serve")


class TcpLink:
    """A link to a tissue that `serve` holds. Not to be shared between threads.

    When the tissue refuses a request, the link stays open; when the connection fails, it is closed.

    Args:
        address: Address of the server, "HOST:PORT".
        timeout: Longest wait for an answer [s].
        key: Key that both sides share (`keys.read_key`); None for a server on this machine without
            a key.
        patience: Longest wait for a server that does not listen yet [s].

    Raises:
        ValueError: the address is malformed, or of another machine and there is no key.
        LinkError: there is no server at the address, another client holds the tissue, or the server
            has another key or another version of the protocol.
    """

    def __init__(
        self,
        address: str,
        timeout: float = ANSWER_SECONDS,
        *,
        key: bytes | None = None,
        patience: float = 0.0,
    ) -> None:
        self._n_led = 0
        self._loads: Sequence[FrameLoad] | None = None
        self._geom_loads = no_geom_loads(0)
        self._connection = Connection(address, _TISSUE, timeout, key, patience)
        try:
            self.describe()
        except BaseException:
            self.close()
            raise

    @property
    def while_waiting(self) -> Callable[[], object]:
        """Called ten times a second while a call waits for an answer; what it raises ends that."""
        return self._connection.while_waiting

    @while_waiting.setter
    def while_waiting(self, call: Callable[[], object]) -> None:
        self._connection.while_waiting = call

    def describe(self) -> TissueDescription:
        """Return what the arm side must know of the body now."""
        description = self._connection.request(
            MessageKind.HELLO, b"", LARGEST_DESCRIPTION, unpack_description
        )
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
        answer = self._connection.request(MessageKind.STEP, request, LARGEST_RESULT, unpack)
        result, self._loads, self._geom_loads = answer
        self._n_nodes, self._n_tetrahedra = result.n_nodes, result.n_tetrahedra
        return result

    def attach(self, attachment: FrameAttachment) -> int:
        """Attach a frame to the body; see `TissueLink.attach`."""
        return self._added(MessageKind.ATTACH, pack_attachment(attachment))

    def tie(self, tie: FrameTie) -> int:
        """Tie the body by strands to a frame; see `TissueLink.tie`."""
        return self._added(MessageKind.TIE, pack_tie(tie))

    def _added(self, kind: MessageKind, request: bytes) -> int:
        """Ask for a frame, and return its number."""
        before = self.loads()
        reply = self._connection.request(kind, request, LOAD_BYTES, _one_load)
        self._loads = [*before, reply]
        self._n_led += 1
        return len(before)

    def release(self, number: int) -> None:
        """Release the frame of that number."""
        loads = [*self.loads()]
        loads[number] = self._connection.request(
            MessageKind.RELEASE, pack_number(number), LOAD_BYTES, _one_load
        )
        self._loads = loads

    def loads(self) -> Sequence[FrameLoad]:
        """Return what the body did to each frame in the last step."""
        if self._loads is None:
            limit = LOAD_BYTES * MAX_FRAMES
            self._loads = self._connection.request(MessageKind.FRAMES, b"", limit, unpack_all_loads)
        return self._loads

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        """Replace the geoms that the body touches; see `TissueLink.collide_with`."""
        expect_pose_of_each(poses, len(geoms))
        self._connection.request(MessageKind.COLLIDE, pack_geoms(geoms, poses), 0, _nothing)
        self._geom_loads = no_geom_loads(len(geoms))

    def geom_loads(self) -> GeomLoads:
        """Return what the body did to each of these geoms in the last step."""
        return self._geom_loads

    def snapshot(self) -> Snapshot:
        """Return the whole state of the body."""
        limit = snapshot_bytes(self._n_nodes, self._n_tetrahedra)
        return self._connection.request(MessageKind.SNAPSHOT, b"", limit, unpack_snapshot)

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body, and the speed of its fastest node."""
        return self._connection.request(MessageKind.CHUNKS, b"", LARGEST_CHUNKS, unpack_chunks)

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""
        limit = surface_bytes(self._n_tetrahedra)
        return self._connection.request(MessageKind.SURFACE, b"", limit, unpack_surface)

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`; see `Tissue.surface_values`."""
        limit, request = values_bytes(self._n_nodes), pack_quantity(quantity)
        return self._connection.request(MessageKind.VALUES, request, limit, unpack_values)

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        return self._connection.request(MessageKind.PIECES, b"", PIECES_BYTES, unpack_pieces)

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and their effect on elements and time step."""
        return self._connection.request(
            MessageKind.QUALITY, b"", CUT_REPORT_BYTES, unpack_cut_report
        )

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


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
