"""What a device feels between two frames, in exact time: continuous, passive, and gone in time."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge import CartesianPose, DeviceLimits, motion_between
from bridge.coupling.coupling import DECAY_AFTER, RAMP, ZERO_AFTER
from bridge.device.exchange import Exchange
from bridge.device.felt_force import (
    DEBT_EXPIRES,
    ENERGY_DEBT,
    LARGEST_PULL,
    PULL_SLACK,
    FeltForce,
)
from tests.bridge.device.simulated_hand import (
    LEVER,
    PERIOD,
    UNTURNED,
    Cut,
    HeldDevice,
    LastForce,
    Wall,
    along,
    report,
)

REST = np.zeros(6)

LARGEST_JUMP = 0.05
"""Largest change of the force from one answer to the next while the hand rests [N], or as a share
of the largest force: what a hand begins to notice."""

ROUNDING = 1e-9
"""Relative."""

MOTIONS = {
    "pressed": lambda t: 0.01,
    "to and fro": lambda t: 0.005 + 0.01 * math.sin(4.0 * math.pi * t),
    "shaken": lambda t: 0.002 + 0.005 * math.sin(16.0 * math.pi * t),
}
"""Where a person holds the device [m]."""

TISSUES = {
    "soft wall": lambda: Wall(100.0, 1600.0),
    "firm wall": lambda: Wall(300.0, 1600.0),
    "cut": lambda: Cut(300.0, 1600.0, 0.8),
}
"""Contacts as stiff as those of `grid2`, and what is behind them."""

SECONDS = 3.0
"""Length of a motion [s]."""

LATE_GAIN = 5e-3
"""Energy beyond the debt that a hand gains while the force fades [J]: the largest force here, 2.5
N, at 0.2 m/s, half of it, for the 20 ms in which it may fade."""


def felt_at_rest(frames, per_frame=3):
    """Return the answers each millisecond to a hand that rests while these forces arrive."""
    felt, found, now = FeltForce(DeviceLimits(), LEVER), [REST], 0.0
    for force, stiffness, y, ahead in frames:
        felt.take(report(now, force, stiffness, y))
        for _ in range(per_frame):
            now += PERIOD
            found.append(felt.driven(along(ahead), REST, now, PERIOD, holds=True))
    return np.array(found)[:, 1]


@settings(max_examples=200, deadline=None)
@given(
    frames=st.lists(
        st.tuples(
            st.floats(-3.0, 3.0),
            st.floats(0.0, 1e5),
            st.floats(-0.05, 0.05),
            st.floats(-0.1, 0.1),
        ),
        max_size=40,
    ),
    per_frame=st.integers(1, 40),
)
def test_whatever_frames_come_the_force_on_a_hand_at_rest_does_not_jump(frames, per_frame):
    forces = felt_at_rest(frames, per_frame)
    largest = max(1.0, np.abs(forces).max())
    assert np.abs(np.diff(forces)).max(initial=0.0) <= LARGEST_JUMP * largest * (1.0 + ROUNDING)


@pytest.mark.parametrize("factor", [1.0, 0.3, 0.1])
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("tissue", TISSUES)
def test_a_hand_gains_no_more_energy_than_is_said(tissue, motion, factor):
    held = HeldDevice(TISSUES[tissue](), factor).follow(MOTIONS[motion], SECONDS)
    assert held.most_got <= ENERGY_DEBT + DEBT_EXPIRES * SECONDS + LATE_GAIN


def test_the_last_force_as_it_is_would_shake_the_hand():
    """Otherwise the test above could not fail."""
    late, held = (
        HeldDevice(TISSUES["firm wall"](), 0.1, felt).follow(MOTIONS["shaken"], SECONDS)
        for felt in (LastForce(), None)
    )
    assert late.most_got > 10.0 * held.most_got
    assert np.abs(np.diff(late.forces)).max() > 5.0 * np.abs(np.diff(held.forces)).max()


@pytest.mark.parametrize("factor", [1.0, 0.3, 0.1])
@pytest.mark.parametrize("tissue", TISSUES)
def test_a_hand_that_presses_and_rests_comes_to_rest(tissue, factor):
    held = HeldDevice(TISSUES[tissue](), factor).follow(MOTIONS["pressed"], SECONDS)
    assert np.ptp(held.places[-500:]) < 1e-4


@pytest.mark.parametrize("factor", [1.0, 0.3, 0.1])
def test_between_frames_a_wall_is_felt_where_the_stylus_is(factor):
    """The blade is some milliseconds behind; the force is that of the stylus."""
    k, speed = 100.0, 0.02
    held = HeldDevice(Wall(k, 1600.0), factor, mass=1e3, grip=(0.0, 0.0))
    held.v = speed
    held.follow(lambda t: 0.0, 0.5)
    found, expected = np.array(held.forces[-300:]), -k * np.array(held.places[-300:])
    lag = speed * (0.004 + 1e-3 / factor)
    assert np.abs(found - expected).max() < 0.3 * k * lag


def test_without_frames_the_force_stays_then_fades_and_is_gone_in_half_a_second():
    felt = FeltForce(DeviceLimits(), LEVER)
    felt.take(report(0.0, -1.0))
    for k in range(1, 200):
        felt.take(report(k * PERIOD, -1.0))
        force = felt.driven(REST, REST, k * PERIOD, PERIOD, holds=True)[1]
    last, forces = 199, []
    assert force == -1.0 and last * PERIOD > RAMP
    for k in range(last + 1, last + 700):
        forces.append(felt.driven(REST, REST, k * PERIOD, PERIOD, holds=True)[1])
    silent = (np.arange(last + 1, last + 700) - last) * PERIOD
    forces = np.array(forces)
    assert (forces[silent < DECAY_AFTER] == -1.0).all()
    assert (np.diff(forces) >= 0.0).all() and np.diff(forces).max() < 0.01
    assert (forces[silent > ZERO_AFTER + PERIOD] == 0.0).all()


def test_a_device_that_takes_hold_in_tissue_feels_the_force_rise_from_zero():
    felt = FeltForce(DeviceLimits(), LEVER)
    felt.take(report(0.0, -1.0))
    assert felt.passive(0.0)[1] == -1.0, "as measured, while none drives"
    felt.begin()
    forces = []
    for k in range(1, 150):
        felt.take(report(k * PERIOD, -1.0))
        forces.append(felt.driven(REST, REST, k * PERIOD, PERIOD, holds=True)[1])
    assert forces[0] == pytest.approx(-PERIOD / RAMP)
    assert (np.diff(forces) <= 0.0).all() and forces[-1] == -1.0


def test_stylus_and_blade_that_part_pull_weakly_at_each_other():
    felt = FeltForce(DeviceLimits(), LEVER)
    felt.take(report(0.0, 0.0))
    forces, step = [], 1e-4  # 100 mm/s
    for k in range(1, 1000):
        felt.take(report(k * PERIOD, 0.0))
        ahead = along(k * step)
        forces.append(felt.driven(ahead, along(step), k * PERIOD, PERIOD, holds=True)[1])
    ways = step * np.arange(1, 1000)
    assert np.abs(np.array(forces)[ways <= PULL_SLACK]).max() == 0.0
    assert forces[-1] == pytest.approx(-LARGEST_PULL)
    assert np.abs(np.diff(forces)).max() < LARGEST_JUMP


def test_no_wrench_is_larger_than_the_limits():
    felt = FeltForce(DeviceLimits(force=0.5), LEVER)
    felt.take(report(0.0, -3.0))
    for k in range(1, 200):
        felt.take(report(k * PERIOD, -3.0))
        force = felt.driven(REST, REST, k * PERIOD, PERIOD, holds=True)[1]
        assert abs(force) <= 0.5
    assert force == pytest.approx(-0.5)


unit_quaternions = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(
    lambda q: np.linalg.norm(q) > 0.1
)


@given(before=unit_quaternions, after=unit_quaternions)
def test_the_turn_between_two_poses_is_that_of_mujoco(before, after):
    before, after = (np.array(q) / np.linalg.norm(q) for q in (before, after))
    turn = motion_between(CartesianPose(REST[:3], before), CartesianPose(REST[:3], after))[3:]
    turned, spin = before.copy(), np.empty(3)
    mujoco.mju_rotVecQuat(spin, turn, before * [1.0, -1.0, -1.0, -1.0])
    mujoco.mju_quatIntegrate(turned, spin, 1.0)
    assert abs(turned @ after) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(turn) <= math.pi + ROUNDING


def test_a_record_that_is_half_written_does_not_count():
    exchange = Exchange()
    assert exchange.report is None
    exchange.report = report(1.0, -0.5, 200.0, 0.01)
    assert exchange.report.stamp == 1.0 and exchange.report.stiffness[1, 1] == 200.0
    memory = exchange._reports._memory
    kept = bytes(memory)
    exchange.report = report(2.0, -0.7)
    half = len(kept) // 2
    memory[half:] = kept[half:]
    assert exchange.report.stamp == 1.0, "the last one that was whole"
    exchange.report = report(3.0, -0.9)
    assert exchange.report.wrench[1] == -0.9
    assert exchange.command.hold == 0 and exchange.command.stylus.orientation.tolist() == list(
        UNTURNED
    )
    exchange.close()
