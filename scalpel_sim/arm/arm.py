"""A PHANTOM-like arm of six joints that holds a scalpel, simulated by MuJoCo."""

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bridge import DeviceLimits
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.led_arm import LedArm
from scalpel_sim.arm.standing import Standing
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

BLADE_HEIGHT, BLADE_THICKNESS, _STEEL = 6e-3, 0.4e-3, 7800.0
"""Height [m], thickness [m] and density [kg/m3] of a no. 11 scalpel blade."""


class Arm(LedArm):
    """A PHANTOM-like arm, its blade, and the virtual hand that leads it. World frame.

    Args:
        preset: One of `ARMS`.
        blade_length: From heel to tip [m].
        mount_angle: Between stylus and blade [rad]: at 0 the blade goes on in the stylus's
            direction, at pi/2 it points to the stylus's +z.
        base_position: Middle of the base's underside [m].
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
