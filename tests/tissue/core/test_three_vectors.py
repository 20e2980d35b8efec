"""Values of three vectors."""

import numpy as np
import pytest

from tissue import Wrench


def test_a_wrench_about_another_point_does_the_same_work_on_any_motion():
    random = np.random.default_rng(3)
    force, torque, point, other, velocity, turning = random.normal(size=(6, 3))
    there = Wrench(force, torque, point).about(other)
    power = force @ (velocity + np.cross(turning, point)) + torque @ turning
    assert there.point == pytest.approx(other)
    assert there.force @ (velocity + np.cross(turning, other)) + there.torque @ turning == (
        pytest.approx(power)
    )


def test_a_force_that_passes_a_point_at_a_distance_turns_about_it():
    upwards = Wrench(np.array([0.0, 0.0, 2.0]), np.zeros(3), np.array([0.1, 0.0, 0.0]))
    assert upwards.about(np.zeros(3)).torque.tolist() == [0.0, -0.2, 0.0]
