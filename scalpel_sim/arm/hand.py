"""A virtual hand: a six-dimensional spring and damper that leads a blade along a path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.blade import no_such
from scalpel_sim.arm.free_names import free_prefix
from scalpel_sim.quaternions import (
    Matrix,
    Quaternion,
    Vector,
    inverse,
    quaternion_of,
    rotated,
    turn_between,
)
from tissue import BladeSegment, FloatArray
from tissue.support import kernel

_HAND = "hand"
"""Name of the body that shows where the hand wants the middle of the edge, and of its site."""
_EDGE = "edge"
"""Name of the site in the middle of the edge, where the hand holds the blade."""
_ACTUATORS = ("hand_x", "hand_y", "hand_z", "hand_turn")
_NAMES = {
    "bodies": [_HAND],
    "geoms": [_HAND],
    "sites": [_HAND, _EDGE],
    "actuators": _ACTUATORS,
}
"""Names of what a hand adds to a model, after a prefix with which they are free."""


@dataclass(frozen=True)
class Impedance:
    """Impedance of the hand at the blade.

    The centre of the springs is the middle of the cutting edge, as in Cartesian impedance control
    at the tool's centre point: a force F there moves the blade by F / stiffness and does not turn
    it. The defaults are those of a firm robotic hand, not of a human one (which has some
    0.3 to 1 kN/m): they hold an edge that is pushed with 8 N to 1.6 mm. They are integrated
    implicitly, and stay stable against tissue of 10 kN/m whose force returns within the step.

    Raises:
        ValueError: a quantity is not finite, or not positive.
    """

    stiffness: float = 5e3
    """Stiffness against displacement [N/m]."""
    damping: float = 40.0
    """Damping of displacement [N s/m]; about critical for the 70 g that the hand feels."""
    rotational_stiffness: float = 10.0
    """Stiffness against turning [N m/rad]."""
    rotational_damping: float = 0.15
    """Damping of turning [N m s/rad]; about critical for 70 g at 8 cm from the edge's middle."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"the hand's {field.name} is {value}; it must be positive")


def add_hand(
    spec: mujoco.MjSpec,
    impedance: Impedance = Impedance(),
    heel: str = "heel",
    tip: str = "tip",
    forward: Sequence[float] = (0.0, 0.0, -1.0),
) -> str:
    """Add a hand that holds the blade between two sites of a model that is yet to be compiled.

    Afterwards `Hand(model, data, prefix)` moves it.

    Args:
        spec: Has the two sites, on one body. It gains a mocap body, two sites and four actuators,
            and MuJoCo's `discrete` integrator, which takes springs of actuators implicitly.
        impedance: How firm the hand is.
        heel: Site at the handle's end of the edge.
        tip: Site at the sharp end.
        forward: Direction in which the edge cuts, in the frame of its body.

    Returns:
        The prefix of its names: empty where the model has none of them itself.

    Raises:
        ValueError: the model has no such site.
    """
    for name in (heel, tip):
        if spec.site(name) is None:
            raise ValueError(no_such("site", name, (site.name for site in spec.sites)))
    ends = np.array(spec.site(heel).pos), np.array(spec.site(tip).pos)
    along = tuple((ends[1] - ends[0]).tolist())
    quaternion = quaternion_of(_axes(along, _numbers(np.array(forward, np.float64))))
    prefix = free_prefix(spec, _NAMES)
    edge, name = prefix + _EDGE, prefix + _HAND
    spec.site(tip).parent.add_site(name=edge, pos=(ends[0] + ends[1]) / 2.0, quat=quaternion)
    hand = spec.worldbody.add_body(name=name, mocap=True)
    hand.add_site(name=name)
    hand.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[0.003, 0.0, 0.0],
        rgba=[1.0, 0.6, 0.2, 0.5],
        contype=0,
        conaffinity=0,
        group=3,  # hidden unless requested
    )
    *springs, turn = (
        # Each acts on the middle of the edge as seen from the hand.
        spec.add_actuator(
            name=prefix + each, trntype=mujoco.mjtTrn.mjTRN_SITE, target=edge, refsite=name
        )
        for each in _ACTUATORS
    )
    for axis, spring in enumerate(springs):
        spring.gear = np.eye(6)[axis]
        spring.gainprm[0] = impedance.stiffness
        spring.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        spring.biasprm[:3] = 0.0, -impedance.stiffness, -impedance.damping
    turn.set_to_orientation(impedance.rotational_stiffness, impedance.rotational_damping)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    return prefix


class HandCommand(NamedTuple):
    """Target of a hand: its place, and its velocity."""

    position: FloatArray
    """Where the middle of the edge is to be [m], world frame, shape (3,)."""
    quaternion: FloatArray
    """Rotation of the hand (w, x, y, z), whose +y is along the edge and whose -z cuts."""
    control: FloatArray
    """Offsets that the dampers of the actuators need at this speed, in the frame of the hand:
    motion [m] and turning [rad], shape (6,)."""
    leads: FloatArray
    """Damping over stiffness and length of a step, of motion and of turning, shape (2,)."""


class Hand:
    """Moves a hand that `add_hand` put into the model.

    Args:
        model: A compiled model.
        data: Its data.
        prefix: What its names begin with: what `add_hand` returned, after that of its arm.

    Raises:
        KeyError: the model has no hand.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, prefix: str = "") -> None:
        mocap = int(model.body(prefix + _HAND).mocapid[0])
        self.actuators = [model.actuator(prefix + name).id for name in _ACTUATORS]
        """MuJoCo's numbers of its actuators: three move the edge, one turns it."""
        self.edge = model.site(prefix + _EDGE).id
        """MuJoCo's number of the site in the middle of the edge."""
        first, turn = self.actuators[0], self.actuators[3]
        controls = int(model.actuator_ctrladr[first])
        outputs = int(model.actuator_outadr[first])
        self._position = data.mocap_pos[mocap]
        self._quaternion = data.mocap_quat[mocap]
        self._control = data.ctrl[controls : controls + 6]
        self._output = data.actuator_force[outputs : outputs + 6]
        self._edge = data.site_xpos[self.edge]
        bias, dt = model.actuator_biasprm, model.opt.timestep
        of_motion, of_turning = (bias[i, 2] / bias[i, 1] / dt for i in (first, turn))
        self.command = HandCommand(
            self._position, self._quaternion, self._control, np.array((of_motion, of_turning))
        )
        """Target of the hand: views of MuJoCo's arrays."""
        self._is_held = False

    def hold(self, pose: BladeSegment) -> None:
        """Lead the blade to rest at `pose`, world frame: where a path begins, or jumps."""
        self._is_held = False
        self.follow(pose)

    def follow(self, pose: BladeSegment) -> None:
        """Lead the blade to `pose`, moving as the pose has moved since the last call, a step ago.

        The dampers resist motion relative to the path, not to the world: without that the blade
        would lag by speed x damping / stiffness, 0.5 mm at 60 mm/s.

        Args:
            pose: World frame. Its length does not matter; its middle and its directions do.

        Raises:
            ValueError: the pose is not finite.
        """
        tip, heel, forward = map(_numbers, pose)
        if not lead_to(tip, heel, forward, *self.command):
            raise ValueError(f"the hand cannot follow a pose that is not finite: {pose}")
        if not self._is_held:
            self._control[:] = 0.0
        self._is_held = True

    @property
    def deflection(self) -> FloatArray:
        """Displacement of the middle of the edge from its target [m], world frame, shape (3,)."""
        return np.asarray(self._edge - self._position)

    @property
    def force(self) -> FloatArray:
        """Force of the hand on the blade in the last step [N], world frame, shape (3,)."""
        force = np.empty(3)
        mujoco.mju_rotVecQuat(force, self._output[:3], self._quaternion)
        return force


def _numbers(vector: FloatArray) -> Vector:
    x, y, z = vector
    return float(x), float(y), float(z)


@kernel
def lead_to(
    tip: Vector,
    heel: Vector,
    forward: Vector,
    position: FloatArray,
    quaternion: FloatArray,
    control: FloatArray,
    leads: FloatArray,
) -> bool:
    """Follow as `Hand.follow` does; return False, and do nothing, where the pose is not finite.

    Args:
        tip: Tip of the blade [m], world frame.
        heel: Heel of the blade [m].
        forward: Direction in which it cuts.
        position: See `HandCommand`, as the rest.
        quaternion: Rotation of the hand.
        control: Offsets of the actuators.
        leads: Their factors.
    """
    tx, ty, tz = tip
    hx, hy, hz = heel
    x, y, z = (tx + hx) / 2.0, (ty + hy) / 2.0, (tz + hz) / 2.0
    wanted = quaternion_of(_axes((tx - hx, ty - hy, tz - hz), forward))
    w, qx, qy, qz = wanted
    if not math.isfinite(x + y + z + (w + qx + qy + qz)):
        return False
    lead, turning_lead = leads[0], leads[1]
    px, py, pz = position[0], position[1], position[2]
    offset = ((x - px) * lead, (y - py) * lead, (z - pz) * lead)
    moving = rotated(offset, inverse(wanted))
    before = (quaternion[0], quaternion[1], quaternion[2], quaternion[3])
    turning = turn_between(before, wanted)
    control[0], control[1], control[2] = moving
    control[3] = turning[0] * turning_lead
    control[4] = turning[1] * turning_lead
    control[5] = turning[2] * turning_lead
    position[0], position[1], position[2] = x, y, z
    quaternion[0], quaternion[1], quaternion[2], quaternion[3] = wanted
    return True


@kernel
def edge_rotation(
    edge: tuple[float, float, float, float, float, float, float, float, float],
) -> Quaternion:
    """Return the rotation of an edge (w, x, y, z): NaN without an edge.

    Args:
        edge: Tip [m], heel [m], and the direction in which it cuts.
    """
    tx, ty, tz, hx, hy, hz, fx, fy, fz = edge
    return quaternion_of(_axes((tx - hx, ty - hy, tz - hz), (fx, fy, fz)))


@kernel
def _axes(edge: Vector, forward: Vector) -> Matrix:
    """Return a matrix whose +y is along the edge and whose -z cuts: NaN without an edge."""
    ex, ey, ez = edge
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    if not length > 0.0:
        length = math.nan
    ex, ey, ez = ex / length, ey / length, ez / length
    fx, fy, fz = forward
    along = fx * ex + fy * ey + fz * ez
    zx, zy, zz = along * ex - fx, along * ey - fy, along * ez - fz
    size = math.sqrt(zx * zx + zy * zy + zz * zz)
    zx, zy, zz = zx / size, zy / size, zz / size
    return (ey * zz - ez * zy, ex, zx, ez * zx - ex * zz, ey, zy, ex * zy - ey * zx, ez, zz)
