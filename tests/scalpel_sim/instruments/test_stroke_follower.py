"""A hand that one kernel leads along a stroke, against the same by MuJoCo's functions."""

from bisect import bisect_right

import mujoco
import numpy as np
import pytest

from bridge import TissueFrame
from scalpel_sim.arm.arm import Arm
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment

DT = 1e-3
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def naive_pose(stroke, t):
    """Return the pose of `stroke` at time `t` [s]."""
    times = stroke.times.tolist()
    t = min(max(t, 0.0), times[-1])
    i = min(bisect_right(times, t) - 1, len(times) - 2)
    s = (t - times[i]) / (times[i + 1] - times[i])
    quaternion, spin, middle, move = np.split(stroke.path[i, 3:], [4, 7, 10])
    turned, axes = quaternion.copy(), np.empty(9)
    mujoco.mju_quatIntegrate(turned, spin, s)
    mujoco.mju_quat2Mat(axes, turned)
    _, edge, back = axes.reshape(3, 3).T
    half, centre = 0.5 * stroke.blade_length * edge, middle + s * move
    return BladeSegment(centre + half, centre - half, -back)


def naive_command(before, pose, leads):
    """Return position, quaternion and control of a hand that moves from its last two of them."""
    axes, wanted, moving, turning = np.empty(9), np.empty(4), np.empty(3), np.empty(3)
    edge = pose.tip - pose.heel
    edge = edge / np.sqrt(edge[0] * edge[0] + edge[1] * edge[1] + edge[2] * edge[2])
    fx, fy, fz = pose.forward
    back = (fx * edge[0] + fy * edge[1] + fz * edge[2]) * edge - pose.forward
    back = back / np.sqrt(back[0] * back[0] + back[1] * back[1] + back[2] * back[2])
    axes.reshape(3, 3)[:] = np.stack([np.cross(edge, back), edge, back], axis=1)
    mujoco.mju_mat2Quat(wanted, axes)
    position, quaternion = before
    middle, inverse = (pose.tip + pose.heel) / 2.0, np.empty(4)
    mujoco.mju_negQuat(inverse, wanted)
    mujoco.mju_rotVecQuat(moving, (middle - position) * leads[0], inverse)
    mujoco.mju_subQuat(turning, wanted, quaternion)
    return middle, wanted, np.concatenate([moving, turning * leads[1]])


def random_stroke(seed):
    """Return a stroke that turns and rests, slowly enough for a blade."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.02, 0.2, 8))
    poses, middle = [], np.array([0.0, 0.15, 0.1])
    edge, forward = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
    for i in range(8):
        if i != 3:
            middle = middle + 2e-3 * rng.normal(size=3)
            edge = edge + 0.1 * rng.normal(size=3)
            edge /= np.linalg.norm(edge)
            forward = forward + 0.1 * rng.normal(size=3)
        poses.append(BladeSegment(middle + 0.02 * edge, middle - 0.02 * edge, forward))
    return Stroke(times, poses)


def led(stroke, frame, t):
    """Yield the hand's command at each time, by the follower."""
    hand = Arm("premium").hand
    hand.hold(frame.segment_to_world(stroke.pose(0.0)))
    follower = StrokeFollower(hand, stroke, frame)
    for now in t:
        follower.lead(now)
        yield tuple(part.copy() for part in hand.command)


@pytest.mark.parametrize("seed", range(4))
def test_the_pose_of_a_stroke_is_the_one_of_mujoco_s_functions(seed):
    stroke = random_stroke(seed)
    for t in (*np.arange(-0.01, stroke.duration + 0.01, DT), *stroke.times):
        for found, expected in zip(stroke.pose(t), naive_pose(stroke, float(t)), strict=True):
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-16)


@pytest.mark.parametrize("seed", range(4))
def test_a_follower_leads_as_the_hand_follows_each_pose(seed):
    """Bit for bit: no arithmetic differs."""
    stroke, frame = random_stroke(seed), TissueFrame(origin=np.array([0.01, 0.02, 0.03]))
    times = np.arange(0.0, stroke.duration + 0.05, DT).tolist()
    hand = Arm("premium").hand
    hand.hold(frame.segment_to_world(stroke.pose(0.0)))
    for t, command in zip(times, led(stroke, frame, times), strict=True):
        position, quaternion, _, leads = (part.copy() for part in hand.command)
        pose = frame.segment_to_world(stroke.pose(t))
        hand.follow(pose)
        for found, expected in zip(command, hand.command, strict=True):
            assert found.tobytes() == expected.tobytes()
        expected = naive_command((position, quaternion), pose, leads)
        for found, wanted in zip(command[:3], expected, strict=True):
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-13)


def test_a_turned_tissue_leads_the_hand_to_the_turned_pose():
    stroke, frame = random_stroke(0), TissueFrame(QUARTER, np.array([0.3, 0.0, 0.0]))
    times = np.arange(0.0, stroke.duration, DT).tolist()
    for t, command in zip(times, led(stroke, frame, times), strict=True):
        pose = frame.segment_to_world(stroke.pose(t))
        np.testing.assert_allclose(command[0], (pose.tip + pose.heel) / 2.0, atol=1e-15)


def test_a_hand_refuses_a_pose_that_is_not_finite_and_stays_where_it_is():
    hand = Arm("premium").hand
    before = tuple(part.copy() for part in hand.command)
    beyond = BladeSegment(np.array([np.nan, 0.0, 0.0]), np.ones(3), np.array([0.0, 0.0, 1.0]))
    for pose in (beyond, beyond._replace(tip=np.ones(3))):
        with pytest.raises(ValueError, match="not finite"):
            hand.follow(pose)
    for was, now in zip(before, hand.command, strict=True):
        assert was.tobytes() == now.tobytes()
