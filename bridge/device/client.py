"""A device's end of the link to a run whose blade it drives."""

import time
from typing import Self

import numpy as np

from bridge.device.messages import (
    DEVICE_DESCRIPTION,
    SERVO,
    STATE,
    CartesianPose,
    DeviceState,
    ServoRequest,
)
from bridge.link import LinkError
from bridge.tcp.connection import Connection, Served
from bridge.tcp.messages.encoding import MAP_BYTES
from bridge.tcp.wire import MessageKind
from tissue import FloatArray

DEVICE_ANSWER_SECONDS = 5.0
"""Longest wait for an answer [s]. A frame takes milliseconds; a slow one takes some more."""

_BLADE = Served(
    "the blade",
    "no run waits for a device",
    "start one there with: scalpel-sim run --hand device",
)


class DeviceClient:
    """Drives the blade of a run, as a haptic device or a SpaceMouse does.

    Not to be shared between threads. Where a pose is refused, the link stays open, and the blade
    rests until the next good one; when the connection fails, the link is closed.

    Args:
        address: Where the run waits, "HOST:PORT".
        period: How often poses will be sent [s]; the run counts those that miss it.
        key: Key that both sides share (`read_key`); None for a run on this machine without a key.
        patience: Longest wait for a run that does not wait for a device yet [s].

    Raises:
        ValueError: the address is malformed, or of another machine and there is no key.
        LinkError: no run waits there, another device drives it, or it has another key.
    """

    def __init__(
        self,
        address: str,
        *,
        period: float = 1e-3,
        key: bytes | None = None,
        patience: float = 0.0,
    ) -> None:
        self._period = period
        self._connection = Connection(address, _BLADE, DEVICE_ANSWER_SECONDS, key, patience)
        try:
            self.description = self._connection.request(
                MessageKind.HELLO, b"", MAP_BYTES, DEVICE_DESCRIPTION.unpack
            )
            """Description of the run."""
        except LinkError:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def servo_cp(
        self, position: FloatArray, orientation: FloatArray, *, holds: bool = True
    ) -> DeviceState:
        """Send the pose that is wanted, and return how the blade is.

        The first pose moves nothing: the blade follows the motion from there on.

        Args:
            position: [m], world frame, shape (3,).
            orientation: Unit quaternion (w, x, y, z), shape (4,).
            holds: Whether the device drives the blade, which rests otherwise.

        Raises:
            LinkError: the pose was refused, or the run did not answer.
        """
        pose = CartesianPose(np.asarray(position, float), np.asarray(orientation, float))
        request = ServoRequest(time.monotonic(), self._period, pose, holds)
        return self._state(MessageKind.SERVO, SERVO.pack(request))

    def measured(self) -> DeviceState:
        """Return how the blade is, and send no pose.

        Raises:
            LinkError: the run did not answer.
        """
        return self._state(MessageKind.MEASURED)

    def end(self) -> DeviceState:
        """End the run: the blade rests, and the files are written.

        Raises:
            LinkError: the run did not answer.
        """
        return self._state(MessageKind.END)

    def close(self) -> None:
        """Close the connection: the blade rests."""
        self._connection.close()

    def _state(self, kind: MessageKind, payload: bytes = b"") -> DeviceState:
        return self._connection.request(kind, payload, MAP_BYTES, STATE.unpack)
