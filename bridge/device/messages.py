"""The messages of a device, by the names of CRTK: the pose that it wants, and how the blade is."""

import math
from typing import Annotated, NamedTuple

import msgspec

from bridge.tcp.messages.driven import WRENCH, expect_near
from bridge.tcp.messages.encoding import FiniteFloat, Message, Record, expect_finite
from bridge.tcp.messages.text import SentSceneName
from bridge.tcp.wire import MessageError
from tissue import FloatArray, Wrench

SHORTEST_PERIOD, LONGEST_PERIOD = 1e-5, 1.0
"""Shortest and longest period [s]. A device sends up to a thousand poses a second."""

_UNIT_TOLERANCE = 1e-3
"""Largest difference of the length of a quaternion from 1: some devices send three decimals."""

_Number = Annotated[int, msgspec.Meta(ge=0)]


class CartesianPose(NamedTuple):
    """A pose in the world."""

    position: FloatArray
    """[m], shape (3,)."""
    orientation: FloatArray
    """Unit quaternion (w, x, y, z), shape (4,)."""


class DeviceState(NamedTuple):
    """State of the blade that a device drives, after the last frame, and what is felt of it."""

    time: float
    """Simulated time [s]."""
    real_time_factor: float
    """Simulated time over wall time, over the last half second."""
    measured_cp: CartesianPose
    """Where the blade is: the origin is its tip, +y points from heel to tip, -z cuts."""
    measured_cf: Wrench
    """Wrench that a device that drives exerts now: that of the tissue on the blade within the
    limits of the simulated arm, continued to this moment; force and torque about the tip, world
    frame. As measured, while none drives."""
    is_engaged: bool
    """Whether the device drives the blade now."""
    has_ended: bool
    """Whether the stroke has ended; the blade rests from then on."""
    n_limited: int
    """Frames in which a limit of speed, turn rate or room held the blade back."""
    n_missed: int = 0
    """Periods in which a device was to send a pose, and sent none."""
    n_dropped: int = 0
    """Messages that were refused, such as a pose that is not finite."""
    stylus_distance: float = 0.0
    """Distance of the stylus from where the blade is led, since it took hold [m]."""
    stylus_angle: float = 0.0
    """Angle by which it is turned from there [rad]."""


class DeviceDescription(NamedTuple):
    """Description of the run whose blade it drives."""

    scene: str
    """Name of the scene."""
    watchdog: float
    """Wall time without a pose after which the blade rests [s]."""
    most_speed: float
    """Highest speed of the middle of the edge [m/s]."""
    most_turn_rate: float
    """Highest rate at which the blade turns [rad/s]."""


class ServoRequest(NamedTuple):
    """The pose that a device wants."""

    stamp: float
    """When it was sent, by the device's clock [s]."""
    period: float
    """Interval at which the device means to send one [s]."""
    servo_cp: CartesianPose
    """The pose."""
    holds: bool
    """Whether the device drives the blade."""


def unpack_servo(payload: bytes) -> ServoRequest:
    """Return the content of a request; the quaternion's length is then 1.

    Raises:
        MessageError: a number is missing, not finite, or out of range.
    """
    request = SERVO.unpack(payload)
    position, orientation = request.servo_cp
    length = math.hypot(*orientation.tolist())
    return request._replace(servo_cp=CartesianPose(position, orientation / length))


def _check_servo(request: ServoRequest) -> None:
    position, orientation = request.servo_cp
    expect_near(position, "the pose")
    # The comparison is false for NaN.
    if not abs(math.hypot(*orientation.tolist()) - 1.0) <= _UNIT_TOLERANCE:
        raise MessageError(f"the orientation is no unit quaternion: {orientation.tolist()}")


def _check_state(state: DeviceState) -> None:
    """Refuse a state that is not finite: no device may render such a force."""
    expect_finite(*state.measured_cp, *state.measured_cf)


_POSE = Record(CartesianPose, position=(3,), orientation=(4,))

SERVO: Message[ServoRequest] = Message(
    Record(
        ServoRequest,
        stamp=FiniteFloat,
        period=Annotated[float, msgspec.Meta(ge=SHORTEST_PERIOD, le=LONGEST_PERIOD)],
        servo_cp=_POSE,
    ),
    "the pose",
    _check_servo,
)
"""The request with the pose that a device wants."""

STATE: Message[DeviceState] = Message(
    Record(
        DeviceState,
        time=FiniteFloat,
        real_time_factor=FiniteFloat,
        measured_cp=_POSE,
        measured_cf=WRENCH,
        n_limited=_Number,
        n_missed=_Number,
        n_dropped=_Number,
        stylus_distance=FiniteFloat,
        stylus_angle=FiniteFloat,
    ),
    "the state of the blade",
    _check_state,
)
"""The reply with the state of the blade."""

DEVICE_DESCRIPTION: Message[DeviceDescription] = Message(
    Record(DeviceDescription, scene=SentSceneName),
    "it is no run that a device drives; start one there with: scalpel-sim run --hand device. Its "
    "description",
)
"""The reply to a HELLO."""
