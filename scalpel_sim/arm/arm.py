"""Arms that MuJoCo simulates, each with a blade and the virtual hand that leads it."""

import logging
import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NoReturn

import mujoco
import numpy as np

from bridge import DeviceLimits
from scalpel_sim.arm.blade import Blade
from scalpel_sim.arm.grasper import HeldArm
from scalpel_sim.arm.hand import Hand, Impedance, add_hand
from scalpel_sim.arm.standing import Standing, StandingFixture, collide_as_one_arm
from scalpel_sim.errors import unknown
from tissue import FloatArray, IntArray
from tissue.support import SameTypes, kernel

_log = logging.getLogger("scalpel_sim")

LARGEST_JOINT_STEP = 0.5
"""By how much a joint may turn in a step [rad], or slide [m]: at 1 kHz five times as fast as a hand
turns one, at 10 m/s on a lever of 0.1 m. Beyond, it was pushed or its state was set."""

ASSETS = Path(__file__).parent / "assets"

ARMS = {
    "touch": DeviceLimits(force=3.3, torque=0.33),
    "premium": DeviceLimits(force=8.5, torque=0.188),
    "psm": DeviceLimits(force=9.88, torque=0.2),
}
"""The arms, and the largest force and torque that each can render.

Forces, and the torque of the Premium 1.5 with its six motors: CHAI3D, CPhantomDevices.cpp, after
the vendor's data sheets. The gimbal of the Touch has no motors: the hand alone resists a torque, so
no limit of the device belongs here. 0.33 N m is 3.3 N on a lever of 10 cm, the length of a scalpel.
Those of the patient-side manipulator are what the motors of its insertion and of the yaw of its
wrist exert, by the files that `psm.xml` names.
"""

PSM = "psm"
"""The patient-side manipulator, which works through a trocar: the origin of its base is its remote
centre, not the middle of an underside."""

CHOSEN_BY_SIZE = ("touch", "premium")
"""Arms that `auto` chooses from, smallest first."""

BLADE_HEIGHT, BLADE_THICKNESS, _STEEL = 6e-3, 0.4e-3, 7800.0
"""Height [m], thickness [m] and density [kg/m3] of a no. 11 scalpel blade."""


class ArmError(RuntimeError):
    """MuJoCo's state can no longer be trusted: the arm must stop."""


class DrivenArm:
    """An arm, its blade, and the virtual hand that leads it. World frame.

    A frame is `step1`, then `blade.segment` and `blade.apply`, then `step2` and `check`.

    Args:
        spec: A model that is yet to be compiled, with a site at each end of the edge. It gains the
            hand.
        name: Name of the arm, for reports.
        limits: Largest force and torque that it can render.
        impedance: How firmly the hand holds the blade.
        heel: Site at the handle's end of the edge.
        tip: Site at the sharp end.
        forward: Direction in which the edge cuts, in the frame of its body.
        others: What else stands in its world, and what it collides with: arms, each with a
            grasper, a table, fixtures. Contact is on for them where the model has it off.

    Raises:
        ValueError: the model has no such sites, or cannot be compiled; two fixtures have one name.
    """

    def __init__(
        self,
        spec: mujoco.MjSpec,
        name: str,
        limits: DeviceLimits,
        impedance: Impedance = Impedance(),
        *,
        heel: str = "heel",
        tip: str = "tip",
        forward: Sequence[float] = (0.0, 0.0, -1.0),
        others: Sequence[Standing] = (),
    ) -> None:
        route_warnings()
        hand = add_hand(spec, impedance, heel, tip, forward)
        self._n_own = len(spec.joints)
        collide_as_one_arm(spec, spec)
        if others:
            spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.fixtures: dict[str, str] = {}
        """Names of the bodies of fixtures in its model, by those of the fixtures."""
        held: list[tuple[HeldArm, str]] = []
        for other in others:
            called = other.stand_in(spec)
            if isinstance(other, StandingFixture):
                if other.fixture.name in self.fixtures:
                    raise ValueError(f"two fixtures have the name {other.fixture.name!r}")
                self.fixtures[other.fixture.name] = called
            elif isinstance(other, HeldArm):
                held.append((other, called))
        self.name = name
        """Name of the arm, for reports."""
        self.limits = limits
        self.model = spec.compile()
        """MuJoCo's model."""
        self.data = mujoco.MjData(self.model)
        """MuJoCo's data."""
        self.blade = Blade(self.model, self.data, heel, tip, forward=forward)
        self.hand = Hand(self.model, self.data, hand)
        self.others = tuple(other for other, _ in held)
        """Arms that stand in its world."""
        self.graspers = tuple(
            other.grasper(self.model, self.data, prefix) for other, prefix in held
        )
        """Graspers of these arms."""
        self.joints = tuple(
            self.model.joint(i).name or f"joint {i}" for i in range(self.model.njnt)
        )
        """Names of the joints, its own first."""
        # Views of MuJoCo's arrays: they stay valid for the life of `data`.
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._n_warnings = self.data.warning.number
        self._dt: float = self.model.opt.timestep
        self._angles = np.full(self.model.nq, math.inf)
        """Angles at the last check; infinite: there was none since the arm was put elsewhere."""
        # As bytes the angles are compared in a tenth of a microsecond.
        self._bytes = self._qpos.data.cast("B"), self._angles.data.cast("B")
        take, state = SameTypes(_take_state), (self._qpos, self._qvel, self._n_warnings, self._dt)
        take.call(*state, self._angles.copy())  # compiled before the first frame
        self._take_state = partial(take.call, *state, self._angles)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    def reset(self, qpos: Sequence[float] | FloatArray) -> None:
        """Start again at time 0, at rest in a joint configuration, where the hand then is too.

        Other arms are where they start.

        Args:
            qpos: Angles of its joints [rad], or where they slide to [m], shape (n_joints,).

        Raises:
            ValueError: not as many finite numbers, or one beyond its joint's range.
        """
        angles, n = np.array(qpos, np.float64), self._n_own
        if angles.shape != (n,) or not np.isfinite(angles).all():
            raise ValueError(f"qpos is {angles.tolist()}; it must be {n} finite angles [rad]")
        low, high = self.ranges()
        if ((angles < low) | (angles > high)).any():
            i = int(np.argmax((angles < low) | (angles > high)))
            raise ValueError(
                f"joint '{self.joints[i]}' is set to {angles[i]:.3f} rad; its range is "
                f"{low[i]:.3f} to {high[i]:.3f}"
            )
        mujoco.mj_resetData(self.model, self.data)
        self._angles[:] = math.inf
        self.data.qpos[:] = np.concatenate([angles, *(other.qpos for other in self.others)])
        mujoco.mj_kinematics(self.model, self.data)
        self.hand.hold(self.blade.segment())
        for grasper in self.graspers:
            grasper.hold()
        mujoco.mj_forward(self.model, self.data)

    def ranges(self) -> tuple[FloatArray, FloatArray]:
        """Return the ends of the range of each of its joints; infinite where unlimited."""
        limited = self.model.jnt_limited[: self._n_own].astype(bool)
        low, high = self.model.jnt_range[: self._n_own].T
        return np.where(limited, low, -np.inf), np.where(limited, high, np.inf)

    def step1(self) -> None:
        """Do the first half of a step: afterwards the blade is where the joints say."""
        mujoco.mj_step1(self.model, self.data)

    def step2(self) -> None:
        """Do the second half of a step, with the wrench that is applied to the blade."""
        mujoco.mj_step2(self.model, self.data)

    def check(self) -> None:
        """Refuse to continue from a bad state. For every frame: it costs some 0.5 us.

        MuJoCo's own answer, a silent reset to the start, is switched off in the model.

        Raises:
            ArmError: a joint's angle or speed is not finite, it turns by more than
                `LARGEST_JOINT_STEP` in a step, or MuJoCo has warned.
        """
        if not self._take_state():
            self._refuse_state()

    def check_if_set(self) -> None:
        """Check the state again if its angles are not those of the last check: others set them.

        Raises:
            ArmError: see `check`.
        """
        now, before = self._bytes
        if now != before:
            self.check()

    def _refuse_state(self) -> NoReturn:
        """Raise the error of a bad state."""
        data, model = self.data, self.model
        if not math.isfinite(sum(self._qpos.tolist()) + sum(self._qvel.tolist())):
            bad = ~(np.isfinite(data.qpos) & np.isfinite(data.qvel))
            names = ", ".join(np.array(self.joints)[bad]) or "all, by overflow"
            raise ArmError(
                f"at t = {data.time:.4f} s the arm's state is not finite (joints: {names})"
            )
        turned, self._angles[:] = self._qpos - self._angles, self._qpos
        turned[np.isinf(turned)] = 0.0
        if np.abs(self._qvel).max(initial=0.0) * self._dt > LARGEST_JOINT_STEP:
            self._refuse_motion(self._dt * data.qvel, model.dof_jntid)
        if np.abs(turned).max(initial=0.0) > LARGEST_JOINT_STEP:
            n_numbers = np.diff(model.jnt_qposadr, append=model.nq)
            self._refuse_motion(turned, np.repeat(np.arange(model.njnt), n_numbers))
        kind = mujoco.mjtWarning(int(np.argmax(self._n_warnings)))
        text = mujoco.mju_warningText(kind, int(data.warning.lastinfo[kind]))
        raise ArmError(f"at t = {data.time:.4f} s MuJoCo warned: {text}")

    def _refuse_motion(self, ways: FloatArray, joints: FloatArray) -> NoReturn:
        """Raise the error of a joint that moves too far in a step.

        Args:
            ways: How far each number of the state moves in it.
            joints: The joint of each.
        """
        i = int(np.argmax(np.abs(ways)))
        raise ArmError(
            f"at t = {self.data.time:.4f} s joint '{self.joints[joints[i]]}' moves by "
            f"{ways[i]:.3g} rad, or m, in a step of {self._dt:g} s; at most "
            f"{LARGEST_JOINT_STEP:g} makes sense. Something pushed the arm, or set its "
            "state: `reset` puts it elsewhere"
        )


@kernel
def _take_state(
    angles: FloatArray, speeds: FloatArray, n_warnings: IntArray, dt: float, before: FloatArray
) -> bool:
    """Take the state of a step; return False, and do nothing, where `check` refuses it.

    Args:
        angles: Angles of the joints [rad], or how far they slide [m].
        speeds: Their speeds.
        n_warnings: How often MuJoCo has warned, by kind.
        dt: Length of the step [s].
        before: Angles at the last check, or infinity; they become the present ones.
    """
    # A sum is finite only if all its parts are.
    total_angle, total_speed = 0.0, 0.0
    for i in range(len(angles)):
        total_angle += angles[i]
    for i in range(len(speeds)):
        total_speed += speeds[i]
    is_good = math.isfinite(total_angle + total_speed)
    for i in range(len(speeds)):
        is_good = is_good and not abs(speeds[i]) * dt > LARGEST_JOINT_STEP
    for i in range(len(angles)):
        is_good = is_good and not LARGEST_JOINT_STEP < abs(angles[i] - before[i]) < math.inf
    for i in range(len(n_warnings)):
        is_good = is_good and n_warnings[i] == 0
    if not is_good:
        return False
    for i in range(len(angles)):
        before[i] = angles[i]
    return True


class Arm(DrivenArm):
    """One of the project's arms, its blade, and the virtual hand that leads it. World frame.

    Args:
        preset: One of `ARMS`.
        blade_length: From heel to tip [m].
        mount_angle: Between stylus, or jaws, and blade [rad]: at 0 the blade continues in their
            direction, at pi/2 it points to their +z.
        base_position: Middle of the base's underside, or the remote centre [m].
        base_yaw: Angle by which the base is turned about +z [rad]; at 0 the arm reaches towards +y.
        impedance: How firmly the hand holds the blade.
        others: What else stands in its world: arms, each with a grasper, a table, fixtures.

    Raises:
        UsageError: no preset has this name.
    """

    def __init__(
        self,
        preset: str = "touch",
        *,
        blade_length: float = 0.04,
        mount_angle: float = 0.0,
        base_position: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
        base_yaw: float = 0.0,
        impedance: Impedance = Impedance(),
        others: Sequence[Standing] = (),
    ) -> None:
        if preset not in ARMS:
            raise unknown("arm", preset, ARMS)
        spec = preset_spec(preset)
        put_base(spec, np.array(base_position, np.float64), base_yaw)
        _make_blade(spec, blade_length, mount_angle)
        home = np.array(spec.key("home").qpos)
        super().__init__(spec, preset, ARMS[preset], impedance, others=others)
        self.reset(home)


def preset_spec(preset: str) -> mujoco.MjSpec:
    """Return the model of a preset, yet to be compiled."""
    return mujoco.MjSpec.from_file(str(ASSETS / f"{preset}.xml"))


def put_base(spec: mujoco.MjSpec, position: FloatArray, yaw: float) -> None:
    """Move the arm, and add a column below a base that should stand on the table and does not."""
    base = spec.body("base")
    base.pos = position
    base.quat = [math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]
    if position[2] > 0.0 and spec.modelname != PSM:
        base.add_geom(
            name="pedestal",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[0.05, position[2] / 2.0, 0.0],
            pos=[0.0, 0.0, -position[2] / 2.0],
        )


def _make_blade(spec: mujoco.MjSpec, length: float, mount_angle: float) -> None:
    """Give the blade its length, the mass that follows from it, and its angle to the stylus."""
    blade = spec.body("blade")
    blade.quat = [math.cos(mount_angle / 2.0), math.sin(mount_angle / 2.0), 0.0, 0.0]
    size = np.array([BLADE_THICKNESS, length, BLADE_HEIGHT])
    blade.mass = _STEEL * size.prod()
    blade.inertia = blade.mass / 12.0 * ((size**2).sum() - size**2)
    blade.ipos = [0.0, length / 2.0, 0.0]
    sheet = spec.geom("blade")
    sheet.size = size / 2.0
    sheet.pos = [0.0, length / 2.0, 0.0]
    spec.site("tip").pos = [0.0, length, spec.site("heel").pos[2]]


def route_warnings() -> None:
    """Send MuJoCo's warnings to the logger `scalpel_sim`.

    By itself MuJoCo appends them to MUJOCO_LOG.TXT in the working directory. A handler that is
    already set stays.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_log_warning)


def _log_warning(text: str) -> None:
    _log.warning("MuJoCo: %s", text)
