"""An arm of the user's own: any MJCF with a blade, led by a hand at its edge.

The hand is Cartesian impedance control at the blade, with gravity compensated, as robot arms offer
it: it acts through the joints, whatever they are. The model's own actuators are taken out, for they
would hold the joints where they are.
"""

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from bridge import DeviceLimits, TissueFrame
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.led_arm import LedArm
from scalpel_sim.arm.placement import PlacementError
from scalpel_sim.arm.reachable_box import grown_within, placed_within, shrunk, tour_of
from scalpel_sim.arm.standing import Standing
from scalpel_sim.errors import UsageError
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray

_USUAL_MASS, _USUAL_MOMENT = 0.07, 0.07 * 0.08**2
"""Mass [kg] and moment of inertia [kg m2] that the usual hand feels; see `Impedance`."""
_SAMPLES: Final = 33
"""Poses along the stroke that the arm must reach."""
_NEAR, _NEAR_TURN = 5e-4, 5e-3
"""How far the edge may stay from a pose: its middle [m] and its direction [rad]. The hand is a
spring and pulls it on."""
_ITERATIONS: Final = 200
"""Steps of the inverse kinematics for a pose, at most."""
_LONGEST_TURN: Final = 0.2
"""How far a joint moves in a step of it, at most [rad, m]: the Jacobian is that of where it is."""
_DAMPING: Final = 1e-3
"""Damping of the least squares, over the largest square of a singular value: near a singular
configuration joints move little rather than wildly."""
_STARTS: Final = 24
"""Configurations from which the first pose is sought: the one that the model has, and random ones,
always the same."""
_LEVER: Final = 0.1
"""Length by which turns are weighed against displacements [m]: about that of an instrument."""


def own_arm(
    path: Path,
    limits: DeviceLimits,
    *,
    heel: str = "heel",
    tip: str = "tip",
    forward: Sequence[float] = (0.0, 0.0, -1.0),
    others: Sequence[Standing] = (),
) -> LedArm:
    """Return the arm of an MJCF file, in the configuration of its first keyframe if it has one.

    Args:
        path: The file. It needs two sites at the ends of the edge, on one body.
        limits: Largest force and torque that the arm can render.
        heel: Site at the handle's end of the edge.
        tip: Site at the sharp end.
        forward: Direction in which the edge cuts, in the frame of its body.
        others: What else stands in its world: arms, each with a grasper, a table, fixtures.

    Raises:
        UsageError: the file cannot be read, is no model, or has no such blade.
    """
    led = partial(LedArm, heel=heel, tip=tip, forward=forward)
    try:
        usual = led(own_spec(path), path.stem, limits)
        expect_angles(usual.model)
        usual.reset(_at_first(usual))
        firm = firm_impedance(usual)
        arm = led(own_spec(path), path.stem, limits, firm, others=others)
    except ValueError as error:
        raise UsageError(f"[arm] model {path}: {error}") from error
    arm.reset(_at_first(usual))
    return arm


def own_spec(path: Path) -> mujoco.MjSpec:
    """Return the model of a file without its actuators, its gravity compensated.

    Raises:
        ValueError: the file cannot be read, or is no model.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for key in list(spec.keys):
        key.ctrl = []  # of the actuators that are gone
    for body in spec.bodies:
        body.gravcomp = 1.0
    # A bad state must raise, not jump back to the start.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return spec


def expect_angles(model: mujoco.MjModel) -> None:
    """Refuse joints whose position is not one number.

    Raises:
        ValueError: one is no hinge and no slide.
    """
    kinds = set(model.jnt_type.tolist())
    if kinds - {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}:
        raise ValueError("it has other joints than hinges and slides")


def _at_first(arm: LedArm) -> FloatArray:
    """Return the configuration of the first keyframe, or that of the model without one."""
    first = arm.model.key_qpos[0] if arm.model.nkey else arm.model.qpos0
    return np.asarray(np.clip(first, *arm.ranges()))


def firm_impedance(arm: LedArm) -> Impedance:
    """Return a hand that moves this arm as fast as the usual one moves the arms of the scenes.

    A robot is a hundred times as heavy at its edge: the usual hand would leave it swinging at 5 Hz.
    Stiffness and damping follow its inertia there (Khatib 1987, IEEE J. Robotics and Automation
    3:43), and are critical.

    Args:
        arm: The arm, alone in its model, in a configuration in which it will work.
    """
    model, data = arm.model, arm.data
    position, rotation = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, position, rotation, arm.hand.edge)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    mass, moment = (_felt(jacobian, inertia) for jacobian in (position, rotation))
    usual = Impedance()
    rate = math.sqrt(usual.stiffness / _USUAL_MASS)
    turning = math.sqrt(usual.rotational_stiffness / _USUAL_MOMENT)
    return Impedance(
        max(usual.stiffness, mass * rate**2),
        max(usual.damping, 2.0 * mass * rate),
        max(usual.rotational_stiffness, moment * turning**2),
        max(usual.rotational_damping, 2.0 * moment * turning),
    )


def _felt(jacobian: FloatArray, inertia: FloatArray) -> float:
    """Return the largest inertia that is felt at the edge [kg or kg m2], where the arm is free."""
    mobility = np.linalg.eigvalsh(jacobian @ np.linalg.solve(inertia, jacobian.T))
    free = mobility[mobility > 1e-6 * mobility.max()]  # not along what no joint moves
    return float(1.0 / free.min())


def move_to_start(arm: LedArm, stroke: Stroke, frame: TissueFrame) -> None:
    """Move an arm to the start of a stroke, all of which it must reach.

    Args:
        arm: The arm; the configuration where it is is tried first.
        stroke: In the tissue frame.
        frame: Where the tissue lies in the world.

    Raises:
        PlacementError: it does not; the message says where, and by how much.
    """
    times, poses = _watched(stroke, frame)
    solver = _InverseKinematics(arm)
    nearest = (np.inf, 0.0, 0)
    for start in solver.starts():
        first, miss, i = solver.follow(start, poses)
        if miss <= 1.0:
            arm.reset(first)
            return
        nearest = min(nearest, (miss, float(times[i]), i), key=lambda each: -each[2])
    miss, when, _ = nearest
    raise PlacementError(
        f"the arm '{arm.name}' does not reach the stroke: at {when:.2f} s of it the edge stays "
        f"{miss * 1e3 * _NEAR:.3g} mm away, a turn of {_NEAR_TURN / _NEAR * 1e-3:.2g} rad counted "
        "as a millimetre. Move it or the tissue (pos, quat of the scene), or choose a smaller one"
    )


def move_within(
    arm: LedArm, workspace: FloatArray, start: BladeSegment, frame: TissueFrame
) -> FloatArray:
    """Move an arm to a pose, and return how much of the workspace around it it reaches.

    Args:
        arm: See `move_to_start`.
        workspace: Lowest and highest place where the middle of the edge is wanted, tissue frame
            [m], shape (2, 3).
        start: The pose, tissue frame.
        frame: Where the tissue lies in the world.

    Raises:
        PlacementError: it does not reach even a small part of it.
    """
    middle = 0.5 * (start.tip + start.heel)

    def move_for(shares: FloatArray) -> FloatArray:
        box = shrunk(workspace, middle, shares)
        move_to_start(arm, tour_of(box, middle, start), frame)
        return box

    def reaches(box: FloatArray) -> bool:
        poses = _watched(tour_of(box, middle, start), frame)[1]
        solver = _InverseKinematics(arm)
        return solver.follow(solver.starts()[0], poses)[1] <= 1.0

    return grown_within(placed_within(move_for), workspace, reaches)


def _watched(stroke: Stroke, frame: TissueFrame) -> tuple[FloatArray, list[BladeSegment]]:
    """Return the instants at which an arm must reach a stroke [s], and the poses, world frame."""
    times = np.linspace(0.0, stroke.duration, _SAMPLES)
    return times, [frame.segment_to_world(stroke.pose(t)) for t in times]


class _InverseKinematics:
    """Damped least squares for the pose of the edge; data of its own."""

    def __init__(self, arm: LedArm) -> None:
        self._model = arm.model
        self._data = mujoco.MjData(arm.model)
        self._low, self._high = arm.ranges()
        self._site = arm.hand.edge
        self._at_first = np.array(arm.data.qpos)

    def starts(self) -> list[FloatArray]:
        """Return configurations to start from."""
        low = np.where(np.isfinite(self._low), self._low, -np.pi)
        high = np.where(np.isfinite(self._high), self._high, np.pi)
        rng = np.random.default_rng(0)
        return [self._at_first, *rng.uniform(low, high, (_STARTS - 1, len(low)))]

    def follow(
        self, qpos: FloatArray, poses: Sequence[BladeSegment]
    ) -> tuple[FloatArray, float, int]:
        """Follow poses from a configuration, up to the first that is not reached.

        Returns:
            The configuration at the first pose, the miss at the last one that was tried, as
            `solve` counts it, and the number of that pose.
        """
        qpos, miss = self.solve(qpos, poses[0])
        first, n = qpos, 1
        while miss <= 1.0 and n < len(poses):
            qpos, miss = self.solve(qpos, poses[n])
            n += 1
        return first, miss, n - 1

    def solve(self, qpos: FloatArray, pose: BladeSegment) -> tuple[FloatArray, float]:
        """Return a configuration near `qpos` that has the edge at a pose, and by how much not.

        The miss is 1 where it is just near enough.
        """
        model, data = self._model, self._data
        edge = pose.tip - pose.heel
        middle, wanted = 0.5 * (pose.tip + pose.heel), _axes(edge, pose.forward)
        position, rotation = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        for _ in range(_ITERATIONS):
            data.qpos[:] = qpos
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            off = middle - data.site_xpos[self._site]
            turn = _turn(data.site_xmat[self._site].reshape(3, 3), wanted)
            miss = max(np.linalg.norm(off) / _NEAR, np.linalg.norm(turn) / _NEAR_TURN)
            if miss < 0.1:
                break
            mujoco.mj_jacSite(model, data, position, rotation, self._site)
            jacobian = np.vstack([position, _LEVER * rotation])
            square = jacobian @ jacobian.T
            square += _DAMPING * np.linalg.norm(square, 2) * np.eye(6)
            step = jacobian.T @ np.linalg.solve(square, np.append(off, _LEVER * turn))
            step *= min(1.0, _LONGEST_TURN / max(float(np.abs(step).max()), 1e-12))
            qpos = np.clip(qpos + step, self._low, self._high)
        return qpos, float(miss)


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
