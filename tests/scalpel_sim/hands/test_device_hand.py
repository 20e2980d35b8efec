"""What a hand does that a device leads, without a socket."""

import math

import mujoco
import numpy as np
import pytest

from bridge import CartesianPose, DeviceLimits
from bridge.device.exchange import Exchange
from bridge.device.remote_blade import FARTHEST_STEP, LARGEST_STEP_TURN, RemoteBlade
from scalpel_sim.hands.device_hand import MOST_HURRY, WATCHDOG, DeviceHand
from scalpel_sim.hands.limited_pose import MOST_SPEED, MOST_TURN_RATE
from tests.scalpel_sim.hands.driven_runs import DT, ROUNDING, Clock, led, poses

SETTLED = 1e-6
"""How near the blade comes to the pose that is wanted [m]."""


class InOneProcess:
    """What answers a device, in this process: `remote` is its end, and the hand has the other."""

    def __init__(self, hand: DeviceHand, clock: Clock) -> None:
        self.exchange, self.clock = Exchange(), clock
        self.tell(hand.report())
        hand.answers = self
        self.remote = RemoteBlade(self.exchange, DeviceLimits(), 0.04, WATCHDOG, clock)

    def command(self):
        return self.exchange.command

    def tell(self, report) -> None:
        self.exchange.report = report


@pytest.fixture(scope="module")
def at_start():
    return led()


@pytest.fixture
def hand(at_start):
    """A hand at the start of the scene, that leads the arm of `at_start`."""
    return device_hand(at_start)


def device_hand(at_start, **options):
    simulation, _ = at_start
    clock = Clock()
    hand = DeviceHand(simulation, lambda: 1.0, clock=clock, **options)
    InOneProcess(hand, clock)
    return hand


def pose(x=0.0, y=0.0, z=0.0, turn=(0.0, 0.0, 0.0)):
    """Return a pose of the stylus: a place [m], and a rotation vector [rad]."""
    orientation = np.array([1.0, 0.0, 0.0, 0.0])
    mujoco.mju_quatIntegrate(orientation, np.array(turn), 1.0)
    return CartesianPose(np.array([x, y, z]), orientation)


def led_by(hand, n, stylus, first=0, frame=DT):
    """Return the same while the stylus is at `stylus(k)` in frame k, each of so much wall time."""
    found = []
    for k in range(first, first + n):
        hand.answers.clock.now += frame
        hand.answers.remote.servo_cp(stylus(k), holds=True, period=DT)
        found.append(poses(hand, 1, k)[0])
        hand.tell()
    return np.array(found)


def middles(found):
    return 0.5 * (found[:, :3] + found[:, 3:6])


def test_wherever_the_stylus_is_when_it_takes_hold_nothing_moves(hand):
    found = led_by(hand, 100, lambda k: pose(3.0, -2.0, 1.0, (1.0, 0.5, 2.0)))
    assert (found == found[0]).all()
    assert hand.is_engaged and hand.n_limited == 0


def test_the_tip_goes_where_the_stylus_goes(hand):
    found = led_by(hand, 400, lambda k: pose(1.0, 2.0 + min(k, 100) * 1e-4, 3.0))
    assert found[-1, :3] - found[0, :3] == pytest.approx([0.0, 0.01, 0.0], abs=SETTLED)
    assert hand.n_limited == 0


def test_a_stylus_that_only_turns_turns_the_blade_about_its_tip(hand):
    axis, angle = np.array([0.2, 0.1, 0.3]), math.hypot(0.2, 0.1, 0.3)
    found = led_by(hand, 1000, lambda k: pose(turn=axis * min(k, 300) / 300))
    assert found[-1, :3] == pytest.approx(found[0, :3], abs=SETTLED)
    before, after = (row[6:] for row in found[[0, -1]])
    rotated = np.empty(3)
    mujoco.mju_rotVecQuat(rotated, before, pose(turn=axis).orientation)
    assert angle > 0.3 and after == pytest.approx(rotated, abs=1e-5)


def test_no_motion_is_faster_than_the_limits_and_it_is_counted(hand):
    found = led_by(hand, 300, lambda k: pose(0.0, k * 1e-3, 0.0, (0.0, 0.0, 0.005 * k)))
    speeds = np.linalg.norm(np.diff(middles(found), axis=0), axis=1) / DT
    turns = np.linalg.norm(np.diff(found[:, 6:], axis=0), axis=1) / DT
    assert speeds.max() <= MOST_SPEED + 1e-9
    assert turns.max() <= MOST_TURN_RATE * (1.0 + 1e-6)
    assert speeds.max() == pytest.approx(MOST_SPEED)
    assert 200 < hand.n_limited <= 300


@pytest.mark.parametrize(
    "jump",
    [pose(y=10.0), pose(y=1.1 * FARTHEST_STEP), pose(turn=(0.0, 1.1 * LARGEST_STEP_TURN, 0.0))],
    ids=["10 m", "a little too far", "a turn"],
)
def test_a_jump_is_refused_and_the_blade_rests_where_it_is(hand, jump):
    before = led_by(hand, 50, lambda k: pose(y=k * 1e-4))
    with pytest.raises(ValueError, match="has jumped by"):
        hand.answers.remote.servo_cp(jump, holds=True, period=DT)
    after = poses(hand, 100, 50)
    assert not hand.is_engaged and (after == before[-1]).all()
    again = led_by(hand, 100, lambda k: jump, 150)
    assert hand.is_engaged and (again == before[-1]).all()


def test_a_silent_device_lets_go_after_the_time_of_the_watchdog(hand):
    led_by(hand, 50, lambda k: pose(y=k * 2e-4))
    hand._clock.now += WATCHDOG
    poses(hand, 1, 50)
    assert hand.is_engaged
    hand._clock.now += ROUNDING
    rest = poses(hand, 100, 51)
    assert not hand.is_engaged and (rest == rest[0]).all()
    assert hand.ended_at is None


@pytest.mark.parametrize(("frame", "hurry"), [(3.0 * DT, 3.0), (30.0 * DT, MOST_HURRY)])
def test_in_a_slow_run_the_limits_are_those_of_real_time_up_to_a_bound(hand, frame, hurry):
    found = led_by(hand, 10, lambda k: pose(y=min(0.05 * k, 0.1)), 0, frame)
    speeds = np.linalg.norm(np.diff(middles(found), axis=0), axis=1) / DT
    assert speeds.max() == pytest.approx(hurry * MOST_SPEED)


def test_a_hand_at_100_mm_per_s_parts_from_a_slow_run_and_meets_the_blade_again(hand):
    """At a real-time factor of 0.3, out of the room and back, each within a second."""
    frame, n = DT / 0.3, 300
    before = hand.tip
    ways = np.concatenate([np.linspace(0.0, -0.1, n), np.linspace(-0.1, 0.0, n), np.zeros(n)])
    found = led_by(hand, 3 * n, lambda k: pose(z=-ways[k]), 0, frame)
    assert np.linalg.norm(np.diff(middles(found), axis=0), axis=1).max() <= (
        MOST_SPEED * frame + ROUNDING
    )
    assert np.abs(middles(found) - middles(found[:1])).max() < 0.09, "it stayed in the room"
    assert hand.stylus_distance < SETTLED and hand.tip == pytest.approx(before, abs=SETTLED)
    assert hand.n_limited > n / 4


@pytest.mark.parametrize("stop", ["silence", "disconnection"])
def test_a_stroke_ends_with_its_device_if_that_is_asked_for(at_start, stop):
    hand = device_hand(at_start, ends_with_client=True)
    hand.answers.remote.lose_client()  # one that never led
    poses(hand, 10)
    assert hand.ended_at is None
    led_by(hand, 50, lambda k: pose(y=k * 1e-4), 10)
    if stop == "silence":
        hand._clock.now += 1.01 * WATCHDOG
    else:
        hand.answers.remote.lose_client()
    poses(hand, 1, 60)
    assert hand.ended_at == pytest.approx(0.06)


def test_a_device_leads_nothing_after_the_end(hand):
    before = led_by(hand, 50, lambda k: pose(y=k * 1e-4))
    hand.end()
    after = led_by(hand, 50, lambda k: pose(y=5e-3 + k * 1e-4), 50)
    assert (after == before[-1]).all() and not hand.is_engaged


def test_the_state_has_the_pose_of_the_blade_and_the_wrench_about_its_tip(at_start):
    simulation, _ = at_start
    state = device_hand(at_start).answers.remote.state()
    tip, heel, forward = simulation.arm.blade.segment()
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, state.measured_cp.orientation)
    _, along, back = axes.reshape(3, 3).T
    assert state.measured_cp.position.tolist() == tip.tolist()
    assert along == pytest.approx((tip - heel) / np.linalg.norm(tip - heel), abs=1e-9)
    assert -back == pytest.approx(forward, abs=1e-9)
    assert state.measured_cf.point.tolist() == tip.tolist()
