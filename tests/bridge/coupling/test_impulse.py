"""Impulse compensation: what the arm did not feel of an impulse is returned to it later."""

import numpy as np
import pytest

from bridge.coupling.local_model import ImpulseCompensation
from tissue import BladeSegment, Wrench

DT = 1e-3
PERIOD = 10 * DT
UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))
PUSH = np.array([0.0, -1.0, 0.0, 0.02, 0.0, 0.0])
"""Wrench of 1 N at the middle of the edge, about the tip."""


def at(y):
    shift = np.array([0.0, y, 0.0])
    return UPRIGHT._replace(tip=UPRIGHT.tip + shift, heel=UPRIGHT.heel + shift)


def on(pose, wrench):
    return Wrench(wrench[:3], wrench[3:], pose.tip)


def feel_for_a_period(compensation, felt, pose=UPRIGHT):
    """Let the arm feel a wrench and its correction for a period; return the force in each frame."""
    forces = []
    for _ in range(10):
        correction = compensation.correction(felt, pose, DT)
        compensation.record_felt(felt, pose, DT)
        forces.append((felt + correction)[1])
    return forces


def after_a_period(felt, exerted, pose=UPRIGHT):
    """Return the compensation after a period in which arm and tissue felt different wrenches."""
    compensation = ImpulseCompensation()
    feel_for_a_period(compensation, felt, pose)
    compensation.end_period()
    compensation.compare(on(pose, exerted), PERIOD, in_contact=True)
    return compensation


def test_nothing_is_returned_where_arm_and_tissue_felt_the_same():
    compensation = after_a_period(PUSH, PUSH)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
    assert feel_for_a_period(compensation, PUSH) == pytest.approx([-1.0] * 10)


def test_a_missing_impulse_is_returned_over_one_period():
    compensation = after_a_period(0.8 * PUSH, PUSH)
    assert compensation.missing == pytest.approx(0.2 * PERIOD * PUSH)
    assert feel_for_a_period(compensation, PUSH) == pytest.approx([-1.2] * 10)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
    assert feel_for_a_period(compensation, PUSH) == pytest.approx([-1.0] * 10)


def test_an_excess_of_impulse_is_subtracted():
    assert feel_for_a_period(after_a_period(1.3 * PUSH, PUSH), PUSH) == pytest.approx([-0.7] * 10)


def test_a_missing_angular_impulse_is_about_a_fixed_point():
    """The blade has moved when the impulse is returned, which acts along the same line."""
    force = np.array([1.0, 0.0, 0.0, 0.0, 0.02, 0.0])
    compensation = after_a_period(np.zeros(6), force, at(0.1))
    assert compensation.missing == pytest.approx(
        PERIOD * np.array([1.0, 0.0, 0.0, 0.0, 0.02, -0.1])
    )
    correction = compensation.correction(10.0 * force, at(0.3), DT)
    assert correction == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.02, 0.2])


def test_the_returned_force_is_no_larger_than_that_of_the_tissue():
    compensation = after_a_period(np.zeros(6), 30.0 * PUSH)
    assert max(np.abs(feel_for_a_period(compensation, PUSH))) <= 2.0
    assert compensation.missing[1] == pytest.approx(
        -(30.0 - 1.0) * PERIOD
    )  # the rest is still missing
    assert not compensation.correction(np.zeros(6), UPRIGHT, DT).any()


def test_an_impulse_missing_when_a_contact_ends_is_written_off_and_counted():
    compensation = after_a_period(np.zeros(6), PUSH)
    feel_for_a_period(compensation, np.zeros(6))
    compensation.end_period()
    compensation.compare(on(UPRIGHT, np.zeros(6)), PERIOD, in_contact=False)
    assert not compensation.missing.any()
    assert compensation.written_off == pytest.approx(PERIOD)


def test_what_the_arm_feels_during_a_query_counts_for_the_next_period():
    compensation = ImpulseCompensation()
    feel_for_a_period(compensation, PUSH)
    compensation.end_period()
    feel_for_a_period(compensation, 5.0 * PUSH)
    compensation.compare(on(UPRIGHT, PUSH), PERIOD, in_contact=True)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
