"""The geoms of a MuJoCo arm as parts for the collision library, how far they move, and tables."""

import math
from collections.abc import Collection, Sequence
from functools import partial

import mujoco
import numpy as np

from bridge import ArmGeom, FixtureBox, GeomShape
from tissue import FloatArray, IntArray
from tissue.support import SameTypes, kernel

_SHAPES: dict[int, tuple[GeomShape, int]] = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): ("cylinder", 2),
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
}
"""The types of geom that take part in collisions: name, and how many of MuJoCo's sizes they use."""
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)

JOINTS_NEXT = 2
"""Number of joints up to which a link is a neighbour of the instrument: the links of a gimbal,
whose axes meet in a point, overlap in any pose."""

TABLE_THICKNESS = 0.02
"""Thickness of the box that stands for a table [m]. MuJoCo's table is a plane; a part that has gone
2 cm through it was detected before."""

WORLD = 0
"""MuJoCo's number for the body that everything stands in."""


class ArmParts:
    """The parts of an arm, and where they are.

    Args:
        model: A compiled model.
        data: Its data, seen live.
        blade: Number of the body that carries the blade.
        fixtures: Numbers of bodies that are no part of an arm.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        blade: int,
        fixtures: Collection[int] = (),
    ) -> None:
        instrument = instrument_body(model, blade)
        n_joints = _joints_up(model, instrument)
        self._geoms = [
            i
            for i in range(model.ngeom)
            if int(model.geom_type[i]) in _SHAPES
            and int(model.geom_bodyid[i]) != WORLD
            and model.body_mocapid[model.geom_bodyid[i]] < 0  # the hand is no solid body
            and int(model.geom_bodyid[i]) not in fixtures
        ]
        self.parts = []
        self.names = [_name(model, i) for i in range(model.ngeom)]
        """Names of all geoms of the model, those of the parts among them."""
        self.numbers = {self.names[i]: i for i in self._geoms}
        """MuJoCo's number of each part, by its name."""
        for i in self._geoms:
            body = int(model.geom_bodyid[i])
            shape, n_sizes = _SHAPES[int(model.geom_type[i])]
            self.parts.append(
                ArmGeom(
                    self.names[i],
                    shape,
                    tuple(model.geom_size[i][:n_sizes].tolist()),
                    is_instrument=_carries(model, instrument, body),
                    checked_against_instrument=n_joints.get(body, JOINTS_NEXT + 1) > JOINTS_NEXT,
                    checked_against_fixtures=int(model.body_weldid[body]) != WORLD,
                )
            )
        self.reach = JointReach(model, data, self._geoms)
        """Bound on how far the parts can have moved."""
        self._positions, self._axes = data.geom_xpos, data.geom_xmat
        self._positions_before, self._axes_before = self._positions.copy(), self._axes.copy()
        where = self.reach.angles, self.reach.start, self.reach.reach
        now = self._positions, self._axes
        before = self._positions_before, self._axes_before
        compiled = SameTypes(_remain_within)
        compiled.call(*where, *now, *before, -1.0)
        self.remain_within = partial(compiled.call, *where, *now, *before)
        """Return whether no part can have moved that far since `reach.begin` [m].

        If so, where the parts are now is kept for `before`."""

    def before(self) -> tuple[FloatArray, FloatArray]:
        """Return positions and axes of the parts when they last remained within. Copies."""
        axes = self._axes_before[self._geoms]
        return self._positions_before[self._geoms], axes.reshape(-1, 3, 3)

    def positions(self) -> FloatArray:
        """Return where the parts are now [m], world frame, shape (n, 3). A copy."""
        return np.asarray(self._positions[self._geoms])

    def axes(self) -> FloatArray:
        """Return the axes of the parts as columns, shape (n, 3, 3). A copy."""
        return np.asarray(self._axes[self._geoms].reshape(-1, 3, 3))


@kernel
def _remain_within(
    angles: FloatArray,
    start: FloatArray,
    reach: FloatArray,
    positions: FloatArray,
    axes: FloatArray,
    positions_before: FloatArray,
    axes_before: FloatArray,
    distance: float,
) -> bool:
    """Do `ArmParts.remain_within`: the last two arrays become copies of the two before them."""
    if not hinge_displacement(angles, start, reach) < distance:
        return False
    for geom in range(len(positions)):
        for i in range(3):
            positions_before[geom, i] = positions[geom, i]
        for i in range(9):
            axes_before[geom, i] = axes[geom, i]
    return True


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


def arms_of_geoms(model: mujoco.MjModel, fixtures: Collection[int]) -> IntArray:
    """Return for each geom the body of the world that carries it; `WORLD` for what is no arm.

    Arms are distinguished by it: each stands on one body of the world.

    Args:
        model: A compiled model.
        fixtures: Numbers of bodies that are no part of an arm.
    """
    roots = model.body_rootid[model.geom_bodyid].astype(np.int64)
    return np.where(np.isin(roots, list(fixtures)), WORLD, roots)


def instrument_body(model: mujoco.MjModel, blade: int) -> int:
    """Return the body that the last joint before the blade moves: the handle, or the blade."""
    body = blade
    while model.body_jntnum[body] == 0 and int(model.body_parentid[body]) != WORLD:
        body = int(model.body_parentid[body])
    return body


def tables(model: mujoco.MjModel) -> dict[int, FixtureBox]:
    """Return the planes that lie in the world, as boxes below them, by MuJoCo's numbers.

    A plane without an end is left out: so is what it is for, a horizon to look at.
    """
    found = {}
    for i in range(model.ngeom):
        x, y, _ = model.geom_size[i].tolist()
        is_plane = int(model.geom_type[i]) == int(mujoco.mjtGeom.mjGEOM_PLANE)
        if is_plane and int(model.geom_bodyid[i]) == WORLD and x > 0.0 and y > 0.0:
            matrix = np.empty(9)
            mujoco.mju_quat2Mat(matrix, model.geom_quat[i])
            turned = matrix.reshape(3, 3)
            found[i] = FixtureBox(
                model.geom(i).name or f"plane {i}",
                np.array([2.0 * x, 2.0 * y, TABLE_THICKNESS]),
                model.geom_pos[i] - 0.5 * TABLE_THICKNESS * turned[:, 2],
                turned,
            )
    return found


def _name(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom, or that of its body with its number."""
    return model.geom(geom).name or f"{model.body(int(model.geom_bodyid[geom])).name} geom {geom}"


def _carries(model: mujoco.MjModel, carrier: int, body: int) -> bool:
    """Whether a body is `carrier`, or is fixed to it directly or by others."""
    while body not in (carrier, WORLD):
        body = int(model.body_parentid[body])
    return body == carrier


def _joints_up(model: mujoco.MjModel, body: int) -> dict[int, int]:
    """Return how many joints are between a body and each of those that carry it."""
    found, n = {body: 0}, 0
    while body != WORLD:
        n += int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
        found[body] = n
    return found


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
    """Return how far hinges next to it, and slides, can move a body's origin in its parent [m]."""
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
