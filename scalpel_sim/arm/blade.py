"""A blade on any MuJoCo arm: two sites become a segment, a wrench pushes their body."""

import difflib
import math
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Literal

import mujoco
import numpy as np

from bridge import MAX_PLAUSIBLE_FORCE, MAX_PLAUSIBLE_TORQUE
from tissue import BladeSegment, FloatArray, Wrench
from tissue.support import SameTypes, kernel

_SHORTEST_EDGE = 1e-4
"""Shortest cutting edge [m]. A shorter one is a mistake in the model: its direction is noise."""

_SURELY_PLAUSIBLE = 0.999
"""Share of the largest plausible force and torque up to which a kernel may apply a wrench: its
rounding differs from that of the exact test by 1e-15."""

SixNumbers = tuple[float, float, float, float, float, float]
_Nine = tuple[float, float, float, float, float, float, float, float, float]


class BladeError(ValueError):
    """The model has no such blade, or the blade was handed a wrench that no tissue can exert."""


class Blade:
    """The cutting edge of a body of a MuJoCo model: its pose is read, a wrench applied.

    Works on any model: name the two sites at the ends of the edge. Call `segment` and `apply`
    between `mj_step1` and `mj_step2`: there the sites are where `qpos` says (after a plain
    `mj_step` they lag by a step), and the wrench is felt in the same step.

    Args:
        model: A compiled model.
        data: Its data. Both are kept, so that the blade follows them.
        heel: Site at the end of the edge that is nearest the handle.
        tip: Site at the sharp end.
        body: The body that carries both sites, and feels the wrench. None: the one they sit on.
        forward: The direction in which the edge cuts, in the frame of the body; made orthogonal to
            the edge.

    Raises:
        BladeError: a name that the model does not have; sites on different bodies; a body that
            cannot move; an edge of no length; a `forward` along the edge.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        heel: str = "heel",
        tip: str = "tip",
        body: str | None = None,
        forward: Sequence[float] = (0.0, 0.0, -1.0),
    ) -> None:
        heel_id = number_in(model, "site", heel)
        tip_id = number_in(model, "site", tip)
        body_id = int(model.site_bodyid[tip_id])
        if body is not None:
            body_id = number_in(model, "body", body)
        for site, site_id in ((heel, heel_id), (tip, tip_id)):
            if model.site_bodyid[site_id] != body_id:
                raise BladeError(
                    f"site '{site}' sits on body '{model.body(model.site_bodyid[site_id]).name}', "
                    f"not on '{model.body(body_id).name}'; both ends of the edge and the body that "
                    "feels the wrench must be one"
                )
        if model.body_weldid[body_id] == 0 and model.body_mocapid[body_id] < 0:
            raise BladeError(f"body '{model.body(body_id).name}' is welded to the world: no blade")
        edge = np.array(model.site_pos[tip_id] - model.site_pos[heel_id])
        self.length = float(np.linalg.norm(edge))
        """From heel to tip [m]."""
        if self.length < _SHORTEST_EDGE:
            raise BladeError(
                f"sites '{heel}' and '{tip}' are {self.length:.1e} m apart; an edge needs at least "
                f"{_SHORTEST_EDGE} m"
            )
        self.body_id = body_id
        """MuJoCo's number for the body that feels the wrench."""
        self._forward = _across(edge / self.length, np.array(forward, np.float64))
        # Views of MuJoCo's arrays: they stay valid for the life of `data`.
        self._heel = data.site_xpos[heel_id]
        self._tip = data.site_xpos[tip_id]
        self._rotation = data.xmat[body_id].reshape(3, 3)
        self._centre_of_mass = data.xipos[body_id]
        self._applied = data.xfrc_applied[body_id]
        read, push = SameTypes(_edge), SameTypes(_push)
        # Compiled for floats, and before the first frame.
        read.call(self._rotation, self._forward, self._tip, self._heel)
        push.call(self._centre_of_mass, np.zeros(6), (0.0,) * 9)
        self._edge = partial(read.call, self._rotation, self._forward, self._tip, self._heel)
        self._push = partial(push.call, self._centre_of_mass, self._applied)

    def segment(self) -> BladeSegment:
        """Return the edge as it is now, in the world frame. Copies."""
        return BladeSegment.of_numbers(self._edge())

    def apply(self, wrench: Wrench) -> None:
        """Apply a wrench to the blade until the next call.

        MuJoCo's `xfrc_applied` acts at the body's centre of mass, the wrench at its own point.

        Args:
            wrench: World frame.

        Raises:
            BladeError: the wrench is not finite, or larger than `MAX_PLAUSIBLE_FORCE` or
                `MAX_PLAUSIBLE_TORQUE`.
                The wrench of the call before stays applied.
        """
        if self._push(wrench.numbers):
            return
        try:
            self._applied[:] = about_centre_of_mass(wrench, self._centre_of_mass)
        except ValueError as error:
            raise BladeError(f"the blade: {error}") from error


@kernel
def _edge(rotation: FloatArray, forward: FloatArray, tip: FloatArray, heel: FloatArray) -> _Nine:
    """Return tip [m], heel [m] and the direction in which an edge cuts, world frame.

    Args:
        rotation: Axes of the body as columns.
        forward: That direction in the frame of the body.
        tip: The tip [m].
        heel: The heel [m].
    """
    x, y, z = forward[0], forward[1], forward[2]
    return (
        tip[0],
        tip[1],
        tip[2],
        heel[0],
        heel[1],
        heel[2],
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z,
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z,
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z,
    )


@kernel
def _push(centre_of_mass: FloatArray, applied: FloatArray, wrench: _Nine) -> bool:
    """Write `about_centre_of_mass`; return False, and do nothing, where it may be implausible.

    Args:
        centre_of_mass: Of the body [m].
        applied: Force and torque on the body.
        wrench: Force [N], torque [N m] and their point [m].
    """
    fx, fy, fz, tx, ty, tz, x, y, z = wrench
    x, y, z = x - centre_of_mass[0], y - centre_of_mass[1], z - centre_of_mass[2]
    tx += y * fz - z * fy
    ty += z * fx - x * fz
    tz += x * fy - y * fx
    force, torque = math.sqrt(fx * fx + fy * fy + fz * fz), math.sqrt(tx * tx + ty * ty + tz * tz)
    if not (
        force <= _SURELY_PLAUSIBLE * MAX_PLAUSIBLE_FORCE
        and torque <= _SURELY_PLAUSIBLE * MAX_PLAUSIBLE_TORQUE
    ):  # catches NaN too
        return False
    applied[0], applied[1], applied[2] = fx, fy, fz
    applied[3], applied[4], applied[5] = tx, ty, tz
    return True


def number_in(
    model: mujoco.MjModel,
    kind: Literal["body", "site"],
    name: str,
    error: type[ValueError] = BladeError,
) -> int:
    """Return MuJoCo's number of a body or a site.

    Args:
        model: The model.
        kind: Whether it is a body or a site.
        name: Its name.
        error: What to raise where there is none.

    Raises:
        ValueError: `error`, with the names that there are.
    """
    objects = {"body": mujoco.mjtObj.mjOBJ_BODY, "site": mujoco.mjtObj.mjOBJ_SITE}
    number = int(mujoco.mj_name2id(model, objects[kind], name))
    if number < 0:
        names = [getattr(model, kind)(i).name for i in range(getattr(model, f"n{kind}"))]
        raise error(no_such(kind, name, (each for each in names if each != "world")))
    return number


def no_such(kind: str, name: str, names: Iterable[str]) -> str:
    """Return that a model has no element of a name, the nearest and all that it has."""
    named = [each for each in names if each]
    near = difflib.get_close_matches(name, named, n=1)
    hint = f"Did you mean '{near[0]}'? " if near else ""
    there = ", ".join(f"'{each}'" for each in named) or "none with a name"
    return f"the model has no {kind} '{name}'. {hint}It has: {there}"


def _across(edge: FloatArray, forward: FloatArray) -> FloatArray:
    """Return the unit vector nearest to `forward` that is orthogonal to the unit vector `edge`."""
    if forward.shape != (3,) or not np.isfinite(forward).all():
        raise BladeError(f"forward is {forward.tolist()}; wanted three finite numbers")
    across = forward - (forward @ edge) * edge
    length = float(np.linalg.norm(across))
    if length <= 1e-3 * float(np.linalg.norm(forward)):  # 0.06 degrees: the rest is rounding
        raise BladeError(
            f"forward {forward.tolist()} runs along the edge {edge.round(3).tolist()}; "
            "a blade cuts across its edge"
        )
    return across / length


def about_centre_of_mass(wrench: Wrench, centre_of_mass: FloatArray) -> SixNumbers:
    """Return force [N] and torque [N m] about a body's centre of mass, world frame.

    The lever adds (point - centre of mass) x force to the torque.

    Args:
        wrench: About a point of its own, world frame.
        centre_of_mass: Of the body [m], shape (3,).

    Raises:
        ValueError: the wrench is not finite, or larger than `MAX_PLAUSIBLE_FORCE` or
            `MAX_PLAUSIBLE_TORQUE`.
    """
    # The last guard: MuJoCo accepts 1e3 N silently, and resets itself at 1e9 N or NaN.
    fx, fy, fz, tx, ty, tz, *_ = wrench.about(centre_of_mass).numbers
    force, torque = math.hypot(fx, fy, fz), math.hypot(tx, ty, tz)
    if not (force <= MAX_PLAUSIBLE_FORCE and torque <= MAX_PLAUSIBLE_TORQUE):  # catches NaN too
        raise ValueError(
            f"a wrench of {force:.3g} N and {torque:.3g} N m about its centre of mass acts on the "
            f"body; it must be finite and at most {MAX_PLAUSIBLE_FORCE:g} N and "
            f"{MAX_PLAUSIBLE_TORQUE:g} N m. Limit it first, as bridge.Bridge does"
        )
    return fx, fy, fz, tx, ty, tz
