"""The pose of the blade at an instant, and how its points move in a step."""

import numpy as np
import pytest

from tissue.blade.edge import (
    Edge,
    displacement_of,
    motion_at,
    pose_at,
    sample_displacement,
    sample_point,
)
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel

STILL = Edge(*(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.02), Vec3(0.0, 1.0, 0.4)) * 2)
TURNING = Edge(
    Vec3(0.0, 0.0, 0.0),
    Vec3(0.0, 0.0, 0.02),
    Vec3(0.0, 1.0, 0.0),
    Vec3(0.001, 0.002, 0.0),
    Vec3(0.001, 0.004, 0.0199),
    Vec3(0.1, 1.0, 0.0),
)
"""An edge that moves and turns in one step."""


def test_the_axes_of_the_blade_are_orthonormal_and_the_edge_is_one_of_them():
    pose = pose_at(STILL, 0.5)
    axes = np.array([pose.along, pose.forward, pose.normal])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(pose.along, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(pose.forward, [0.0, 1.0, 0.0])
    assert pose.length == pytest.approx(0.02)


def test_a_sample_moves_from_its_position_in_the_first_pose_to_that_in_the_last():
    before, after = (sample_point(pose_at(TURNING, when), 3, 5) for when in (0.0, 1.0))
    moved = sample_displacement(TURNING, 3, 5)
    np.testing.assert_allclose(moved, np.subtract(after, before), atol=1e-17)


@pytest.mark.parametrize("when", [0.0, 0.5, 1.0])
def test_a_point_fixed_to_the_blade_moves_as_its_constant_coordinates_say(when):
    motion, at = motion_at(TURNING, when), np.array([0.015, -0.004, 0.0005])

    def place(pose):
        return np.array(pose.tip) + at @ np.array([pose.along, pose.forward, pose.normal])

    moved = displacement_of(motion, Vec3(*place(motion.pose).tolist()))
    expected = place(pose_at(TURNING, 1.0)) - place(pose_at(TURNING, 0.0))
    np.testing.assert_allclose(moved, expected, atol=1e-16)
