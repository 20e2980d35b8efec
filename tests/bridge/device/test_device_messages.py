import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import CartesianPose
from bridge.device.messages import (
    STATE_BYTES,
    ServoRequest,
    pack_servo,
    pack_state,
    unpack_device_description,
    unpack_servo,
    unpack_state,
)
from bridge.tcp.wire import MessageError
from tests.bridge.device.served_blade import STATE

POSE = CartesianPose(np.array([0.1, -0.2, 0.3]), np.array([0.5, 0.5, -0.5, 0.5]))


def servo(stamp=2.0, period=1e-3, pose=POSE, holds=True):
    return pack_servo(ServoRequest(stamp, period, pose, holds))


def with_number(at, value):
    """Return a request whose number at that place is another."""
    payload = bytearray(servo())
    struct.pack_into("<d", payload, 8 * at, value)
    return bytes(payload)


def test_a_pose_is_read_as_it_was_sent():
    found = unpack_servo(servo(holds=False))
    assert (found.stamp, found.period, found.holds) == (2.0, 1e-3, False)
    assert np.array_equal(found.servo_cp.position, POSE.position)
    assert np.array_equal(found.servo_cp.orientation, POSE.orientation)


def test_a_state_is_read_as_it_was_sent():
    found = unpack_state(pack_state(STATE._replace(n_missed=3, n_dropped=1, has_ended=True)))
    assert (found.n_missed, found.n_limited, found.n_dropped, found.has_ended) == (3, 7, 1, True)
    sent = [*STATE.measured_cp, *STATE.measured_cf]
    got = [*found.measured_cp, *found.measured_cf]
    assert all(np.array_equal(*pair) for pair in zip(sent, got, strict=True))


@pytest.mark.parametrize("at", range(9))
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_a_number_that_no_stylus_sends_is_refused(at, value):
    if at == 0 and value == 1e300:
        return  # a clock may have any origin
    with pytest.raises(MessageError):
        unpack_servo(with_number(at, value))


@pytest.mark.parametrize("quaternion", [[0, 0, 0, 0], [1, 1, 0, 0], [0.99, 0, 0, 0]])
def test_an_orientation_that_is_no_unit_quaternion_is_refused(quaternion):
    with pytest.raises(MessageError, match="no unit quaternion"):
        unpack_servo(servo(pose=POSE._replace(orientation=np.array(quaternion, float))))


def test_a_quaternion_of_three_decimals_is_scaled_to_length_1():
    rounded = np.array([0.707, 0.707, 0.0, 0.0])
    found = unpack_servo(servo(pose=POSE._replace(orientation=rounded))).servo_cp.orientation
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-15)


@given(st.binary(max_size=2 * STATE_BYTES))
def test_garbage_is_a_message_error_and_nothing_else(payload):
    for unpack in (unpack_servo, unpack_state, unpack_device_description):
        with pytest.raises(MessageError):
            unpack(payload)


def test_a_state_with_a_force_that_is_not_finite_never_reaches_a_device():
    force = np.array([0.0, np.nan, 0.0])
    state = STATE._replace(measured_cf=STATE.measured_cf._replace(force=force))
    with pytest.raises(MessageError, match="not finite"):
        unpack_state(pack_state(state))
