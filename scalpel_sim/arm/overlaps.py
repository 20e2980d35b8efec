"""Bodies of an arm of the user's own that overlap.

MuJoCo has the convex hulls of meshes collide, of all bodies but a parent that moves and its child.
Many files of robots are made for programs that are told elsewhere which links to leave out: their
hulls overlap in every configuration, and would drive the links apart.
"""

import logging
from collections.abc import Sequence
from functools import cache
from typing import Final, NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_name
from tissue import FloatArray

_TOUCHING: Final = 1e-4
"""Depth up to which bodies touch and do not overlap [m]: contact of steel is as soft as that."""
_NAMED: Final = 3
"""Overlaps that a message names."""
_WORLD: Final = "world"
"""Name of the body that MuJoCo adds to all."""

_log = logging.getLogger("scalpel_sim")


class Overlap(NamedTuple):
    """Two bodies that are in each other."""

    one: str
    """Name of a body."""
    other: str
    """Name of the other one."""
    depth: float
    """By how much they overlap [m]."""

    def __str__(self) -> str:
        return f"'{self.one}' and '{self.other}' by {1e3 * self.depth:.3g} mm"


def overlaps(model: mujoco.MjModel, data: mujoco.MjData) -> list[Overlap]:
    """Return which bodies that can collide overlap, deepest first.

    Args:
        model: The model.
        data: Its data, with bodies where its joints have them.
    """
    mujoco.mj_collision(model, data)
    contacts = data.contact
    found: dict[tuple[str, str], float] = {}
    for geoms, distance in zip(contacts.geom, contacts.dist, strict=True):
        if distance < -_TOUCHING:
            bodies = sorted(int(body) for body in model.geom_bodyid[geoms])
            one, other = (model.body(body).name for body in bodies)
            found[one, other] = max(found.get((one, other), 0.0), -float(distance))
    every = (Overlap(*names, depth) for names, depth in found.items())
    return sorted(every, key=lambda each: (-each.depth, each.one, each.other))


def pass_where_they_overlap(spec: mujoco.MjSpec, name: str) -> None:
    """Make bodies of an arm pass through each other that overlap in the configuration of its file.

    So do a base that stands still and what a joint has move on it: their friction would hold it.
    What bodies overlap with in the world of the model, as a floor, still stops them.

    Args:
        spec: The arm, yet to be compiled, with what it holds. Bodies without a name get one.
        name: Name of the arm, for a message.

    Raises:
        ValueError: it is no model.
    """
    taken = {body.name for body in spec.bodies}
    for number, body in enumerate(spec.bodies):
        if not body.name:
            body.name = free_name(f"body_{number}", taken)
            taken.add(body.name)
    copy = spec.copy()
    # It may be off here, and on where there is something else to collide with.
    copy.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model = copy.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = first_configuration(model)
    mujoco.mj_kinematics(model, data)
    found = [each for each in overlaps(model, data) if each.one != _WORLD]
    for pair in sorted({(each.one, each.other) for each in found} | _on_bases(model)):
        spec.add_exclude(bodyname1=pair[0], bodyname2=pair[1])
    if found:
        _say_once(
            f"bodies of the arm '{name}' overlap as its file has them, and pass through each "
            f"other: {in_words(found)}"
        )


def _on_bases(model: mujoco.MjModel) -> set[tuple[str, str]]:
    """Return the names of bases that stand still, each with one that moves on it."""
    parents, stands = model.body_parentid, model.body_weldid == 0
    return {
        (model.body(parents[body]).name, model.body(body).name)
        for body in np.flatnonzero(~stands & stands[parents] & (parents != 0))
    }


def in_words(found: Sequence[Overlap]) -> str:
    """Return overlaps, the first of them by name."""
    more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    return f"{', '.join(map(str, found[:_NAMED]))}{more}"


def first_configuration(model: mujoco.MjModel) -> FloatArray:
    """Return the configuration of the first keyframe, or that of the model without one.

    Hinges and slides are within their ranges.
    """
    qpos = np.array(model.key_qpos[0] if model.nkey else model.qpos0)
    is_ball = model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)
    limited = np.flatnonzero(model.jnt_limited.astype(bool) & ~is_ball)
    places, (low, high) = model.jnt_qposadr[limited], model.jnt_range[limited].T
    qpos[places] = np.clip(qpos[places], low, high)
    return qpos


@cache
def _say_once(text: str) -> None:
    """Log something under --verbose: a run reads the model of its arm up to three times."""
    _log.info("%s", text)
