"""Configurations of any chain of hinges and slides that have the edge at a pose.

Damped least squares from several starts. What no joint moves is left as it is: chains may have any
number of joints, and lack some of the six motions.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.arm import DrivenArm
from tissue import BladeSegment, BoolArray, FloatArray

NEAR_PLACE: Final = 5e-4
"""How far the middle of the edge may stay from a pose [m]. The hand is a spring and pulls it on."""
NEAR_TURN: Final = 5e-3
"""By how much the edge may be turned from a pose [rad], likewise."""
_ITERATIONS: Final = 200
"""Steps for a pose, at most."""
LONGEST_STEP: Final = 0.2
"""How far a joint moves in a step, at most [rad, m]: the Jacobian is that of where it is."""
_DAMPING: Final = 1e-3
"""Damping of the least squares, over the largest square of a singular value: near a singular
configuration joints move little rather than wildly."""
_STARTS: Final = 24
"""Configurations from which the first pose is sought: the one that the model has, and random ones,
always the same."""
_LEVER: Final = 0.1
"""Length by which turns are weighed against displacements [m]: about that of an instrument."""
_LEAST_MOTION: Final = 1e-6
"""Singular value, over the largest, below which joints do not move an edge in that direction."""


class Miss(NamedTuple):
    """Displacement and turn that an edge lacks to a pose, world frame."""

    shift: FloatArray
    """From where its middle is to where it should be [m], shape (3,)."""
    turn: FloatArray
    """Rotation vector from how it is turned to how it should be [rad], shape (3,)."""

    @property
    def weighed(self) -> FloatArray:
        """Both as one vector, a turn by its displacement at the end of a lever [m], shape (6,)."""
        return np.append(self.shift, _LEVER * self.turn)

    @property
    def size(self) -> float:
        """1 where it is just near enough."""
        return float(
            max(np.linalg.norm(self.shift) / NEAR_PLACE, np.linalg.norm(self.turn) / NEAR_TURN)
        )


class Followed(NamedTuple):
    """Result of following poses with an arm."""

    first: FloatArray
    """Configuration at the first pose, shape (n_joints,)."""
    last: FloatArray
    """Configuration at the last pose that was tried."""
    miss: Miss
    """Displacement and turn that the edge lacks there."""
    number: int
    """Number of that pose."""

    @property
    def is_whole(self) -> bool:
        """Whether the arm reaches all poses."""
        return self.miss.size <= 1.0


class DampedLeastSquares:
    """Finds configurations of an arm, in data of its own.

    Args:
        arm: The arm. The configuration where it is is tried first.
    """

    def __init__(self, arm: DrivenArm) -> None:
        self._model = arm.model
        self._data = mujoco.MjData(arm.model)
        self._low, self._high = arm.ranges()
        self._site = arm.hand.edge
        self._at_first = np.array(arm.data.qpos)

    def starts(self) -> list[FloatArray]:
        """Return configurations to start from. Joints that do not carry the edge stay."""
        low = np.where(np.isfinite(self._low), self._low, -np.pi)
        high = np.where(np.isfinite(self._high), self._high, np.pi)
        drawn = np.random.default_rng(0).uniform(low, high, (_STARTS - 1, len(low)))
        carries = np.zeros(len(low), dtype=np.bool_)
        body = int(self._model.site_bodyid[self._site])
        while body:
            joint, n = int(self._model.body_jntadr[body]), int(self._model.body_jntnum[body])
            carries[joint : joint + n] = True
            body = int(self._model.body_parentid[body])
        return [self._at_first, *np.where(carries, drawn, self._at_first)]

    def find(self, poses: Sequence[BladeSegment]) -> Followed:
        """Follow poses from each of the starts, until one reaches all; return the farthest."""
        farthest: Followed | None = None
        for start in self.starts():
            found = self.follow(start, poses)
            if found.is_whole:
                return found
            if farthest is None or (found.number, -found.miss.size) > (
                farthest.number,
                -farthest.miss.size,
            ):
                farthest = found
        assert farthest is not None
        return farthest

    def follow(self, qpos: FloatArray, poses: Sequence[BladeSegment]) -> Followed:
        """Follow poses from a configuration, up to the first that is not reached."""
        qpos, miss = self.solve(qpos, poses[0])
        first, n = qpos, 1
        while miss.size <= 1.0 and n < len(poses):
            qpos, miss = self.solve(qpos, poses[n])
            n += 1
        return Followed(first, qpos, miss, n - 1)

    def solve(self, qpos: FloatArray, pose: BladeSegment) -> tuple[FloatArray, Miss]:
        """Return a configuration near `qpos` that has the edge at a pose, and what it lacks."""
        for i in range(_ITERATIONS):
            miss, jacobian = self.lacks(qpos, pose)
            if miss.size < 0.1 or i == _ITERATIONS - 1:
                break
            square = jacobian @ jacobian.T
            square += _DAMPING * np.linalg.norm(square, 2) * np.eye(6)
            step = jacobian.T @ np.linalg.solve(square, miss.weighed)
            step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
            qpos = self.within_ranges(qpos + step)
        return qpos, miss

    def lacks(self, qpos: FloatArray, pose: BladeSegment) -> tuple[Miss, FloatArray]:
        """Return what an edge lacks to a pose in a configuration, and how joints change that.

        Returns:
            What it lacks, and the Jacobian of the edge as `Miss.weighed`, of shape (6, n_joints).
        """
        position, rotation = self._place(qpos)
        wanted = _axes(pose.tip - pose.heel, pose.forward)
        off = 0.5 * (pose.tip + pose.heel) - self._data.site_xpos[self._site]
        now = self._data.site_xmat[self._site].reshape(3, 3)
        return Miss(off, _turn(now, wanted)), np.vstack([position, _LEVER * rotation])

    def within_ranges(self, qpos: FloatArray) -> FloatArray:
        """Return the configuration nearest to `qpos` that the joints can take."""
        return np.asarray(np.clip(qpos, self._low, self._high))

    def stops(self, qpos: FloatArray, step: FloatArray) -> BoolArray:
        """Return which joints are at an end of their range that a step would take them beyond."""
        return (step < 0.0) & (qpos <= self._low) | (step > 0.0) & (qpos >= self._high)

    def movable(self) -> tuple[FloatArray, FloatArray]:
        """Return projectors on the directions in which joints move, and about which they turn.

        World frame, each of shape (3, 3): those of all starts together.
        """
        jacobians = [self._place(start) for start in self.starts()]
        positions, rotations = (np.hstack(parts) for parts in zip(*jacobians, strict=True))
        return _projector(positions), _projector(rotations)

    def _place(self, qpos: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Put the joints somewhere; return the Jacobians of place and rotation of the edge."""
        model, data = self._model, self._data
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        position, rotation = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, position, rotation, self._site)
        return position, rotation


def _projector(directions: FloatArray) -> FloatArray:
    """Return the projector on the space of some directions, which are columns, shape (3, 3)."""
    axes, sizes, _ = np.linalg.svd(directions)
    used = axes[:, : len(sizes)][:, sizes > _LEAST_MOTION * max(float(sizes.max()), _LEAST_MOTION)]
    return np.asarray(used @ used.T)


def _axes(edge: FloatArray, forward: FloatArray) -> FloatArray:
    """Return axes as columns whose +y is along the edge and whose -z cuts."""
    y = edge / np.linalg.norm(edge)
    z = -(forward - (forward @ y) * y)
    z /= np.linalg.norm(z)
    return np.stack([np.cross(y, z), y, z], axis=1)


def _turn(now: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the rotation vector that turns axes to others, world frame [rad]."""
    quaternion, turn = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quaternion, (wanted @ now.T).ravel())
    mujoco.mju_quat2Vel(turn, quaternion, 1.0)
    return turn
