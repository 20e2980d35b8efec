"""Joint angles of a PHANTOM-like arm from the pose of its blade, in closed form, many at once."""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.kinematics import (
    TABLE_CLEARANCE,
    ArmPoses,
    Fit,
    InstrumentPath,
    Places,
    Reach,
    Spheres,
    distance_to_boxes,
    margin_in,
    separate_components,
    turns_about_z,
)
from tissue import FloatArray

YAWS = np.arange(24) * (2.0 * math.pi / 24)
"""Directions from the base to the stroke that the search tries [rad]."""

DISTANCES, HEIGHTS = np.linspace(0.25, 1.0, 11), np.linspace(-0.7, 0.7, 13)
"""Distances of the middle of the stroke from the axis of the waist, and heights over the shoulder,
that the search tries, as fractions of the length of the stretched arm."""

BASE_RADIUS = 0.08
"""Radius about the axis of the waist in which neither body nor board must lie [m]."""

LINK_RADIUS = 0.02
"""Radius of the spheres that cover upper arm, forearm and stylus [m]: capsules of 8 mm, of which
every quarter of the length has a point."""

TABLE_ROUNDING = 1e-9
"""Height by which a base that stands on a table may be off it [m]."""

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

    @property
    def stands_on_table(self) -> bool:
        """Whether the underside of its base is its origin: it is."""
        return True

    def places(self, path: InstrumentPath) -> Places:
        """Return the places that a search tries: around the middle of a path."""
        length = self.upper + self.forearm + self.neck
        heights = HEIGHTS * length + self.shoulder
        if path.table is not None:  # the base may stand on it
            heights = np.append(heights, path.middle[2] - path.table)
        grid = np.meshgrid(YAWS, DISTANCES * length, heights, indexing="ij")
        yaws, distances, above = (values.ravel() for values in grid)
        outward = turns_about_z(yaws)[:, :, 1]
        adjacent = path.middle - distances[:, None] * outward
        return Places(yaws, adjacent - np.multiply.outer(above, [0.0, 0.0, 1.0]))

    def reach(self, positions: FloatArray, axes: FloatArray, mount_angle: float) -> Reach:
        """Return the joint angles that put the blade's body at poses relative to the base.

        The elbow points up and the pitch is positive; the ranges leave no other choice.

        Args:
            positions: Origin of the blade's body, in the frame of the base [m], shape (..., 3).
            axes: Axes of the blade's body as columns, in the frame of the base, shape (..., 3, 3).
            mount_angle: Between stylus and blade [rad].
        """
        c, s = np.cos(mount_angle), np.sin(mount_angle)
        stylus = axes @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        x, y, z = separate_components(positions - self.neck * stylus[..., 1])
        waist = np.arctan2(-x, y)
        out, up = np.hypot(x, y), z - self.shoulder
        stretch = (out**2 + up**2 - self.upper**2 - self.forearm**2) / (
            2.0 * self.upper * self.forearm
        )
        fold = np.arccos(np.clip(stretch, -1.0, 1.0))
        beyond = np.maximum(np.abs(stretch) - 1.0, 0.0)
        shoulder = np.arctan2(up, out) + np.arctan2(
            self.forearm * np.sin(fold), self.upper + self.forearm * np.cos(fold)
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
        angles = np.stack([waist, shoulder, self.bend - fold, yaw, pitch, roll], axis=-1)
        watched = np.concatenate([angles, (shoulder + self.bend - fold)[..., None]], axis=-1)
        return Reach(angles, margin_in(watched, self.ranges) - beyond)

    def fit(self, path: InstrumentPath, bases: FloatArray) -> Fit:
        """Return how the base fits: beside what lies there, and best on the table."""
        beside = distance_to_boxes(bases[:, :2], path.boxes[..., :2]) >= BASE_RADIUS
        if path.table is None:
            return Fit(beside, bases[:, 2] > path.lowest - TABLE_CLEARANCE)
        beside &= bases[:, 2] >= path.table - TABLE_ROUNDING
        return Fit(beside, bases[:, 2] > path.table + TABLE_ROUNDING)

    def links(self, angles: FloatArray) -> FloatArray:
        """Return points along upper arm and forearm in the frame of the base, shape (..., 8, 3)."""
        waist, shoulder, elbow, *_ = separate_components(angles)[..., None]
        level = shoulder + elbow - self.bend
        upper = self.upper * np.array([0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0, 1.0])
        forearm = self.forearm * np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0])
        out = upper * np.cos(shoulder) + forearm * np.cos(level)
        up = self.shoulder + upper * np.sin(shoulder) + forearm * np.sin(level)
        return np.stack([-np.sin(waist) * out, np.cos(waist) * out, up], axis=-1)

    def spheres(self, poses: ArmPoses) -> Spheres:
        """Return spheres that cover the arm: its base, its links and its stylus."""
        path, angles, bases, turns, mount_angle = poses
        c, s = math.cos(mount_angle), math.sin(mount_angle)
        stylus = path.axes @ np.array([0.0, c, -s])
        gimbal = path.positions - self.neck * stylus
        along = np.stack([gimbal - d * stylus for d in (0.0, 0.03, 0.06)], axis=1)
        column = np.multiply.outer(np.linspace(0.0, self.shoulder, 4), [0.0, 0.0, 1.0])
        links = self.links(angles) @ np.swapaxes(turns, 1, 2)
        parts = [
            (bases[:, None] + column, BASE_RADIUS),
            (bases[:, None] + links, LINK_RADIUS),
            (np.broadcast_to(along, (len(bases), *along.shape[1:])), LINK_RADIUS),
        ]
        return Spheres(
            np.concatenate([centres for centres, _ in parts], axis=1),
            np.concatenate([np.full(centres.shape[1], radius) for centres, radius in parts]),
        )


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
