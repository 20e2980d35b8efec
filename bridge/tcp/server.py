"""The server's end of the TCP link: serves a tissue to another process.

It serves one client at a time, with a new tissue for each, so that every run starts the same.
"""

from __future__ import annotations

import contextlib
import logging
import signal
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from bridge.description import SceneView
from bridge.link import InProcessLink
from bridge.tcp.address import DEFAULT_HOST, DEFAULT_PORT
from bridge.tcp.messages.body import (
    CHUNKS,
    CUT_FACES,
    CUT_REPORT,
    DEFORMATION,
    MATERIAL_POINTS,
    PIECES,
    POINTS_NOW,
    QUANTITY,
    SINCE,
    SNAPSHOT,
    SURFACE,
    VALUES,
    PointsNow,
)
from bridge.tcp.messages.driven import (
    ATTACHMENT,
    LOAD,
    LOADS,
    MAX_FRAMES,
    NUMBER,
    TIE,
    unpack_geoms,
)
from bridge.tcp.messages.step import RESULT, StepReply, unpack_step
from bridge.tcp.messages.text import DESCRIPTION, MAX_VIEWS, sent_labels, sent_scene_name
from bridge.tcp.request_limits import RequestLimits
from bridge.tcp.single_client import SingleClientServer
from bridge.tcp.wire import Frame, MessageError, MessageKind

if TYPE_CHECKING:  # only the function that makes a tissue loads the compiler
    from tissue import Tissue

_logger = logging.getLogger(__name__)

_QUERIES: dict[int, Callable[[InProcessLink], bytes]] = {
    MessageKind.HELLO: lambda link: _described(link),
    MessageKind.SNAPSHOT: lambda link: SNAPSHOT.pack(link.snapshot()),
    MessageKind.DEFORMATION: lambda link: DEFORMATION.pack(link.deformation()),
    MessageKind.SURFACE: lambda link: SURFACE.pack(link.surface()),
    MessageKind.FRAMES: lambda link: LOADS.pack(link.loads()),
    MessageKind.CHUNKS: lambda link: CHUNKS.pack(link.chunks()),
    MessageKind.PIECES: lambda link: PIECES.pack(link.n_pieces()),
    MessageKind.QUALITY: lambda link: CUT_REPORT.pack(link.cut_report()),
}
"""The requests without a content, and the contents of their replies."""


def _described(link: InProcessLink) -> bytes:
    """Return the reply to a HELLO."""
    description = link.describe()
    return DESCRIPTION.pack(description._replace(labels=sent_labels(description.labels)))


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
        scene: Name of what it makes, as the command line gives it; see `bridge.tcp.messages.text`.
        views: Cameras of that scene.
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


class TissueServer(SingleClientServer):
    """Serves a tissue to one client at a time; `serve` has the same arguments and errors."""

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
        self._requests: dict[int, Callable[[bytes], bytes]] = {
            MessageKind.STEP: self._step,
            MessageKind.ATTACH: lambda payload: self._add(
                partial(self._link.attach, ATTACHMENT.unpack(payload))
            ),
            MessageKind.TIE: lambda payload: self._add(
                partial(self._link.tie, TIE.unpack(payload))
            ),
            MessageKind.COLLIDE: self._collide,
            MessageKind.RELEASE: self._release,
            MessageKind.CUT_FACES: self._cut_faces,
            MessageKind.POSITIONS: self._positions_of,
            MessageKind.VALUES: lambda payload: VALUES.pack(
                self._link.surface_values(QUANTITY.unpack(payload))
            ),
        }
        self._scene, self._views = sent_scene_name(scene), tuple(views)
        super().__init__("the tissue", host, port, key)
        try:
            self._link = self._new_link()
        except BaseException:
            self.close()
            raise

    def _forget_client(self) -> None:
        """Make a new tissue for the next client."""
        self._link = self._new_link()

    def _new_link(self) -> InProcessLink:
        """Return a link to a new tissue."""
        tissue = self._make_tissue()
        self._limits = RequestLimits(tissue)
        return InProcessLink(tissue, self._scene, self._views)

    def _reply(self, frame: Frame) -> bytes:
        """Return the payload of the reply to a request.

        Raises:
            MessageError: the request is malformed or of an unknown kind.
        """
        payload = frame.payload
        if frame.kind in self._requests:
            return self._requests[frame.kind](payload)
        if payload:
            raise MessageError(f"a request of kind {frame.kind} carries {len(payload)} bytes")
        if frame.kind not in _QUERIES:
            raise MessageError(f"there is no request of kind {frame.kind}")
        return _QUERIES[frame.kind](self._link)

    def _step(self, payload: bytes) -> bytes:
        """Do a step, and return its result.

        Raises:
            MessageError: the request is malformed, or would take too long, or the tissue refuses
                it; nothing has moved then.
        """
        link = self._link
        sweep, dt, poses, geoms = unpack_step(payload, link.n_driven, link.n_geoms)
        self._limits.check_step(sweep, dt, link.tissue.n_tetrahedra)
        if poses:
            self._limits.check_poses(poses, link.loads()[-link.n_driven :])
        with _refusals():
            result = link.step(sweep, dt, poses, geoms)
        reply = StepReply(result, link.loads(), link.geom_loads(), link.n_cut_faces)
        return RESULT.pack(reply)

    def _add(self, add: Callable[[], int]) -> bytes:
        """Add a driven frame, and return the load on it.

        Raises:
            MessageError: the tissue refuses the frame, or there are too many.
        """
        if len(self._link.loads()) == MAX_FRAMES:
            raise MessageError(f"there are {MAX_FRAMES} frames, and there may be no more")
        with _refusals():
            number = add()
        return LOAD.pack(self._link.loads()[number])

    def _release(self, payload: bytes) -> bytes:
        """Release a frame, and return the load on it.

        Raises:
            MessageError: there is no such frame.
        """
        number = NUMBER.unpack(payload)
        with _refusals():
            self._link.release(number)
        return LOAD.pack(self._link.loads()[number])

    def _cut_faces(self, payload: bytes) -> bytes:
        """Return faces that cuts have opened.

        Raises:
            MessageError: there are fewer.
        """
        since = SINCE.unpack(payload)
        with _refusals():
            return CUT_FACES.pack(self._link.cut_faces(since))

    def _positions_of(self, payload: bytes) -> bytes:
        """Return where material points are.

        Raises:
            MessageError: the body has no such tetrahedra.
        """
        at_rest, holders = MATERIAL_POINTS.unpack(payload)
        n = self._link.tissue.n_tetrahedra
        if not ((holders >= -1) & (holders < n)).all():
            raise MessageError(f"a material point is in none of the {n} tetrahedra")
        holders = holders.copy()
        return POINTS_NOW.pack(PointsNow(self._link.positions_of(at_rest, holders), holders))

    def _collide(self, payload: bytes) -> bytes:
        """Replace the geoms that the tissue touches, and return an empty reply.

        Raises:
            MessageError: the request is malformed, or the tissue cannot touch them.
        """
        geoms, poses = unpack_geoms(payload)
        with _refusals():
            self._link.collide_with(geoms, poses)
        return b""


@contextlib.contextmanager
def _refusals() -> Iterator[None]:
    """Turn what the tissue refuses into a refused request: it is no failure of the server."""
    try:
        yield
    except ValueError as error:
        raise MessageError(str(error)) from error


@contextlib.contextmanager
def _terminate_as_interrupt() -> Iterator[None]:
    """End the server on SIGTERM as on Ctrl-C, even where a shell has disabled Ctrl-C."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.default_int_handler) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
