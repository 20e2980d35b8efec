"""What is felt between two answers of a tissue: its wrench, and its stiffness there."""

import numpy as np
import pytest

from bridge.coupling.local_model import LocalModel
from bridge.poses import moved
from tests.bridge.coupling.walls import Wall
from tissue import BladeSegment, BladeSweep

DT = 1e-3
STIFFNESS = 5e3
UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))
BACK = np.array([0.0, -1.0, 0.0])
WALL_AT = np.array([0.0, -1e-3, 0.0])
"""The blade is 1 mm inside."""


def at(y, turn=0.0):
    """The blade, moved forward and turned about x."""
    return moved(UPRIGHT, np.array([0.0, y, 0.0, turn, 0.0, 0.0]))


def answered(wall, gave_way=0.0):
    """A model of a wall on which a blade has pressed on by 0.3 mm between its last two answers.

    By a share `gave_way` of that the wall was pressed in less.
    """
    model = LocalModel()
    answers(model, wall, at(-0.3e-3))
    answers(model, wall, at(-0.3e-3 * gave_way), UPRIGHT)
    return model


def answers(model, wall, pose, told=None):
    """The wall answers for a blade at a pose; to a model that was told of another."""
    result = wall.step(BladeSweep(pose, pose), DT)
    told = told or pose
    model.update(result, result.wrench._replace(point=told.tip), told)


def answer_of(wall, pose):
    """What the wall does to a blade that is here."""
    wrench = wall.step(BladeSweep(pose, pose), DT).wrench_t1
    return np.concatenate([wrench.force, wrench.torque])


def test_nothing_is_felt_before_the_first_answer():
    assert not LocalModel().wrench(UPRIGHT).any()
    assert not LocalModel().in_contact


@pytest.mark.parametrize("turn", [0.0, 0.005, -0.005])
@pytest.mark.parametrize("y", [0.0, 5e-4, -5e-4])
def test_between_two_answers_of_a_wall_the_arm_feels_the_wall(y, turn):
    wall = Wall(WALL_AT, BACK, STIFFNESS)
    felt = answered(wall).wrench(at(y, turn))
    wanted = answer_of(wall, at(y, turn))
    # Turned points are pressed in by a sine of the angle, and stand on a shorter lever.
    assert felt == pytest.approx(wanted, rel=1e-4, abs=1e-4)


def test_tissue_that_gave_way_is_pressed_with_the_share_that_it_showed_and_left_with_all():
    wall = Wall(WALL_AT, BACK, STIFFNESS)
    model = answered(wall, gave_way=0.75)
    now = model.wrench(UPRIGHT)[1]
    assert model.wrench(at(4e-4))[1] == pytest.approx(now - 0.25 * STIFFNESS * 4e-4)
    assert model.wrench(at(-4e-4))[1] == pytest.approx(now + STIFFNESS * 4e-4)


def test_a_new_contact_is_pressed_with_nothing_and_left_with_all():
    wall, model = Wall(WALL_AT, BACK, STIFFNESS), LocalModel()
    answers(model, wall, UPRIGHT)
    now = model.wrench(UPRIGHT)[1]
    assert model.wrench(at(4e-4))[1] == now
    assert model.wrench(at(-4e-4))[1] == pytest.approx(now + STIFFNESS * 4e-4)


def test_a_blade_at_rest_teaches_nothing():
    wall = Wall(WALL_AT, BACK, STIFFNESS)
    model = answered(wall)
    trembling = at(1e-8)
    answers(model, wall, UPRIGHT, trembling)
    now = model.wrench(trembling)[1]
    assert model.wrench(at(4e-4))[1] == pytest.approx(now - STIFFNESS * 4e-4, rel=1e-4)


def test_a_tissue_that_tells_no_stiffness_is_held():
    model = answered(Wall(WALL_AT, BACK, STIFFNESS, told=0.0))
    assert model.wrench(at(5e-4))[1] == model.wrench(UPRIGHT)[1]


def test_a_wall_is_left_and_does_not_pull():
    model = answered(Wall(WALL_AT, BACK, STIFFNESS))
    assert model.wrench(at(-0.9e-3))[1] < 0.0
    assert model.stiffness.any()
    assert not model.wrench(at(-1.1e-3)).any()
    assert not model.stiffness.any()


def wrench_on(pose):
    """That of the wall on the mean over a frame in which the blade rests here."""
    return Wall(WALL_AT, BACK, STIFFNESS).step(BladeSweep(pose, pose), DT).wrench


def test_a_blade_that_is_held_from_both_sides_is_pulled_back():
    """In a slit: the lips press, and the way out to one side is the way into the other."""
    result = Wall(WALL_AT, BACK, STIFFNESS).step(BladeSweep(UPRIGHT, UPRIGHT), DT)
    both = result.contacts.normal.copy()
    both[0] = -both[0]
    model = LocalModel()
    both_ways = result._replace(contacts=result.contacts._replace(normal=both))
    for y in (-0.3e-3, 0.0):  # the share of the stiffness is learnt from two answers
        push = wrench_on(at(y))
        model.update(both_ways, push, at(y))
    assert model.wrench(at(-2e-3))[1] > 0.0
