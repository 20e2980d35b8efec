"""How far the parts of an arm can have moved, known from the angles of its joints alone."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from tissue import FloatArray, kernel

_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


class JointReach:
    """A bound on how far any point of an arm's geoms is from where it was.

    A hinge that turns by an angle moves a point by at most that angle times its distance from the
    hinge, which is at most the length of the chain of bodies between them, however it is bent.
    Hinges that turn one after the other move it by at most the sum. The distance between two geoms
    changes by no more than that sum either: a hinge carries one of them, or both as a rigid body.

    Args:
        model: A compiled model. With joints other than hinges nothing is known.
        data: Its data, seen live.
        geoms: Numbers of the geoms.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, geoms: Sequence[int]) -> None:
        has_hinges_alone = set(model.jnt_type.tolist()) <= {_HINGE}
        self.angles = data.qpos
        """Angles of the joints now [rad]. MuJoCo's own array."""
        self.start = np.full(model.nq, math.nan)
        """Their angles at `begin` [rad]."""
        self.reach = np.array(
            [_reach(model, j, geoms) if has_hinges_alone else math.inf for j in range(model.njnt)]
        )
        """Distance of the farthest point from each joint [m]; infinite where nothing is known."""

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
    """Return the displacement by turns of hinges: see `JointReach`."""
    total = 0.0
    for joint in range(len(reach)):
        if reach[joint] == math.inf:
            return math.inf
        total += reach[joint] * abs(angles[joint] - start[joint])
    return total


def _reach(model: mujoco.MjModel, joint: int, geoms: Sequence[int]) -> float:
    """Return the largest distance from a hinge of a point of the geoms that it carries [m]."""
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
    """Return how far hinges beside a body's origin can move the origin in its parent [m]."""
    first = int(model.body_jntadr[body])
    joints = range(first, first + int(model.body_jntnum[body]))
    return sum(2.0 * _norm(model.jnt_pos[joint]) for joint in joints)


def _norm(vector: Sequence[float]) -> float:
    return float(np.linalg.norm(vector))
