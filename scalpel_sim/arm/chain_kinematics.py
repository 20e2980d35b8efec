"""Configurations of any chain of hinges and slides that have the edge at a pose.

Steps are those of mink: a quadratic program within the ranges of the joints (the extra `arms`).
They begin from several configurations, always the same. What no joint moves is left as it is:
chains may have any number of joints, and lack some of the six motions.
"""

from collections.abc import Sequence
from types import ModuleType
from typing import Final, NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.overlaps import Overlap, overlaps
from scalpel_sim.errors import UsageError
from tissue import BladeSegment, BoolArray, FloatArray

NEAR_PLACE: Final = 5e-4
"""Distance of the middle of the edge from a pose, at most [m]. The hand is a spring and pulls it
on."""
NEAR_TURN: Final = 5e-3
"""By how much the edge may be turned from a pose [rad], likewise."""
_ITERATIONS: Final = 200
"""Steps for a pose, at most."""
LONGEST_STEP: Final = 0.2
"""Motion of a joint in a step, at most [rad, m]: the Jacobian is that of where it is."""
_STILL: Final = 1e-5
"""Step below which joints have come to rest [rad, m]: no motion brings the edge nearer."""
_DAMPING: Final = 1e-3
"""Damping of a step, over the square of what it lacks [m2]: near a singular configuration joints
move little rather than wildly, and close to the pose nothing slows them."""
_LEAST_DAMPING: Final = 1e-10
"""Damping of all steps [m2]: joints that do not carry the edge stay."""
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
    overlaps: Sequence[Overlap] = ()
    """Parts that overlap at the first pose at which anything of the arm does, deepest first."""

    @property
    def is_whole(self) -> bool:
        """Whether the arm reaches all poses."""
        return self.miss.size <= 1.0

    @property
    def depth(self) -> float:
        """Depth of what overlaps [m]."""
        return self.overlaps[0].depth if self.overlaps else 0.0


class ChainKinematics:
    """Finds configurations of an arm, in data of its own.

    Args:
        arm: The arm. The configuration where it is is tried first.

    Raises:
        UsageError: mink is not installed.
    """

    def __init__(self, arm: DrivenArm) -> None:
        self._model = arm.model
        self._mink = mink = _loaded()
        self._configuration = mink.Configuration(arm.model)
        self._data = self._configuration.data
        self._low, self._high = arm.ranges()
        self._site = arm.hand.edge
        self._at_first = np.array(arm.data.qpos)
        self._task = mink.FrameTask(int(self._site), "site", 1.0, _LEVER, lm_damping=_DAMPING)
        self._limits = [mink.ConfigurationLimit(arm.model, gain=1.0)]

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

    def find_clear(self, poses: Sequence[BladeSegment]) -> Followed:
        """Follow poses as `find` does, clear of itself where that is possible.

        Where it is not, the way with the shallowest overlap is returned.
        """
        shallowest: Followed | None = None
        for start in self.starts():
            found = self.follow(start, poses)
            if found.is_whole and (shallowest is None or found.depth < shallowest.depth):
                shallowest = found
            if shallowest is not None and not shallowest.overlaps:
                return shallowest
        return shallowest or self.find(poses)

    def follow(self, qpos: FloatArray, poses: Sequence[BladeSegment]) -> Followed:
        """Follow poses from a configuration, up to the first that is not reached."""
        qpos, miss = self.solve(qpos, poses[0])
        first, n, met = qpos, 1, overlaps(self._model, self._data)
        while miss.size <= 1.0 and n < len(poses):
            qpos, miss = self.solve(qpos, poses[n])
            n += 1
            met = met or overlaps(self._model, self._data)
        return Followed(first, qpos, miss, n - 1, met)

    def solve(self, qpos: FloatArray, pose: BladeSegment) -> tuple[FloatArray, Miss]:
        """Return a configuration near `qpos` that has the edge at a pose, and what it lacks."""
        wanted, target = _wanted(pose), np.eye(4)
        target[:3, :3], target[:3, 3] = wanted
        self._task.set_target(self._mink.SE3.from_matrix(target))
        for i in range(_ITERATIONS):
            self._configuration.update(qpos)
            miss = self._miss(*wanted)
            if miss.size < 0.1 or i == _ITERATIONS - 1:
                break
            try:
                step = self._step()
            except self._mink.NoSolutionFound:
                break
            if np.abs(step).max() < _STILL:
                break
            step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
            qpos = self.within_ranges(qpos + step)
        return qpos, miss

    def lacks(self, qpos: FloatArray, pose: BladeSegment) -> tuple[Miss, FloatArray]:
        """Return what an edge lacks to a pose in a configuration, and how joints change that.

        Returns:
            What it lacks, and the Jacobian of the edge as `Miss.weighed`, of shape (6, n_joints).
        """
        position, rotation = self._place(qpos)
        return self._miss(*_wanted(pose)), np.vstack([position, _LEVER * rotation])

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
        self._configuration.update(qpos)
        position, rotation = np.zeros((2, 3, self._model.nv))
        mujoco.mj_jacSite(self._model, self._data, position, rotation, self._site)
        return position, rotation

    def _miss(self, axes: FloatArray, middle: FloatArray) -> Miss:
        """Return what the edge lacks to what is `_wanted`, from where the joints are."""
        now = self._data.site_xmat[self._site].reshape(3, 3)
        return Miss(middle - self._data.site_xpos[self._site], _turn(now, axes))

    def _step(self) -> FloatArray:
        """Return a step of the joints from where they are towards the target of the task."""
        step = self._mink.solve_ik(
            self._configuration,
            [self._task],
            dt=1.0,
            solver="daqp",
            damping=_LEAST_DAMPING,
            limits=self._limits,
        )
        return np.asarray(step)


def _loaded() -> ModuleType:
    """Return mink.

    Raises:
        UsageError: it cannot be loaded.
    """
    try:
        import mink
    except ImportError as cause:
        raise UsageError(
            f"an arm of your own needs mink for its inverse kinematics, which cannot be loaded "
            f"({cause}): pip install 'scalpel-sim[arms]'"
        ) from cause
    return mink


def _projector(directions: FloatArray) -> FloatArray:
    """Return the projector on the space of some directions, which are columns, shape (3, 3)."""
    axes, sizes, _ = np.linalg.svd(directions)
    used = axes[:, : len(sizes)][:, sizes > _LEAST_MOTION * max(float(sizes.max()), _LEAST_MOTION)]
    return np.asarray(used @ used.T)


def _wanted(pose: BladeSegment) -> tuple[FloatArray, FloatArray]:
    """Return axes as columns whose +y is along an edge and whose -z cuts, and its middle [m]."""
    edge, forward = pose.tip - pose.heel, pose.forward
    y = edge / np.linalg.norm(edge)
    z = -(forward - (forward @ y) * y)
    z /= np.linalg.norm(z)
    return np.stack([np.cross(y, z), y, z], axis=1), 0.5 * (pose.tip + pose.heel)


def _turn(now: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the rotation vector that turns axes to others, world frame [rad]."""
    quaternion, turn = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quaternion, (wanted @ now.T).ravel())
    mujoco.mju_quat2Vel(turn, quaternion, 1.0)
    return turn
