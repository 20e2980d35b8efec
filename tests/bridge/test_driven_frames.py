"""Frames that the arm's side drives, over the link in this process."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import Bridge, InProcessLink, VirtualCoupling
from bridge.driven import FrameAttachment, FramePose, mean_wrench, plain_region
from tests.bridge.bits import bits
from tissue import BladeSegment, BladeSweep, Material, Tissue, Wrench, block, fixed_nodes

DT = 1e-3
CUBE = block((2, 2, 2), (0.02, 0.02, 0.02))
GEL = Material(law="neo_hookean", young_modulus=20e3, viscous_damping=40.0)
FAR = BladeSegment(np.array([1.0, 0, 0]), np.array([1.0, 0, 0.03]), np.array([0.0, 1.0, 0.0]))


def cube():
    return Tissue(CUBE, GEL, fixed=fixed_nodes(CUBE, "bottom"), gravity=(0.0, 0.0, 0.0))


def pose(i):
    """A frame that goes up and turns."""
    turned = Rotation.from_rotvec([0.0, 0.0, 1e-3 * i]).as_matrix()
    return FramePose(np.array([0.01, 0.01, 0.02 + 2e-5 * i]), turned)


def test_frames_of_the_tissue_s_own_come_first_and_take_no_poses():
    tissue = cube()
    own = tissue.attach([[0.0, 0.0, 0.02]], stiffness=10.0)
    link = InProcessLink(tissue)
    assert link.attach(FrameAttachment(np.array([[0.02, 0.02, 0.02]]), 10.0)) == 1
    link.step(None, DT, [FramePose(np.array([0.02, 0.02, 0.03]), np.eye(3))])
    assert [load.n_points for load in link.loads()] == [1, 1]
    assert link.loads()[1].wrench.force[2] < 0.0
    assert bits(tuple(link.loads()[0].wrench)) == bits(tuple(own.wrench))


def test_a_released_frame_keeps_its_number_and_feels_nothing():
    link = InProcessLink(cube())
    for _ in range(2):
        link.attach(FrameAttachment("top", 100.0))
    link.step(None, DT, [pose(100)] * 2)
    link.release(0)
    link.release(0)
    link.step(None, DT, [pose(100)] * 2)
    first, second = link.loads()
    assert first.n_points == 0 and not first.wrench.force.any()
    assert second.n_points == 9 and second.wrench.force.any()


@pytest.mark.parametrize("n", [0, 2])
def test_a_wrong_number_of_frames_is_refused(n):
    link = InProcessLink(cube())
    link.attach(FrameAttachment("top", 100.0))
    with pytest.raises(ValueError, match=f"poses of {n} frames, and 1 are driven"):
        link.step(None, DT, [pose(0)] * n)


def test_a_bridge_s_grip_has_the_face_of_an_attachment():
    tissue, beside = cube(), cube()
    bridge = Bridge(tissue)
    grip = bridge.attach("top", stiffness=200.0, damping=2.0)
    attachment = beside.attach("top", stiffness=200.0, damping=2.0)
    assert bits(tuple(grip.wrench)) == bits(tuple(attachment.wrench))
    for i in range(1, 20):
        for each in (grip, attachment):
            each.move(*pose(i))
        bridge.step(FAR, DT)
        beside.step(None, DT)
        assert bits(tuple(grip.wrench)) == bits(tuple(attachment.wrench))
    assert [load.n_points for load in bridge.frame_loads] == [9]
    bridge.release(grip)
    assert grip.n_points == 0 and not grip.wrench.force.any()
    with pytest.raises(ValueError, match="not one of this bridge"):
        bridge.release(Bridge(cube()).attach("top", stiffness=1.0))


FIBRES = {"stiffness": 200.0, "area": 2e-6, "toughness": 200.0, "damping": 1.0}


def across(y):
    """An edge along x, above the cube, that faces along y."""
    return BladeSegment(np.array([-0.02, y, 0.035]), np.array([0.04, y, 0.035]), np.eye(3)[1])


def test_a_bridge_s_tie_is_a_ligament_that_the_blade_cuts():
    tissue, beside = cube(), cube()
    bridge = Bridge(tissue)
    above, where = (0.01, 0.01, 0.05), "sphere:0.01,0.01,0.02,0.011"
    grip = bridge.tie(where, above, **FIBRES)
    ligament = beside.tie(where, above, **FIBRES)
    assert grip.n_points == ligament.n_points == 6
    before = across(-0.01)
    for y in np.arange(-0.01, 0.05, 5e-4):
        bridge.step(across(y), DT)
        beside.step(BladeSweep(before, before := across(y)), DT)
        assert bits(tuple(grip.wrench)) == bits(tuple(ligament.wrench))
    assert grip.n_points == ligament.n_points < 6
    bridge.release(grip)
    assert grip.n_points == 0


def test_fibres_that_end_at_places_of_their_own_are_moved_by_their_frame():
    """Two that hang down from a frame, which goes up: both pull up once they are taut."""
    bridge = Bridge(cube())
    corners = [[0.0, 0.0, 0.02], [0.02, 0.02, 0.02]]
    ends = np.add(corners, [0.0, 0.0, 0.03])
    grip = bridge.tie(corners, ends, rest_length=0.031, **FIBRES)
    for i in range(60):
        if i == 20:
            assert not grip.wrench.force.any()
        if i > 20:
            grip.move(grip.pose.origin + np.array([0.0, 0.0, 1e-4]))
        bridge.step(FAR, DT)
    assert grip.n_points == 2 and grip.wrench.force[2] < -0.1


@pytest.mark.parametrize("changes", [{"tissue_every": 4}, {"coupling": VirtualCoupling()}])
def test_where_the_tissue_is_queried_seldom_the_frames_go_as_they_were_driven(changes):
    """One that is attached in the middle of a period is at rest up to there."""
    tissue = cube()
    bridge = Bridge(tissue, **changes)
    bridge.step(FAR, DT)
    bridge.step(FAR, DT)
    grip = bridge.attach("top", stiffness=200.0, damping=2.0)
    for i in range(1, 60):
        grip.move(*pose(min(i, 20)))
        bridge.step(FAR, DT)
    held = tissue.snapshot().positions[fixed_nodes(CUBE, "top")].mean(axis=0)
    assert held[2] > 0.02 + 1e-4
    assert grip.wrench.force[2] < -0.01


@pytest.mark.parametrize(
    ("origin", "axes", "expected"),
    [
        ([0.0, np.nan, 0.0], None, "origin of a frame is not finite"),
        ([0.0, 0.0, 0.0], 2.0 * np.eye(3), "rotation of a frame is not orthonormal"),
        ([0.0, 0.0, 0.0], -np.eye(3), "a reflection"),
    ],
)
def test_a_pose_that_is_none_is_refused_before_the_tissue_moves(origin, axes, expected):
    grip = Bridge(cube()).attach("top", stiffness=1.0)
    with pytest.raises(ValueError, match=expected):
        grip.move(origin, axes)


def test_a_mask_is_the_list_of_its_nodes():
    assert plain_region("top") == "top"
    assert plain_region(np.array([True, False, True])).tolist() == [0, 2]
    assert plain_region(np.array([3, 1])).tolist() == [3, 1]
    assert plain_region([0.1, 0.2, 0.3]).tolist() == [[0.1, 0.2, 0.3]]


def test_a_mean_wrench_is_that_of_the_impulses():
    """1 N for 1 s at a lever of 1 m, and nothing for 3 s: 0.25 N, 0.25 N m."""
    x, y, z = np.eye(3)
    wrenches = [Wrench(y, 0.0 * z, x), Wrench(0.0 * y, 0.0 * z, 0.0 * x)]
    mean = mean_wrench(wrenches, [1.0, 3.0])
    np.testing.assert_array_equal(mean.force, 0.25 * y)
    np.testing.assert_array_equal(mean.torque, 0.25 * z)
