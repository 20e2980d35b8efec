"""A PHANTOM-like arm of six joints that holds a scalpel, simulated by MuJoCo."""

import logging
import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bridge import DeviceLimits
from scalpel_sim.arm.blade import Blade
from scalpel_sim.arm.hand import Hand, Impedance, add_hand
from scalpel_sim.errors import unknown
from tissue import FloatArray

ASSETS = Path(__file__).parent / "assets"

ARMS = {
    "touch": DeviceLimits(force=3.3, torque=0.33),
    "premium": DeviceLimits(force=8.5, torque=0.188),
}
"""The arms, smallest first, and the largest force and torque that each can render.

Forces, and the torque of the Premium 1.5 with its six motors: CHAI3D, CPhantomDevices.cpp, after
the vendor's data sheets. The gimbal of the Touch has no motors: the hand alone resists a torque, so
no limit of the device belongs here. 0.33 N m is 3.3 N on a lever of 10 cm, the length of a scalpel.
"""

JOINTS = ("waist", "shoulder", "elbow", "yaw", "pitch", "roll")

BLADE_HEIGHT, BLADE_THICKNESS, _STEEL = 6e-3, 0.4e-3, 7800.0
"""Height [m], thickness [m] and density [kg/m3] of a no. 11 scalpel blade."""

_log = logging.getLogger("scalpel_sim")


class ArmError(RuntimeError):
    """MuJoCo's state can no longer be trusted: the arm must stop."""


class Arm:
    """An arm, its blade, and the virtual hand that leads it. World frame.

    A frame is `step1`, then `blade.segment` and `blade.apply`, then `step2` and `check`.

    Args:
        preset: One of `ARMS`.
        blade_length: From heel to tip [m].
        mount_angle: Between stylus and blade [rad]: at 0 the blade goes on in the stylus's
            direction, at pi/2 it points to the stylus's +z.
        base_position: Middle of the base's underside [m].
        base_yaw: Angle by which the base is turned about +z [rad]; at 0 the arm reaches towards +y.
        impedance: How firmly the hand holds the blade.

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
    ) -> None:
        if preset not in ARMS:
            raise unknown("arm", preset, ARMS)
        route_warnings()
        spec = mujoco.MjSpec.from_file(str(ASSETS / f"{preset}.xml"))
        _put_base(spec, np.array(base_position, np.float64), base_yaw)
        _make_blade(spec, blade_length, mount_angle)
        add_hand(spec, impedance)
        self.preset = preset
        self.limits = ARMS[preset]
        self.model = spec.compile()
        """MuJoCo's model."""
        self.data = mujoco.MjData(self.model)
        """MuJoCo's data."""
        self.blade = Blade(self.model, self.data)
        self.hand = Hand(self.model, self.data)
        # Views of MuJoCo's arrays: they stay valid for the life of `data`.
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._n_warnings = self.data.warning.number
        self.reset(self.model.key("home").qpos)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    def reset(self, qpos: Sequence[float] | FloatArray) -> None:
        """Start again at time 0, at rest in a joint configuration, where the hand then is too.

        Args:
            qpos: Angles of `JOINTS` [rad], shape (6,).

        Raises:
            ValueError: not six finite angles, or one beyond its joint's range.
        """
        angles = np.array(qpos, np.float64)
        if angles.shape != (len(JOINTS),) or not np.isfinite(angles).all():
            raise ValueError(
                f"qpos is {angles.tolist()}; it must be {len(JOINTS)} finite angles [rad]"
            )
        low, high = self.model.jnt_range.T
        if ((angles < low) | (angles > high)).any():
            i = int(np.argmax((angles < low) | (angles > high)))
            raise ValueError(
                f"joint '{JOINTS[i]}' is set to {angles[i]:.3f} rad; its range is {low[i]:.3f} to "
                f"{high[i]:.3f}"
            )
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = angles
        mujoco.mj_kinematics(self.model, self.data)
        self.hand.hold(self.blade.segment())
        mujoco.mj_forward(self.model, self.data)

    def step1(self) -> None:
        """Do the first half of a step: afterwards the blade is where the joints say."""
        mujoco.mj_step1(self.model, self.data)

    def step2(self) -> None:
        """Do the second half of a step, with the wrench that is applied to the blade."""
        mujoco.mj_step2(self.model, self.data)

    def check(self) -> None:
        """Refuse to continue from a bad state. For every frame: it costs some 1 us.

        MuJoCo's own answer, a silent reset to the start, is switched off in the model.

        Raises:
            ArmError: a joint's angle or speed is not finite, or MuJoCo has warned.
        """
        data = self.data
        # A sum is finite only if all its parts are, and costs less than asking each.
        if not math.isfinite(sum(self._qpos.tolist()) + sum(self._qvel.tolist())):
            bad = ~(np.isfinite(data.qpos) & np.isfinite(data.qvel))
            names = ", ".join(np.array(JOINTS)[bad]) or "all, by overflow"
            raise ArmError(
                f"at t = {data.time:.4f} s the arm's state is not finite (joints: {names})"
            )
        if any(self._n_warnings.tolist()):
            kind = mujoco.mjtWarning(int(np.argmax(self._n_warnings)))
            text = mujoco.mju_warningText(kind, int(data.warning.lastinfo[kind]))
            raise ArmError(f"at t = {data.time:.4f} s MuJoCo warned: {text}")


def route_warnings() -> None:
    """Send MuJoCo's warnings to the logger `scalpel_sim`.

    By itself MuJoCo appends them to MUJOCO_LOG.TXT in the working directory. A handler that is
    already set stays.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_log_warning)


def _log_warning(text: str) -> None:
    _log.warning("MuJoCo: %s", text)


def _put_base(spec: mujoco.MjSpec, position: FloatArray, yaw: float) -> None:
    """Move the arm, and add a column below a base that does not stand on the table."""
    base = spec.body("base")
    base.pos = position
    base.quat = [math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]
    if position[2] > 0.0:
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
