"""What the arm did not feel of an impulse on the tissue is given back."""

import numpy as np
import pytest

from bridge.coupling.impulse import ImpulseDebt
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


def period(debt, felt, pose=UPRIGHT):
    """Feel this for a period, and what is given back; return the force in each frame."""
    forces = []
    for _ in range(10):
        back = debt.back(felt, pose, DT)
        debt.felt(felt, pose, DT)
        forces.append((felt + back)[1])
    return forces


def after_a_period(felt, done, pose=UPRIGHT):
    """A debt after a period in which the arm felt one wrench and the tissue another."""
    debt = ImpulseDebt()
    period(debt, felt, pose)
    debt.asked()
    debt.answered(on(pose, done), PERIOD, in_contact=True)
    return debt


def test_nothing_is_owed_where_both_felt_the_same():
    debt = after_a_period(PUSH, PUSH)
    assert debt.owed == pytest.approx(np.zeros(6), abs=1e-15)
    assert period(debt, PUSH) == pytest.approx([-1.0] * 10)


def test_what_is_missing_is_given_back_over_a_period_and_no_longer():
    debt = after_a_period(0.8 * PUSH, PUSH)
    assert debt.owed == pytest.approx(0.2 * PERIOD * PUSH)
    assert period(debt, PUSH) == pytest.approx([-1.2] * 10)
    assert debt.owed == pytest.approx(np.zeros(6), abs=1e-15)
    assert period(debt, PUSH) == pytest.approx([-1.0] * 10)


def test_what_was_too_much_is_taken_back():
    assert period(after_a_period(1.3 * PUSH, PUSH), PUSH) == pytest.approx([-0.7] * 10)


def test_torques_are_owed_about_a_fixed_point():
    """The blade is elsewhere when it is given back, and the impulse is on the same line."""
    force = np.array([1.0, 0.0, 0.0, 0.0, 0.02, 0.0])
    debt = after_a_period(np.zeros(6), force, at(0.1))
    assert debt.owed == pytest.approx(PERIOD * np.array([1.0, 0.0, 0.0, 0.0, 0.02, -0.1]))
    back = debt.back(10.0 * force, at(0.3), DT)
    assert back == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.02, 0.2])


def test_no_more_is_given_back_than_the_tissue_pushes_with():
    debt = after_a_period(np.zeros(6), 30.0 * PUSH)
    assert max(np.abs(period(debt, PUSH))) <= 2.0
    assert debt.owed[1] == pytest.approx(-(30.0 - 1.0) * PERIOD)  # the rest is still owed
    assert not debt.back(np.zeros(6), UPRIGHT, DT).any()


def test_what_is_owed_when_a_contact_ends_is_written_off_and_counted():
    debt = after_a_period(np.zeros(6), PUSH)
    period(debt, np.zeros(6))
    debt.asked()
    debt.answered(on(UPRIGHT, np.zeros(6)), PERIOD, in_contact=False)
    assert not debt.owed.any()
    assert debt.written_off == pytest.approx(PERIOD)


def test_what_is_felt_while_the_tissue_is_being_asked_belongs_to_the_next_period():
    debt = ImpulseDebt()
    period(debt, PUSH)
    debt.asked()
    period(debt, 5.0 * PUSH)
    debt.answered(on(UPRIGHT, PUSH), PERIOD, in_contact=True)
    assert debt.owed == pytest.approx(np.zeros(6), abs=1e-15)
