"""The client's end of the TCP link to a tissue in another process."""

import functools
from collections.abc import Callable, Mapping, Sequence

from bridge.description import TissueDescription
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
from bridge.tcp.connection import ANSWER_SECONDS, Connection, Served
from bridge.tcp.messages.body import (
    CHUNKS,
    CUT_FACES,
    CUT_REPORT,
    DEFORMATION,
    LARGEST_CHUNKS,
    MATERIAL_POINTS,
    PIECES,
    POINTS_NOW,
    QUANTITY,
    SINCE,
    SNAPSHOT,
    SURFACE,
    VALUES,
    PointsAtRest,
    PointsNow,
    cut_faces_bytes,
    deformation_bytes,
    positions_bytes,
    snapshot_bytes,
    surface_bytes,
    values_bytes,
)
from bridge.tcp.messages.driven import (
    ATTACHMENT,
    LARGEST_LOADS,
    LOAD,
    LOAD_BYTES,
    LOADS,
    NUMBER,
    TIE,
    pack_geoms,
)
from bridge.tcp.messages.encoding import MAP_BYTES
from bridge.tcp.messages.step import LARGEST_RESULT, StepReply, pack_step, unpack_result
from bridge.tcp.messages.text import DESCRIPTION, LARGEST_DESCRIPTION
from bridge.tcp.wire import MessageError, MessageKind
from tissue import (
    BladeSweep,
    Chunks,
    CutFaces,
    CutReport,
    Deformation,
    FloatArray,
    Geom,
    IntArray,
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

    @property
    def label_names(self) -> Mapping[int, str]:
        """Names of the labels of the body."""
        return self._label_names

    def describe(self) -> TissueDescription:
        """Return what the arm side must know of the body now."""
        description = self._connection.request(
            MessageKind.HELLO, b"", LARGEST_DESCRIPTION, DESCRIPTION.unpack
        )
        self._n_nodes, self._n_tetrahedra = description.n_nodes, description.n_tetrahedra
        self._n_cut_faces = description.n_cut_faces
        self._label_names = {each.label: each.name for each in description.labels if each.name}
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
        result, self._loads, self._geom_loads, self._n_cut_faces = answer
        self._n_nodes, self._n_tetrahedra = result.n_nodes, result.n_tetrahedra
        return result

    def attach(self, attachment: FrameAttachment) -> int:
        """Attach a frame to the body; see `TissueLink.attach`."""
        return self._added(MessageKind.ATTACH, ATTACHMENT.pack(attachment))

    def tie(self, tie: FrameTie) -> int:
        """Tie the body by fibres to a frame; see `TissueLink.tie`."""
        return self._added(MessageKind.TIE, TIE.pack(tie))

    def _added(self, kind: MessageKind, request: bytes) -> int:
        """Request a frame, and return its number."""
        before = self.loads()
        reply = self._connection.request(kind, request, LOAD_BYTES, LOAD.unpack)
        self._loads = [*before, reply]
        self._n_led += 1
        return len(before)

    def release(self, number: int) -> None:
        """Release the frame of that number."""
        loads = [*self.loads()]
        loads[number] = self._connection.request(
            MessageKind.RELEASE, NUMBER.pack(number), LOAD_BYTES, LOAD.unpack
        )
        self._loads = loads

    def loads(self) -> Sequence[FrameLoad]:
        """Return what the body did to each frame in the last step."""
        if self._loads is None:
            self._loads = self._connection.request(
                MessageKind.FRAMES, b"", LARGEST_LOADS, LOADS.unpack
            )
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
        return self._connection.request(MessageKind.SNAPSHOT, b"", limit, SNAPSHOT.unpack)

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body, and the speed of its fastest node."""
        return self._connection.request(MessageKind.CHUNKS, b"", LARGEST_CHUNKS, CHUNKS.unpack)

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""
        limit = surface_bytes(self._n_tetrahedra)
        return self._connection.request(MessageKind.SURFACE, b"", limit, SURFACE.unpack)

    def deformation(self) -> Deformation:
        """Return stress and strain of each tetrahedron now."""
        limit = deformation_bytes(self._n_tetrahedra)
        return self._connection.request(MessageKind.DEFORMATION, b"", limit, DEFORMATION.unpack)

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`; see `Tissue.surface_values`."""
        limit, request = values_bytes(self._n_nodes), QUANTITY.pack(quantity)
        return self._connection.request(MessageKind.VALUES, request, limit, VALUES.unpack)

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        return self._connection.request(MessageKind.PIECES, b"", MAP_BYTES, PIECES.unpack)

    @property
    def n_cut_faces(self) -> int:
        """Number of faces that cuts had opened at the end of the last step."""
        return self._n_cut_faces

    def cut_faces(self, since: int = 0) -> CutFaces:
        """Return the faces that cuts have opened, in order; see `TissueLink.cut_faces`."""
        n = self._n_cut_faces
        if not 0 <= since <= n:
            raise ValueError(f"there is no face number {since}: {n} were cut so far")
        limit, request = cut_faces_bytes(n - since), SINCE.pack(since)
        return self._connection.request(MessageKind.CUT_FACES, request, limit, CUT_FACES.unpack)

    def positions_of(self, at_rest: FloatArray, holders: IntArray) -> FloatArray:
        """Return where material points are now [m], shape (n, 3); see `TissueLink`."""
        n, request = len(holders), MATERIAL_POINTS.pack(PointsAtRest(at_rest, holders))
        unpack, limit = functools.partial(_checked_positions, n), positions_bytes(n)
        found = self._connection.request(MessageKind.POSITIONS, request, limit, unpack)
        holders[:] = found.holders
        return found.positions

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and their effect on elements and time step."""
        return self._connection.request(MessageKind.QUALITY, b"", MAP_BYTES, CUT_REPORT.unpack)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


def _checked_result(before: Sequence[FrameLoad] | None, n_geoms: int, payload: bytes) -> StepReply:
    """Return the content of the reply to a step.

    Raises:
        MessageError: see `unpack_result`; or there are other frames than before.
    """
    reply = unpack_result(payload, n_geoms)
    n = len(reply.loads)
    if before is not None and n != len(before):
        raise MessageError(f"a step reply with the loads on {n} frames; there are {len(before)}")
    return reply


def _checked_positions(n_points: int, payload: bytes) -> PointsNow:
    """Return the content of the reply with positions.

    Raises:
        MessageError: it is none, or of another number of points.
    """
    found = POINTS_NOW.unpack(payload)
    if len(found.positions) != n_points:
        raise MessageError(f"the positions of {len(found.positions)} points; wanted {n_points}")
    return found


def _nothing(payload: bytes) -> None:
    if payload:
        raise MessageError(f"a reply of {len(payload)} bytes; wanted none")
