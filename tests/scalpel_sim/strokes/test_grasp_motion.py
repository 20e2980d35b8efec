"""The motion of a grasper: where it is between its waypoints, and which it cannot do."""

import numpy as np
import pytest

from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint, least_jerk

DOWN, X, Y = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
START = Waypoint(0.5, (0.0, 0.0, 0.1), DOWN, X, 0.02)


def pinch(stroke, t):
    """Where the middle between the pads is: half way between the ends of the edge."""
    pose = stroke.pose(t)
    return 0.5 * (pose.tip + pose.heel)


def test_least_jerk_begins_and_ends_without_speed_and_acceleration():
    s, h = np.array([0.0, 1.0]), 1e-4
    assert [least_jerk(x) for x in (0.0, 0.5, 1.0)] == [0.0, 0.5, 1.0]
    inwards = s + h * np.array([1.0, -1.0])
    assert np.abs([least_jerk(x) for x in inwards] - s).max() < 20.0 * h**3


def test_least_jerk_is_the_polynomial_of_least_jerk():
    """Its sixth derivative is zero (Euler and Lagrange), and no other quintic has these ends."""
    s = np.linspace(0.0, 1.0, 7)
    fitted = np.polynomial.Polynomial.fit(s, [least_jerk(x) for x in s], 6).convert()
    assert fitted.coef == pytest.approx([0.0, 0.0, 0.0, 10.0, -15.0, 6.0, 0.0], abs=1e-9)


def test_it_waits_for_the_first_row_and_stays_after_the_last():
    motion = GraspMotion([START, START._replace(time=1.5, at=(0.0, 0.0, 0.0), opening=0.0)])
    stroke = motion.stroke(0.01, 0.01)
    for t in (0.0, 0.25, 0.5):
        assert pinch(stroke, t) == pytest.approx((0.0, 0.0, 0.1))
        assert motion.opening(t) == 0.02
    assert pinch(stroke, 1.0) == pytest.approx((0.0, 0.0, 0.05))
    assert motion.opening(1.0) == pytest.approx(0.01)
    assert pinch(stroke, 9.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert motion.opening(9.0) == 0.0 and motion.duration == 1.5


def test_the_edge_lies_along_the_shaft_and_forward_is_across_the_way_of_the_jaws():
    pose = GraspMotion([START]).stroke(0.07, 0.01).pose(0.0)
    assert pose.tip == pytest.approx((0.0, 0.0, 0.09))
    assert pose.heel == pytest.approx((0.0, 0.0, 0.17))
    assert pose.forward == pytest.approx(np.cross(DOWN, X))


def test_it_turns_about_one_axis_and_a_slanted_across_is_straightened():
    turned = START._replace(time=1.5, approach=Y, across=(1.0, 0.5, 0.0))
    stroke = GraspMotion([START, turned]).stroke(0.01, 0.01)
    along = stroke.pose(1.0).tip - stroke.pose(1.0).heel
    assert along / 0.02 == pytest.approx((0.0, np.sqrt(0.5), -np.sqrt(0.5)), abs=1e-6)
    assert stroke.pose(1.5).forward == pytest.approx(np.cross(Y, X), abs=1e-9)
