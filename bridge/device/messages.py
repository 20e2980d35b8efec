"""The messages of a device: the pose that it wants, and how the blade is."""

import math
import struct
from typing import NamedTuple

import msgspec
import numpy as np

from bridge.tcp.messages.text import WANTED_NAME, is_scene_name
from bridge.tcp.wire import MessageError
from tissue import LARGEST_COORDINATE, FloatArray, Wrench


class CartesianPose(NamedTuple):
    """A pose in the world."""

    position: FloatArray
    """[m], shape (3,)."""
    orientation: FloatArray
    """Unit quaternion (w, x, y, z), shape (4,)."""


class DeviceState(NamedTuple):
    """State of the blade that a device drives, after the last frame."""

    time: float
    """Simulated time [s]."""
    real_time_factor: float
    """Simulated time over wall time, over the last half second."""
    measured_cp: CartesianPose
    """Where the blade is: the origin is its tip, +y points from heel to tip, -z cuts."""
    measured_cf: Wrench
    """What the tissue does to the blade, as the simulated arm feels it within its limits: force and
    torque about the tip, world frame."""
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


class DeviceDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Description of the run whose blade it drives."""

    scene: str
    """Name of the scene."""
    watchdog: float
    """Wall time without a pose after which the blade rests [s]."""
    most_speed: float
    """Highest speed of the middle of the edge [m/s]."""
    most_turn_rate: float
    """Highest rate at which the blade turns [rad/s]."""


SHORTEST_PERIOD, LONGEST_PERIOD = 1e-5, 1.0
"""Shortest and longest period [s]. A device sends up to a thousand poses a second."""

LARGEST_DEVICE_DESCRIPTION = 1 << 12
"""Largest description [byte]: a name and three numbers."""

_UNIT_TOLERANCE = 1e-3
"""Largest difference of the length of a quaternion from 1: some devices send three decimals."""

_SERVO = struct.Struct("<9dI")

_STATE = struct.Struct("<15d3q2I")

STATE_BYTES = _STATE.size
"""Length of the reply with the state [byte]."""

_description_decoder = msgspec.json.Decoder(DeviceDescription)


class ServoRequest(NamedTuple):
    """The pose that a device wants."""

    stamp: float
    """When it was sent, by the device's clock [s]."""
    period: float
    """How often the device means to send one [s]."""
    servo_cp: CartesianPose
    """The pose."""
    holds: bool
    """Whether the device drives the blade."""


def pack_servo(request: ServoRequest) -> bytes:
    """Return the request."""
    position, orientation = (part.tolist() for part in request.servo_cp)
    return _SERVO.pack(request.stamp, request.period, *position, *orientation, int(request.holds))


def unpack_servo(payload: bytes) -> ServoRequest:
    """Return the content of a request; the quaternion's length is then 1.

    Raises:
        MessageError: a number is missing, not finite, or out of range.
    """
    if len(payload) != _SERVO.size:
        raise MessageError(f"a pose of {len(payload)} bytes; wanted {_SERVO.size}")
    stamp, period, *numbers, holds = _SERVO.unpack(payload)
    if not (math.isfinite(stamp) and SHORTEST_PERIOD <= period <= LONGEST_PERIOD):
        raise MessageError(
            f"a stamp of {stamp} s and a period of {period} s; wanted a finite stamp, and a period "
            f"from {SHORTEST_PERIOD:g} to {LONGEST_PERIOD:g} s"
        )
    # The comparisons are false for NaN.
    if not all(-LARGEST_COORDINATE <= x <= LARGEST_COORDINATE for x in numbers[:3]):
        raise MessageError(f"the pose is not within {LARGEST_COORDINATE:g} m: {numbers[:3]}")
    length = math.hypot(*numbers[3:])
    if not abs(length - 1.0) <= _UNIT_TOLERANCE:
        raise MessageError(f"the orientation is no unit quaternion: {numbers[3:]}")
    if holds not in (0, 1):
        raise MessageError(f"a pose with {holds} for whether the device leads; wanted 0 or 1")
    pose = CartesianPose(np.array(numbers[:3]), np.array(numbers[3:]) / length)
    return ServoRequest(stamp, period, pose, bool(holds))


def pack_state(state: DeviceState) -> bytes:
    """Return the reply with the state."""
    return _STATE.pack(
        state.time,
        state.real_time_factor,
        *state.measured_cp.position.tolist(),
        *state.measured_cp.orientation.tolist(),
        *state.measured_cf.force.tolist(),
        *state.measured_cf.torque.tolist(),
        state.n_limited,
        state.n_missed,
        state.n_dropped,
        int(state.is_engaged),
        int(state.has_ended),
    )


def unpack_state(payload: bytes) -> DeviceState:
    """Return the content of a reply with the state.

    Raises:
        MessageError: a number is missing or not finite: no device may render such a force.
    """
    if len(payload) != _STATE.size:
        raise MessageError(f"a state of {len(payload)} bytes; wanted {_STATE.size}")
    found = _STATE.unpack(payload)
    numbers = np.array(found[:15])
    if not np.isfinite(numbers).all():
        raise MessageError(f"the state of the blade is not finite: {numbers.tolist()}")
    position = numbers[2:5]
    limited, missed, dropped, is_engaged, has_ended = found[15:]
    return DeviceState(
        float(numbers[0]),
        float(numbers[1]),
        CartesianPose(position, numbers[5:9]),
        Wrench(numbers[9:12], numbers[12:15], position),
        bool(is_engaged),
        bool(has_ended),
        limited,
        missed,
        dropped,
    )


def pack_device_description(description: DeviceDescription) -> bytes:
    """Return the reply to a HELLO."""
    return msgspec.json.encode(description)


def unpack_device_description(payload: bytes) -> DeviceDescription:
    """Return the description in the reply to a HELLO.

    Raises:
        MessageError: the other side is no run that a device drives, or its scene has no valid name.
    """
    try:
        found = _description_decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(
            "it is no run that a device drives; start one there with: scalpel-sim run --hand "
            f"device ({error})"
        ) from error
    if not is_scene_name(found.scene):
        raise MessageError(f"the run's scene is {found.scene[:80]!r}; wanted {WANTED_NAME}")
    return found
