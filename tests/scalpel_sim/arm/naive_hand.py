"""The hand on its stroke again, slow and obvious, by MuJoCo's functions."""

from bisect import bisect_right

import mujoco
import numpy as np

from tissue import BladeSegment


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
