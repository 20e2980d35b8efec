"""The local model: the wrench between two answers, from the last wrench and the stiffness."""

import numpy as np
import pytest

from bridge.coupling.local_model import ImpulseCompensation, LocalModel
from bridge.poses import moved
from tests.bridge.coupling.walls import Wall
from tissue import BladeSegment, BladeSweep, Wrench

DT = 1e-3
STIFFNESS = 5e3
UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))
BACK = np.array([0.0, -1.0, 0.0])
WALL_AT = np.array([0.0, -1e-3, 0.0])
"""The blade is 1 mm inside."""


def at(y, turn=0.0):
    """Return the blade moved forward [m] and turned about x [rad]."""
    return moved(UPRIGHT, np.array([0.0, y, 0.0, turn, 0.0, 0.0]))


def model_after_two_answers(wall, yielded=0.0):
    """Return a model after two answers of a wall, between which a blade moved in by 0.3 mm.

    By the share `yielded` of that, the wall yielded.
    """
    model = LocalModel()
    update_model(model, wall, at(-0.3e-3))
    update_model(model, wall, at(-0.3e-3 * yielded), UPRIGHT)
    return model


def update_model(model, wall, pose, told_pose=None):
    """Update a model with the answer of a wall for a pose, or as if for the pose `told_pose`."""
    result = wall.step(BladeSweep(pose, pose), DT)
    told_pose = told_pose or pose
    model.update(result, result.wrench._replace(point=told_pose.tip), told_pose)


def answer_of(wall, pose):
    """Return the wrench of the wall on a blade that rests at a pose, shape (6,)."""
    wrench = wall.step(BladeSweep(pose, pose), DT).wrench_t1
    return np.concatenate([wrench.force, wrench.torque])


def test_nothing_is_felt_before_the_first_answer():
    assert not LocalModel().wrench(UPRIGHT).any()
    assert not LocalModel().in_contact


@pytest.mark.parametrize("turn", [0.0, 0.005, -0.005])
@pytest.mark.parametrize("y", [0.0, 5e-4, -5e-4])
def test_between_two_answers_of_a_wall_the_arm_feels_the_wall(y, turn):
    wall = Wall(WALL_AT, BACK, STIFFNESS)
    felt = model_after_two_answers(wall).wrench(at(y, turn))
    wanted = answer_of(wall, at(y, turn))
    # Points of a turned blade move in by the sine of the angle, on a shorter lever.
    assert felt == pytest.approx(wanted, rel=1e-4, abs=1e-4)


def test_tissue_that_yielded_loads_with_the_stiffness_it_showed_and_unloads_with_all():
    wall = Wall(WALL_AT, BACK, STIFFNESS)
    model = model_after_two_answers(wall, yielded=0.75)
    now = model.wrench(UPRIGHT)[1]
    assert model.wrench(at(4e-4))[1] == pytest.approx(now - 0.25 * STIFFNESS * 4e-4)
    assert model.wrench(at(-4e-4))[1] == pytest.approx(now + STIFFNESS * 4e-4)


def test_a_new_contact_loads_without_stiffness_and_unloads_with_all():
    wall, model = Wall(WALL_AT, BACK, STIFFNESS), LocalModel()
    update_model(model, wall, UPRIGHT)
    now = model.wrench(UPRIGHT)[1]
    assert model.wrench(at(4e-4))[1] == now
    assert model.wrench(at(-4e-4))[1] == pytest.approx(now + STIFFNESS * 4e-4)


def test_a_blade_at_rest_does_not_change_the_share_of_stiffness():
    wall = Wall(WALL_AT, BACK, STIFFNESS)
    model = model_after_two_answers(wall)
    trembling = at(1e-8)
    update_model(model, wall, UPRIGHT, trembling)
    now = model.wrench(trembling)[1]
    assert model.wrench(at(4e-4))[1] == pytest.approx(now - STIFFNESS * 4e-4, rel=1e-4)


def test_the_wrench_of_a_tissue_that_reports_no_stiffness_is_held():
    model = model_after_two_answers(Wall(WALL_AT, BACK, STIFFNESS, reported=0.0))
    assert model.wrench(at(5e-4))[1] == model.wrench(UPRIGHT)[1]


def test_a_blade_that_leaves_a_wall_is_not_pulled():
    model = model_after_two_answers(Wall(WALL_AT, BACK, STIFFNESS))
    assert model.wrench(at(-0.9e-3))[1] < 0.0
    assert model.stiffness.any()
    assert not model.wrench(at(-1.1e-3)).any()
    assert not model.stiffness.any()


def wrench_on(pose):
    """Return the mean wrench of the wall over a frame in which the blade rests at a pose."""
    return Wall(WALL_AT, BACK, STIFFNESS).step(BladeSweep(pose, pose), DT).wrench


def test_a_blade_that_is_held_from_both_sides_is_pulled_back():
    """In a slit both lips press: a displacement away from one is a displacement into the other."""
    result = Wall(WALL_AT, BACK, STIFFNESS).step(BladeSweep(UPRIGHT, UPRIGHT), DT)
    normals = result.contacts.normal.copy()
    normals[0] = -normals[0]
    model = LocalModel()
    in_slit = result._replace(contacts=result.contacts._replace(normal=normals))
    for y in (-0.3e-3, 0.0):  # the share of the stiffness follows from two answers
        push = wrench_on(at(y))
        model.update(in_slit, push, at(y))
    assert model.wrench(at(-2e-3))[1] > 0.0


PERIOD = 10 * DT
PUSH = np.array([0.0, -1.0, 0.0, 0.02, 0.0, 0.0])
"""Wrench of 1 N at the middle of the edge, about the tip."""


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


@pytest.mark.parametrize("share", [1.0, 0.8, 1.3], ids=["the same", "too little", "too much"])
def test_what_the_arm_felt_too_little_or_too_much_is_returned_over_one_period(share):
    compensation = after_a_period(share * PUSH, PUSH)
    assert compensation.missing == pytest.approx((1.0 - share) * PERIOD * PUSH, abs=1e-15)
    assert feel_for_a_period(compensation, PUSH) == pytest.approx([share - 2.0] * 10)
    assert compensation.missing == pytest.approx(np.zeros(6), abs=1e-15)
    assert feel_for_a_period(compensation, PUSH) == pytest.approx([-1.0] * 10)


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
