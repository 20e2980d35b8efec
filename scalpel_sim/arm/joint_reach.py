"""Bounds of how far the parts of an arm have moved, from the angles of its joints alone."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from tissue import FloatArray
from tissue.support import kernel

_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


class JointReach:
    """A bound on how far any point of an arm's geoms is from where it was.

    A hinge that turns by an angle moves a point by at most that angle times its distance from the
    hinge, which is at most the length of the chain of bodies between them, however it is bent.
    Hinges that turn one after the other move it by at most the sum. The distance between two geoms
    changes by no more than that sum either: a hinge carries one of them, or both as a rigid body.
    A slide moves what it carries by as much as it slides.

    Args:
        model: A compiled model. With joints other than hinges and slides of a limited range nothing
            is known.
        data: Its data, seen live.
        geoms: Numbers of the geoms.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, geoms: Sequence[int]) -> None:
        is_slide = model.jnt_type == _SLIDE
        is_known = (model.jnt_type == _HINGE) | (is_slide & model.jnt_limited.astype(bool))
        self.angles = data.qpos
        """Angles of the joints now [rad], or how far they slide [m]. MuJoCo's own array."""
        self.start = np.full(model.nq, math.nan)
        """Their angles at `begin` [rad]."""
        self.reach = np.array(
            [_reach(model, j, geoms) if is_known.all() else math.inf for j in range(model.njnt)]
        )
        """Distance of the farthest point from each hinge [m], and 1 for a slide; infinite where
        nothing is known."""

    def begin(self) -> None:
        """Measure from the present configuration on."""
        self.start[:] = self.angles

    def displacement(self) -> float:
        """Return how far any point can be from where it was at `begin` [m].

        NaN before the first call of `begin`, and infinite where nothing is known.
        """
        return hinge_displacement(self.angles, self.start, self.reach)


@kernel
def hinge_displacement(angles: FloatArray, start: FloatArray, reach: FloatArray) -> float:
    """Return the displacement by turns of hinges and by slides: see `JointReach`."""
    total = 0.0
    for joint in range(len(reach)):
        if reach[joint] == math.inf:
            return math.inf
        total += reach[joint] * abs(angles[joint] - start[joint])
    return total


def _reach(model: mujoco.MjModel, joint: int, geoms: Sequence[int]) -> float:
    """Return the largest distance from a hinge of a point of the geoms that it carries [m]."""
    if model.jnt_type[joint] == _SLIDE:
        return 1.0
    carrier, longest = int(model.jnt_bodyid[joint]), 0.0
    for geom in geoms:
        box = model.geom_aabb[geom]  # its centre and half its size, in the geom's frame
        length = _norm(model.geom_pos[geom]) + _norm(box[:3]) + _norm(box[3:])
        body = int(model.geom_bodyid[geom])
        while body not in (carrier, 0):
            length += _norm(model.body_pos[body]) + _play(model, body)
            body = int(model.body_parentid[body])
        if body == carrier:
            longest = max(longest, length + _norm(model.jnt_pos[joint]) + _play(model, carrier))
    return longest


def _play(model: mujoco.MjModel, body: int) -> float:
    """Return how far hinges beside it, and slides, can move a body's origin in its parent [m]."""
    first = int(model.body_jntadr[body])
    joints = range(first, first + int(model.body_jntnum[body]))
    return sum(
        float(np.abs(model.jnt_range[joint]).max())
        if model.jnt_type[joint] == _SLIDE
        else 2.0 * _norm(model.jnt_pos[joint])
        for joint in joints
    )


def _norm(vector: Sequence[float]) -> float:
    return float(np.linalg.norm(vector))
