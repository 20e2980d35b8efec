"""Joint angles of a PHANTOM-like arm from the pose of its blade, in closed form, many at once."""

from typing import NamedTuple

import mujoco
import numpy as np

from tissue import FloatArray

# From the side, in the vertical plane that turns with the waist:
#
#               elbow
#              _/\_
#    upper   _/    \_   forearm
#          _/        \_
#  shoulder            gimbal: yaw about the forearm, pitch, and roll about the stylus,
#     |                |       all through one point
#     |                |  neck
#    base              |  blade, turned by the mount angle about its x


class Geometry(NamedTuple):
    """Lengths and ranges of an arm whose gimbal's three axes meet in one point."""

    shoulder: float
    """Height of the shoulder over the base's underside [m]."""
    upper: float
    """From shoulder to elbow [m]."""
    forearm: float
    """From elbow to the gimbal's centre [m]."""
    neck: float
    """From the gimbal's centre to the blade's body, along the stylus [m]."""
    bend: float
    """Angle by which the forearm hangs from the upper arm where the elbow's angle is 0 [rad]."""
    ranges: FloatArray
    """Lowest and highest angle of the joints, and of the forearm to the horizontal where that is
    limited [rad], shape (7, 2)."""


class Reach(NamedTuple):
    """Whether, and how comfortably, an arm reaches poses."""

    angles: FloatArray
    """Angles of the six joints [rad], shape (..., 6). Where the elbow cannot stretch or fold
    enough, the nearest that it can."""
    margin: FloatArray
    """Smallest distance of an angle from an end of its range, as a fraction of half the range:
    1 in the middle, negative beyond. Shape (...)."""


def geometry(model: mujoco.MjModel) -> Geometry:
    """Measure one of the project's arms."""
    offset = {model.body(i).name: model.body_pos[i] for i in range(model.nbody)}
    turn = model.body("forearm").quat
    forearm_range = np.array([-np.inf, np.inf])
    tendon = model.tendon("forearm_to_horizontal").id
    if model.tendon_limited[tendon]:
        forearm_range = model.tendon_range[tendon]
    return Geometry(
        shoulder=float(offset["torso"][2]),
        upper=float(offset["forearm"][1]),
        forearm=float(offset["wrist"][1] + offset["gimbal"][1]),
        neck=float(-offset["stylus"][1] + offset["blade"][1]),
        bend=float(-2.0 * np.arctan2(turn[1], turn[0])),
        ranges=np.vstack([model.jnt_range, forearm_range]),
    )


def reach(arm: Geometry, positions: FloatArray, axes: FloatArray, mount_angle: float) -> Reach:
    """Return the joint angles that put the blade's body at poses relative to the base.

    The elbow points up and the pitch is positive; the ranges leave no other choice.

    Args:
        arm: From `geometry`.
        positions: Origin of the blade's body, in the frame of the base [m], shape (..., 3).
        axes: Axes of the blade's body as columns, in the frame of the base, shape (..., 3, 3).
        mount_angle: Between stylus and blade [rad].
    """
    c, s = np.cos(mount_angle), np.sin(mount_angle)
    stylus = axes @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    x, y, z = separate_components(positions - arm.neck * stylus[..., 1])
    waist = np.arctan2(-x, y)
    out, up = np.hypot(x, y), z - arm.shoulder
    stretch = (out**2 + up**2 - arm.upper**2 - arm.forearm**2) / (2.0 * arm.upper * arm.forearm)
    fold = np.arccos(np.clip(stretch, -1.0, 1.0))
    beyond = np.maximum(np.abs(stretch) - 1.0, 0.0)
    shoulder = np.arctan2(up, out) + np.arctan2(
        arm.forearm * np.sin(fold), arm.upper + arm.forearm * np.cos(fold)
    )
    # What the wrist has to do: forearm's axes to stylus's axes, without the half turn between
    # gimbal and stylus. Ry(yaw) Rx(pitch) Ry(-roll), where Ry, Rx turn about y, x.
    cw, sw = np.cos(waist), np.sin(waist)
    cf, sf = np.cos(shoulder - fold), np.sin(shoulder - fold)
    zero = np.zeros_like(cw)
    forearm = np.stack(
        [cw, -sw * cf, sw * sf, sw, cw * cf, -cw * sf, zero, sf, cf], axis=-1
    ).reshape((*np.shape(cw), 3, 3))
    wrist = np.swapaxes(forearm, -1, -2) @ (stylus * np.array([-1.0, -1.0, 1.0]))
    along_x, along_y, along_z = (separate_components(wrist[..., i, :]) for i in range(3))
    yaw = np.arctan2(along_x[1], along_z[1])
    pitch = np.arccos(np.clip(along_y[1], -1.0, 1.0))
    roll = -np.arctan2(along_y[0], -along_y[2])
    angles = np.stack([waist, shoulder, arm.bend - fold, yaw, pitch, roll], axis=-1)
    watched = np.concatenate([angles, (shoulder + arm.bend - fold)[..., None]], axis=-1)
    return Reach(angles, _margin(watched, arm.ranges) - beyond)


def separate_components(vectors: FloatArray) -> FloatArray:
    """Return the components of vectors, each without gaps in memory, shape (n, ...).

    NumPy's functions take an array with gaps to reach beyond its end. Where the result happens to
    lie there, they go another way, of which the last bit differs: 2.0 does so in `arctan2`.

    Args:
        vectors: Shape (..., n).
    """
    return np.ascontiguousarray(np.moveaxis(vectors, -1, 0))


def _margin(angles: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the smallest distance of the angles from the ends of their ranges, relative."""
    low, high = ranges[np.isfinite(ranges).all(axis=1)].T
    watched = angles[..., np.isfinite(ranges).all(axis=1)]
    margins = np.minimum(watched - low, high - watched) / (0.5 * (high - low))
    return np.asarray(margins.min(axis=-1))
