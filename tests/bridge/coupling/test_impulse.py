"""What the arm did not feel of an impulse on the tissue is given back."""

import numpy as np
import pytest

from bridge.coupling.impulse import ImpulseCompensation
from tissue import BladeSegment, Wrench

DT = 1e-3
PERIOD = 10 * DT
UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))
PUSH = np.array([0.0, -1.0, 0.0, 0.02, 0.0, 0.0])
"""1 N at the middle of the edge."""


def at(y):
    way = np.array([0.0, y, 0.0])
    return UPRIGHT._replace(tip=UPRIGHT.tip + way, heel=UPRIGHT.heel + way)


def on(pose, wrench):
    return Wrench(wrench[:3], wrench[3:], pose.tip)


def period(compensation, felt, pose=UPRIGHT):
    """Feel this for a period, and what is given back; return the force in each frame."""
    forces = []
    for _ in range(10):
        back = compensation.correction(felt, pose, DT)
        compensation.record_felt(felt, pose, DT)
        forces.append((felt + back)[1])
    return forces


def after_a_period(felt, done, pose=UPRIGHT):
    """A debt after a period in which the arm felt one wrench and the tissue another."""
    compensation = ImpulseCompensation()
    period(compensation, felt, pose)
    compensation.end_period()
    compensation.compare(on(pose, done), PERIOD, in_contact=True)
    return compensation


def test_nothing_is_owed_where_both_felt_the_same():
    compensation = after_a_period(PUSH, PUSH)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
    assert period(compensation, PUSH) == pytest.approx([-1.0] * 10)


def test_what_is_missing_is_given_back_over_a_period_and_no_longer():
    compensation = after_a_period(0.8 * PUSH, PUSH)
    assert compensation.missing == pytest.approx(0.2 * PERIOD * PUSH)
    assert period(compensation, PUSH) == pytest.approx([-1.2] * 10)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
    assert period(compensation, PUSH) == pytest.approx([-1.0] * 10)


def test_what_was_too_much_is_taken_back():
    assert period(after_a_period(1.3 * PUSH, PUSH), PUSH) == pytest.approx([-0.7] * 10)


def test_torques_are_owed_about_a_fixed_point():
    """The blade is elsewhere when it is given back, and the impulse is on the same line."""
    force = np.array([1.0, 0.0, 0.0, 0.0, 0.02, 0.0])
    compensation = after_a_period(np.zeros(6), force, at(0.1))
    assert compensation.missing == pytest.approx(
        PERIOD * np.array([1.0, 0.0, 0.0, 0.0, 0.02, -0.1])
    )
    back = compensation.correction(10.0 * force, at(0.3), DT)
    assert back == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.02, 0.2])


def test_no_more_is_given_back_than_the_tissue_pushes_with():
    compensation = after_a_period(np.zeros(6), 30.0 * PUSH)
    assert max(np.abs(period(compensation, PUSH))) <= 2.0
    assert compensation.missing[1] == pytest.approx(
        -(30.0 - 1.0) * PERIOD
    )  # the rest is still owed
    assert not compensation.correction(np.zeros(6), UPRIGHT, DT).any()


def test_what_is_owed_when_a_contact_ends_is_written_off_and_counted():
    compensation = after_a_period(np.zeros(6), PUSH)
    period(compensation, np.zeros(6))
    compensation.end_period()
    compensation.compare(on(UPRIGHT, np.zeros(6)), PERIOD, in_contact=False)
    assert not compensation.missing.any()
    assert compensation.written_off == pytest.approx(PERIOD)


def test_what_is_felt_while_the_tissue_is_being_asked_belongs_to_the_next_period():
    compensation = ImpulseCompensation()
    period(compensation, PUSH)
    compensation.end_period()
    period(compensation, 5.0 * PUSH)
    compensation.compare(on(UPRIGHT, PUSH), PERIOD, in_contact=True)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
