"""Joint positions of a patient-side manipulator from the pose of its blade, in closed form."""

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

TROCAR_CLEARANCE = 0.02
"""Smallest distance of the remote centre from what lies there [m]: the trocar ends 6 mm beyond it,
and the wrist must leave it before the blade is in the tissue."""

LEAST_DEPTH = 0.03
"""Smallest distance of the wrist from the remote centre that a search allows [m]: the wrist bends
only outside of the trocar."""

WRIST_LEVER = 0.06
"""From the axes of the wrist to the middle of the edge of a long blade [m]."""

BASE_HEIGHT = 0.09
"""Smallest height of the remote centre over the table [m]: half that of the base, and a gap."""

_YAWS: FloatArray = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions from the arm to the stroke that the search tries [rad]."""

_DISTANCES, _HEIGHTS = np.linspace(0.0, 0.18, 7), np.linspace(0.05, 0.2, 7)
"""Distances of the remote centre from the middle of the stroke that the search tries, level and
upright [m]: an instrument can be inserted by 0.24 m."""

_YAWS_AT_TROCAR: FloatArray = np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False)
"""Directions that the search tries where the remote centre is given [rad]."""

# Points that stand for the parts, and the radii of the spheres around them [m]. What turns with the
# pitch: rail, cannula, shaft and carriage; the last two slide along the shaft.
_RAIL = np.array([[0.0, -0.045, z] for z in np.linspace(0.13, 0.47, 8)])
_CANNULA = np.array([[0.0, -0.02, 0.085], [0.0, 0.0, 0.04], [0.0, 0.0, 0.0]])
_ALONG_SHAFT = np.linspace(0.0, 1.0, 10)
_CARRIAGE = 0.465
_PIVOT = np.array([0.0, -0.5185, 0.0])
_BACK_BAR = np.array([0.0, -0.0418, 0.15])
_TOP_BAR = np.array([[0.0, y, 0.0] for y in np.linspace(0.0, 0.5, 12)])
_HOUSING = np.array([[0.0, y, 0.0] for y in (-0.56, -0.66, -0.75)])
_RADII = np.array(
    [0.035] * len(_RAIL)
    + [0.02] * len(_CANNULA)
    + [0.01] * len(_ALONG_SHAFT)
    + [0.06]
    + [0.03] * (1 + len(_TOP_BAR))
    + [0.11] * len(_HOUSING)
)

_DOWN = np.array([0.0, 0.0, -1.0])


class PsmGeometry(NamedTuple):
    """Lengths and ranges of a patient-side manipulator, whose origin is its remote centre."""

    retracted: float
    """Distance of the wrist before the remote centre where the insertion is 0 [m]."""
    wrist: float
    """Distance between the axes of the wrist [m]."""
    neck: float
    """From the axis of the wrist's yaw to the blade's body, along the jaws [m]."""
    ranges: FloatArray
    """Lowest and highest position of yaw, pitch, insertion, roll, pitch and yaw of the wrist [rad,
    m], shape (6, 2)."""
    trocar: tuple[float, float, float] | None = None
    """Where the remote centre is, tissue frame [m]; None: where the search finds best."""

    @property
    def stands_on_table(self) -> bool:
        """Whether the underside of its base is its origin: that is the remote centre."""
        return False

    def places(self, path: InstrumentPath) -> Places:
        """Return the places that a search tries: remote centres above and beside a path."""
        if self.trocar is not None:
            there = np.array(self.trocar, np.float64)
            return Places(_YAWS_AT_TROCAR, np.broadcast_to(there, (len(_YAWS_AT_TROCAR), 3)))
        grid = np.meshgrid(_YAWS, _DISTANCES, _HEIGHTS, indexing="ij")
        yaws, distances, heights = (values.ravel() for values in grid)
        beside = path.middle - distances[:, None] * turns_about_z(yaws)[:, :, 1]
        return Places(yaws, beside + np.multiply.outer(heights, [0.0, 0.0, 1.0]))

    def reach(self, positions: FloatArray, axes: FloatArray, mount_angle: float) -> Reach:
        """Return the joints that put the blade's body at poses relative to the remote centre.

        The axis of the wrist's pitch is across that of its yaw, and across the way from the remote
        centre to that. Of its two senses that is taken which leaves more room along the path.

        Args:
            positions: Origin of the blade's body, in the frame of the base [m], shape (..., 3).
                The last axis but one is along a path, along which the roll is continuous.
            axes: Axes of the blade's body as columns, in the frame of the base, shape (..., 3, 3).
            mount_angle: Between the jaws and the blade [rad].
        """
        c, s = np.cos(mount_angle), np.sin(mount_angle)
        tool = axes @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        of_yaw, jaws = -tool[..., 0], tool[..., 1]
        wrist_yaw = positions - self.neck * jaws
        of_pitch = np.cross(of_yaw, wrist_yaw)
        of_pitch /= np.linalg.norm(of_pitch, axis=-1, keepdims=True)
        one, other = (
            self._with_wrist(wrist_yaw, of_yaw, jaws, sense * of_pitch) for sense in (1.0, -1.0)
        )
        better = one.margin.min(axis=-1) >= other.margin.min(axis=-1)
        return Reach(
            np.where(better[..., None, None], one.angles, other.angles),
            np.where(better[..., None], one.margin, other.margin),
        )

    def _with_wrist(
        self, wrist_yaw: FloatArray, of_yaw: FloatArray, jaws: FloatArray, of_pitch: FloatArray
    ) -> Reach:
        """Return the joints where the axis of the wrist's pitch has this sense.

        Args:
            wrist_yaw: Where the axis of the wrist's yaw is [m], shape (..., 3).
            of_yaw: Direction of that axis.
            jaws: Direction of the jaws.
            of_pitch: Direction of the axis of the wrist's pitch.
        """
        link = np.cross(of_yaw, of_pitch)
        wrist = wrist_yaw - self.wrist * link
        depth = np.linalg.norm(wrist, axis=-1)
        shaft = wrist / depth[..., None]
        x, y, z = separate_components(shaft)
        yaw, pitch = np.arctan2(x, -z), np.arctan2(-y, np.hypot(x, z))
        cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
        right = np.stack([cy, np.zeros_like(cy), sy], axis=-1)
        ahead = np.stack([sp * sy, cp, -sp * cy], axis=-1)
        roll = np.arctan2(_dot(of_pitch, ahead), -_dot(of_pitch, right))
        roll = np.unwrap(roll, axis=-1)
        turns = np.round(roll.mean(axis=-1, keepdims=True) / (2.0 * math.pi))
        bent = np.arctan2(_dot(np.cross(shaft, link), of_pitch), _dot(shaft, link))
        turned = np.arctan2(_dot(np.cross(link, jaws), of_yaw), _dot(link, jaws))
        insertion = depth + self.retracted
        watched = np.stack(
            [yaw, pitch, insertion, roll - 2.0 * math.pi * turns, bent, turned], axis=-1
        )
        bars = np.stack([pitch, -pitch], axis=-1)
        angles = np.concatenate([watched[..., :1], bars, watched[..., 1:]], axis=-1)
        usable = self.ranges.copy()
        usable[2, 0] = self.retracted + LEAST_DEPTH
        return Reach(angles, margin_in(watched, usable))

    def fit(self, path: InstrumentPath, bases: FloatArray) -> Fit:
        """Return how it fits: the trocar outside of what lies there, the base over the table."""
        table = path.lowest - TABLE_CLEARANCE if path.table is None else path.table
        outside = distance_to_boxes(bases, path.boxes) >= TROCAR_CLEARANCE
        return Fit(outside & (bases[:, 2] - table >= BASE_HEIGHT), np.zeros(len(bases), np.bool_))

    def links(self, angles: FloatArray) -> FloatArray:
        """Return points along its parts in the frame of the base, shape (..., n, 3)."""
        yaw, pitch, depth = angles[..., 0], angles[..., 3], angles[..., 4] - self.retracted
        tilt = _turns_about_x(-pitch)
        turn = _turns_about_y(-yaw)
        far = -(_CARRIAGE + self.retracted) + angles[..., 4]
        along = far[..., None] + (depth - far)[..., None] * _ALONG_SHAFT
        sliding = np.concatenate([along, far[..., None]], axis=-1)[..., None] * _DOWN
        fixed = np.concatenate([_RAIL, _CANNULA])
        tilted = np.concatenate(
            [np.broadcast_to(fixed, (*sliding.shape[:-2], *fixed.shape)), sliding], axis=-2
        ) @ np.swapaxes(tilt, -1, -2)
        end = _PIVOT + (tilt @ _BACK_BAR)
        bars = end[..., None, :] + np.concatenate(
            [
                -0.5 * (end - _PIVOT)[..., None, :],
                np.broadcast_to(_TOP_BAR, (*end.shape[:-1], *_TOP_BAR.shape)),
            ],
            axis=-2,
        )
        housing = np.broadcast_to(_HOUSING, (*end.shape[:-1], *_HOUSING.shape))
        upright = np.concatenate([tilted, bars, housing], axis=-2)
        return np.asarray(upright @ np.swapaxes(turn, -1, -2))

    def spheres(self, poses: ArmPoses) -> Spheres:
        """Return spheres that cover its links; its base is the remote centre."""
        links = self.links(poses.angles)
        centres = poses.bases[:, None] + links @ np.swapaxes(poses.turns, 1, 2)
        return Spheres(np.asarray(centres), _RADII)


def psm_geometry(model: mujoco.MjModel) -> PsmGeometry:
    """Measure the patient-side manipulator."""
    place = {model.body(i).name: model.body_pos[i] for i in range(model.nbody)}
    moved = [i for i in range(model.njnt) if not model.joint(i).name.endswith("_bar")]
    return PsmGeometry(
        retracted=float(place["wrist_pitch"][2]),
        wrist=float(-place["wrist_yaw"][2]),
        neck=float(place["blade"][1]),
        ranges=model.jnt_range[moved].copy(),
    )


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the scalar products of vectors, shape (...)."""
    return np.asarray((one * other).sum(axis=-1))


def _turns_about_x(angles: FloatArray) -> FloatArray:
    """Return rotations about x, shape (..., 3, 3)."""
    c, s, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [zero + 1.0, zero, zero, zero, c, -s, zero, s, c]
    return np.stack(rows, axis=-1).reshape((*angles.shape, 3, 3))


def _turns_about_y(angles: FloatArray) -> FloatArray:
    """Return rotations about y, shape (..., 3, 3)."""
    c, s, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [c, zero, s, zero, zero + 1.0, zero, -s, zero, c]
    return np.stack(rows, axis=-1).reshape((*angles.shape, 3, 3))
