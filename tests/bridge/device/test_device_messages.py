"""Poses and states arrive as sent; what no stylus sends and no device renders is refused."""

import numpy as np
import pytest

from bridge import CartesianPose
from bridge.device.messages import SERVO, STATE, ServoRequest, unpack_servo
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tests.bridge.device.served_blade import STATE as BLADE

POSE = CartesianPose(np.array([0.1, -0.2, 0.3]), np.array([0.5, 0.5, -0.5, 0.5]))


def servo(stamp=2.0, period=1e-3, pose=POSE, holds=True):
    return SERVO.pack(ServoRequest(stamp, period, pose, holds))


def test_a_pose_arrives_as_it_was_sent():
    sent = ServoRequest(2.0, 1e-3, POSE, False)
    assert bits(unpack_servo(servo(holds=False))) == bits(sent)


def test_a_state_arrives_as_it_was_sent():
    sent = BLADE._replace(n_missed=3, n_dropped=1, has_ended=True)
    assert bits(STATE.unpack(STATE.pack(sent))) == bits(sent)


@pytest.mark.parametrize("quaternion", [[0, 0, 0, 0], [1, 1, 0, 0], [0.99, 0, 0, 0]])
def test_an_orientation_that_is_no_unit_quaternion_is_refused(quaternion):
    with pytest.raises(MessageError, match="no unit quaternion"):
        unpack_servo(servo(pose=POSE._replace(orientation=np.array(quaternion, float))))


def test_a_quaternion_of_three_decimals_is_scaled_to_length_1():
    rounded = np.array([0.707, 0.707, 0.0, 0.0])
    found = unpack_servo(servo(pose=POSE._replace(orientation=rounded))).servo_cp.orientation
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-15)


def test_a_state_with_a_force_that_is_not_finite_never_reaches_a_device():
    force = np.array([0.0, np.nan, 0.0])
    state = BLADE._replace(measured_cf=BLADE.measured_cf._replace(force=force))
    with pytest.raises(MessageError, match="not finite"):
        STATE.unpack(STATE.pack(state))
