"""A surgical grasper: two jaws on a shaft, and the arm that holds it next to another arm."""

from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_prefix, names_in
from scalpel_sim.arm.hand import Hand
from scalpel_sim.arm.mounting import Place, attach_at
from scalpel_sim.arm.standing import collide_as_one_arm
from tissue import BladeSegment, FloatArray, Wrench

_FILE = Path(__file__).parent / "assets" / "grasper.xml"

GRASPER = "grasper_"
"""Prefix of the names of its parts in the model of its arm, where those are free."""

PADS_HEEL, PADS_TIP = "heel", "tip"
"""Sites where the pads begin and end, after that prefix: a hand holds it half way between them."""

_JAWS = ("jaw_low", "jaw_high")
"""Joints of its jaws, and their bodies."""

SHAFT_LENGTH = 0.0715
"""From where an arm holds it to the middle of the pads [m]."""

SHORT_SHAFT = 0.025
"""Likewise where it takes the place of jaws at the end of a shaft [m]: short enough for a wrist."""

PAD_LENGTH = 0.015
"""Length of a pad, along the shaft [m]."""

HALF_PAD = 0.5 * PAD_LENGTH
"""From the middle between the pads to either end of them [m]."""

FORWARD = (0.0, 0.0, -1.0)
"""Direction that a blade calls forward, in the frame of the shaft: across the shaft and across the
way of the jaws. A grasper is led as a blade is."""

_ROUNDING = 1e-9
"""Force that may be left of one that came and went [N]: some 1e-18, where tissue pushes with some
1e-3."""

_PARTS = ("shaft", *_JAWS)
"""Names of the bodies of a grasper."""

_ALONG_FLANGE = (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)
"""Rotation that has the shaft, +y, point along +z."""

_OPTIONS = tuple(name for name in dir(mujoco.MjSpec().option) if not name.startswith("_"))


class GrasperError(ValueError):
    """The model has no such place for a grasper."""


class Pads(NamedTuple):
    """The space between the pads: a box in the frame of the shaft, where it is now."""

    centre: FloatArray
    """Where the site `pinch` is [m], world frame, shape (3,)."""
    axes: FloatArray
    """Axes as columns: across from pad to pad, along the shaft, and across both; shape (3, 3)."""
    half_size: FloatArray
    """Half the opening, half the length of a pad, half its width [m], shape (3,)."""


def add_grasper(spec: mujoco.MjSpec, at: Place, *, force: float | None = None) -> str:
    """Attach a grasper to a site, a body or a frame of a model, with its shaft along the +z there.

    That is how the flanges of robots point. The actuator `grasper_jaws` opens the jaws [m]; where
    the model has one of the names of its parts, all of them get another prefix.

    Args:
        spec: A model that is yet to be compiled.
        at: The site, body or frame, or its name; the shaft begins at its origin.
        force: Largest force of the jaws [N]; None: that of `grasper.xml`.

    Returns:
        The prefix of the names of its parts, for `Grasper`: `grasper_` where all are free.

    Raises:
        GrasperError: the model has no such place.
    """
    grasper = grasper_spec(spec, force)
    grasper.body("shaft").quat = _ALONG_FLANGE
    prefix = free_prefix(spec, names_in(grasper), GRASPER)
    attach_at(spec, grasper, at, prefix, GrasperError)
    return prefix


def grasper_spec(
    spec: mujoco.MjSpec, force: float | None = None, length: float = SHAFT_LENGTH
) -> mujoco.MjSpec:
    """Return a grasper, to be attached to a model with the prefix `GRASPER`.

    Its shaft points along +y.

    Args:
        spec: That model.
        force: Largest force of the jaws [N]; None: that of `grasper.xml`.
        length: From where an arm holds it to the middle of the pads [m].
    """
    grasper = mujoco.MjSpec.from_file(str(_FILE))
    take_options(grasper, spec)
    cut_off = SHAFT_LENGTH - length
    grasper.body("shaft").pos = [0.0, -cut_off, 0.0]
    shaft = grasper.geom("shaft")
    shaft.fromto = shaft.fromto + np.array([0.0, cut_off, 0.0, 0.0, 0.0, 0.0])
    if force is not None:
        grasper.actuator("jaws").forcerange = [-force, force]
    return grasper


class Grasper:
    """A grasper of a compiled model. World frame.

    Args:
        model: The model.
        data: Its data.
        prefix: What the names of its parts begin with: what `add_grasper` returned.

    Raises:
        KeyError: the model has no such grasper.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, prefix: str = GRASPER) -> None:
        self.body = f"{prefix}shaft"
        """Name of the body that carries shaft and jaws."""
        self.bodies = tuple(prefix + part for part in _PARTS)
        """Names of all its bodies."""
        bodies = [model.body(body).id for body in self.bodies]
        pinch = model.site(f"{prefix}pinch").id
        joints = [model.joint(prefix + jaw) for jaw in _JAWS]
        servo = int(model.actuator_ctrladr[model.actuator(f"{prefix}jaws").id])
        _, length, width = model.geom(f"{prefix}pad_low").size
        self._half_pad = float(length), float(width)
        # Views of MuJoCo's arrays: they stay valid for the life of `data`.
        self._jaws = [data.qpos[joint.qposadr[0] : joint.qposadr[0] + 1] for joint in joints]
        self._control = data.ctrl[servo : servo + 1]
        self._pinch: FloatArray = data.site_xpos[pinch]
        self._axes = data.xmat[bodies[0]].reshape(3, 3)
        self._applied = [data.xfrc_applied[i] for i in bodies]
        self._centres = [data.xipos[i] for i in bodies]

    @property
    def opening(self) -> float:
        """Distance between the pads [m]."""
        return float(self._jaws[0][0] + self._jaws[1][0])

    def open_to(self, opening: float) -> None:
        """Open or close the jaws to a distance between the pads [m], with limited force."""
        self._control[0] = opening

    @property
    def wanted_opening(self) -> float:
        """Distance between the pads to which the jaws are led [m]."""
        return float(self._control[0])

    def put_to(self, opening: float) -> None:
        """Put the jaws, at once, where the distance between the pads is that [m]."""
        for jaw in self._jaws:
            jaw[0] = 0.5 * opening

    @property
    def pads(self) -> Pads:
        """The space between the pads, as it is now. Copies."""
        half = np.array([0.5 * self.opening, *self._half_pad])
        return Pads(self._pinch.copy(), self._axes.copy(), half)

    @property
    def is_pushed_apart(self) -> bool:
        """Whether something between the pads pushes both jaws outwards."""
        across = self._axes[:, 0]
        _, low, high = (float(applied[:3] @ across) for applied in self._applied)
        return low < -_ROUNDING and high > _ROUNDING

    @property
    def wrench(self) -> Wrench:
        """Sum of all wrenches that are applied to shaft and jaws, about the site `pinch`.

        Those are what tissue does to it, however it is held (`xfrc_applied`).
        """
        force, torque = np.zeros(3), np.zeros(3)
        for applied, centre in zip(self._applied, self._centres, strict=True):
            force += applied[:3]
            torque += Wrench(applied[:3], applied[3:], centre).about(self._pinch).torque
        return Wrench(force, torque, self._pinch.copy())


class GuidedGrasper(Grasper):
    """A grasper that a virtual hand leads; `hand.add_hand` put it into the model.

    Args:
        model: The model.
        data: Its data.
        prefix: See `Grasper`.
        of_hand: What the names of its hand begin with: what `hand.add_hand` returned.

    Raises:
        KeyError: the model has no such grasper, or no hand that leads it.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        prefix: str = GRASPER,
        of_hand: str = "",
    ) -> None:
        super().__init__(model, data, prefix)
        self.hand = Hand(model, data, of_hand)

    def hold(self) -> None:
        """Lead it to rest where it is, as far open as it is: where a motion begins."""
        along, forward = self._axes[:, 1], self._axes @ np.array(FORWARD)
        half = self._half_pad[0] * along
        self.hand.hold(BladeSegment(self._pinch + half, self._pinch - half, forward))
        self.open_to(self.opening)


class HeldArm(NamedTuple):
    """An arm with a grasper, which stands in the world of another arm."""

    name: str
    """Name of the grasper."""
    spec: mujoco.MjSpec
    """Model of the arm with the hand that leads the grasper, yet to be compiled."""
    qpos: FloatArray
    """Configuration of the arm at the start [rad, m], that of the jaws last."""
    position: FloatArray
    """Where the origin of its model is in the world [m], shape (3,)."""
    quaternion: FloatArray
    """Rotation of the model there (w, x, y, z)."""
    of_hand: str
    """Prefix of the names of its hand in its model."""
    of_grasper: str = GRASPER
    """Prefix of the names of its grasper in its model."""
    workspace: FloatArray | None = None
    """Lowest and highest place where a hand may lead the middle of the pads [m], tissue frame,
    shape (2, 3); None: it follows a script."""

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled.

        What its own world has to look at, planes and lights, is left out, and so are keyframes:
        in a model of more joints they have too few numbers. It collides with the other arms.

        Returns:
            What the names of its parts begin with there: its own name, where that is free.

        Raises:
            ValueError: there are too many arms.
        """
        for key in list(spec.keys):
            spec.delete(key)
        own = self.spec.copy()
        take_options(own, spec)
        for geom in list(own.worldbody.geoms):
            if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
                own.delete(geom)
        for part in (*own.worldbody.lights, *own.keys):
            own.delete(part)
        own.nkey = spec.nkey
        collide_as_one_arm(own, spec)
        place = spec.worldbody.add_frame(pos=self.position, quat=self.quaternion)
        prefix = free_prefix(spec, names_in(own), f"{self.name}_")
        spec.attach(own, prefix=prefix, frame=place)
        return prefix

    def grasper(self, model: mujoco.MjModel, data: mujoco.MjData, prefix: str) -> GuidedGrasper:
        """Return its grasper in the compiled model of the run.

        Args:
            model: That model.
            data: Its data.
            prefix: What `stand_in` returned.
        """
        return GuidedGrasper(model, data, prefix + self.of_grasper, prefix + self.of_hand)


def take_options(spec: mujoco.MjSpec, whole: mujoco.MjSpec) -> None:
    """Give a model the options of the whole that it is to be a part of.

    MuJoCo keeps those of the whole in any case, and warns where the part has others.
    """
    for name in _OPTIONS:
        setattr(spec.option, name, getattr(whole.option, name))
