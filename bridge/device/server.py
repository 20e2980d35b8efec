"""The run's end of the link to a device that drives its blade."""

import logging
import time
from typing import Protocol

from bridge.device.messages import (
    DEVICE_DESCRIPTION,
    STATE,
    CartesianPose,
    DeviceDescription,
    DeviceState,
    ServoRequest,
    unpack_servo,
)
from bridge.tcp.address import DEFAULT_HOST
from bridge.tcp.messages.text import sent_scene_name
from bridge.tcp.peer import Peer
from bridge.tcp.single_client import SingleClientServer
from bridge.tcp.wire import Frame, MessageError, MessageKind

_logger = logging.getLogger(__name__)

DEFAULT_DEVICE_PORT = 8767
"""Port at which a run waits for a device: the one after that of a tissue."""


LONGEST_PAUSE = 3600.0
"""Longest pause of which the periods are counted as missed [s]: whatever a device says, their sum
stays a number that a reply has room for."""


class DrivenBlade(Protocol):
    """The blade that a device drives."""

    def servo_cp(self, pose: CartesianPose, *, holds: bool, period: float) -> None:
        """Drive the blade as the device has moved to a pose; without `holds` it rests.

        The next one is to come after a period [s].

        Raises:
            ValueError: the device cannot have moved so.
        """

    def release(self) -> None:
        """Release the blade, which rests where it is."""

    def lose_client(self) -> None:
        """Release the blade at least: the device has gone."""

    def end(self) -> None:
        """End the stroke."""

    def state(self) -> DeviceState:
        """Return how the blade is."""


class DeviceServer(SingleClientServer):
    """Serves one device at a time, which drives a blade.

    What is refused, a device that leaves, and a stream that cannot be read release the blade.

    Args:
        driven: What the device leads.
        description: What a device should know of it.
        host: Host to listen on; without a key only loopback.
        port: Port to listen on; 0 for a free one.
        key: Key that a device must have too; None to serve any device on this machine.

    Raises:
        ValueError: the host is not on loopback and there is no key, or the port is out of range.
        LinkError: the port is in use or not allowed.
    """

    # A device that does not read its replies must not make others wait.
    _send_seconds = 0.0

    def __init__(
        self,
        driven: DrivenBlade,
        description: DeviceDescription,
        *,
        host: str = DEFAULT_HOST,
        port: int = DEFAULT_DEVICE_PORT,
        key: bytes | None = None,
    ) -> None:
        super().__init__("the blade", host, port, key)
        self._driven = driven
        self._description = description._replace(scene=sent_scene_name(description.scene))
        self._stamp: float | None = None
        self._is_refusing = False
        self._n_missed = self._n_dropped = 0

    def serve_for(self, seconds: float) -> None:
        """Answer what has come and what comes within so long [s]; 0: only what has come."""
        until = time.monotonic() + seconds
        self._serve_once(max(seconds, 0.0))
        while (left := until - time.monotonic()) > 0.0:
            self._serve_once(left)

    @property
    def counts(self) -> tuple[int, int]:
        """Periods without a pose, and messages that were refused, so far."""
        return self._n_missed, self._n_dropped

    def _forget_client(self) -> None:
        self._stamp, self._is_refusing = None, False
        self._driven.lose_client()

    def _note_refusal(self, peer: Peer, error: MessageError) -> None:
        """Release the blade; log the first of refusals in a row, of which there may be many."""
        self._n_dropped += 1
        self._driven.release()
        if not self._is_refusing:
            super()._note_refusal(peer, error)
        self._is_refusing = True

    def _reply(self, frame: Frame) -> bytes:
        if frame.kind == MessageKind.SERVO:
            self._servo(unpack_servo(frame.payload))
        elif frame.payload:
            raise MessageError(f"a request of kind {frame.kind} carries {len(frame.payload)} bytes")
        elif frame.kind == MessageKind.HELLO:
            return DEVICE_DESCRIPTION.pack(self._description)
        elif frame.kind == MessageKind.END:
            self._driven.end()
        elif frame.kind != MessageKind.MEASURED:
            raise MessageError(f"there is no request of kind {frame.kind} where a device drives")
        state = self._driven.state()
        return STATE.pack(state._replace(n_missed=self._n_missed, n_dropped=self._n_dropped))

    def _servo(self, request: ServoRequest) -> None:
        """Drive the blade, and count the periods since the last pose in which none was sent.

        Raises:
            MessageError: the device cannot have moved so.
        """
        if self._stamp is not None:
            pause = min(max(request.stamp - self._stamp, 0.0), LONGEST_PAUSE)
            self._n_missed += max(round(pause / request.period) - 1, 0)
        self._stamp = request.stamp
        try:
            self._driven.servo_cp(request.servo_cp, holds=request.holds, period=request.period)
        except ValueError as error:
            raise MessageError(str(error)) from error
        self._is_refusing = False
