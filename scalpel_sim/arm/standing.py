"""Fixtures and tables in the world of an arm, and which geoms of a run MuJoCo lets collide.

An arm collides with other arms and with what stands in its world: a table, fixtures. Whether it
collides with itself and with the world of its own model is as the model says. Tissue is not among
them: MuJoCo does not know it.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

import mujoco
import numpy as np

from bridge import Fixture, FixtureBox, FixtureMesh, TissueFrame
from scalpel_sim.arm.free_names import free_prefix
from tissue import FloatArray, Geom

STANDING = 1 << 16
"""Bit of `contype` of what stands next to arms."""

ARM_GROUPS = tuple(1 << bit for bit in range(17, 31))
"""Bits of `contype` of arms, one each."""

_ALL = STANDING | sum(ARM_GROUPS)

STEEL = (0.004, 1.0)
"""MuJoCo's `solref` of rigid parts: as stiff as a step of 1 ms allows, and critically damped. With
its usual 20 ms an arm that is pressed down with 20 N sinks in by 1 mm."""

_PREFIX = "fixture_"
"""Prefix of the name of a fixture's body, where that is free; the name of the fixture follows."""

_THICKNESS = 2e-4
"""Thickness of the plate that a triangle of a mesh is [m]: half that of a scalpel's blade."""

_COMMON: dict[str, Any] = {
    "contype": 1 | STANDING,
    "conaffinity": 1,
    "solref": STEEL,
    "rgba": (0.45, 0.47, 0.5, 1.0),
}

TABLETOP = "tabletop"
"""Name of the geom of a table, where the model has none of that name."""

_TABLE_COLOUR = (0.32, 0.38, 0.4, 1.0)

_ON_ARMS = 1.0
"""Friction of a table against arms where it has the tissue's on the tissue: MuJoCo's default."""


class Standing(Protocol):
    """An arm, a table, a fixture: anything that can be put into a model."""

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled.

        Returns:
            What it is called there, where the model may have had its usual name: the name of its
            geom or body, or what the names of its parts begin with.
        """


class StandingFixture(NamedTuple):
    """A fixture, as it stands in the world."""

    fixture: Fixture
    """Shape of the fixture, world frame."""

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled. It does not move.

        A mesh becomes a thin plate for each triangle: as one geom it would be its convex hull.

        Returns:
            The name of its body there.
        """
        fixture, common, whole = self.fixture, dict(_COMMON), self.fixture.name
        plates = [] if isinstance(fixture, FixtureBox) else list(_plates(fixture))
        parts = [f"{whole}_{i}" for i in range(len(plates))]
        names = {"bodies": [whole], "geoms": parts or [whole], "meshes": parts}
        prefix = free_prefix(spec, names, _PREFIX)
        body = spec.worldbody.add_body(name=prefix + whole)
        if isinstance(fixture, FixtureBox):
            quaternion = np.empty(4)
            mujoco.mju_mat2Quat(quaternion, fixture.rotation.ravel())
            common |= {"size": 0.5 * fixture.size, "pos": fixture.centre, "quat": quaternion}
            body.add_geom(name=prefix + whole, type=mujoco.mjtGeom.mjGEOM_BOX, **common)
        for part, corners in zip(parts, plates, strict=True):
            name = prefix + part
            plate = spec.add_mesh(name=name, uservert=corners.ravel())
            plate.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **common)
        return prefix + whole


def _plates(mesh: FixtureMesh) -> Iterator[FloatArray]:
    """Yield the corners of a thin plate for each triangle [m], shape (6, 3)."""
    for triangle in mesh.triangles:
        corners = mesh.positions[triangle]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        area = float(np.linalg.norm(normal))
        if area > 0.0:
            half = 0.5 * _THICKNESS / area * normal
            yield np.concatenate([corners - half, corners + half])


class Tabletop(NamedTuple):
    """A board, as tissue touches it and as it stands in the world."""

    geom: Geom
    """Shape of the table: a box."""
    centre: FloatArray
    """Where its middle is [m], tissue frame, shape (3,)."""
    frame: TissueFrame = TissueFrame()
    """Where the tissue lies in the world."""

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest corner of the board, tissue frame [m], shape (2, 3)."""
        half = np.array(self.geom.size)
        return np.stack([self.centre - half, self.centre + half])

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled.

        It collides with arms and what they hold.

        Returns:
            The name of its geom there.
        """
        name = free_prefix(spec, {"geoms": [TABLETOP]}) + TABLETOP
        quaternion, frame = np.empty(4), self.frame
        mujoco.mju_mat2Quat(quaternion, frame.rotation.ravel())
        friction = self.geom.friction
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=self.geom.size,
            pos=frame.points_to_world(self.centre),
            quat=quaternion,
            friction=[_ON_ARMS if friction is None else friction, 0.005, 0.0001],
            solref=STEEL,
            contype=1 | STANDING,
            conaffinity=1,
            rgba=_TABLE_COLOUR,
        )
        return name


def collide_as_one_arm(spec: mujoco.MjSpec, there: mujoco.MjSpec) -> None:
    """Make the bodies of an arm collide with other arms, and with what stands near it.

    Of a body those geoms take part that the model lets collide at all; where it lets none, all.

    Args:
        spec: The arm, yet to be compiled.
        there: The model that it is to be a part of, or the arm itself.

    Raises:
        ValueError: there are too many arms.
    """
    taken = 0
    for geom in there.geoms:
        taken |= geom.contype
    group = next((bit for bit in ARM_GROUPS if not bit & taken), None)
    if group is None:
        raise ValueError(
            f"there are more than {len(ARM_GROUPS)} arms, which MuJoCo cannot distinguish"
        )
    for body in spec.bodies[1:]:
        if body.mocap:  # a hand is not solid
            continue
        geoms = list(body.geoms)
        for geom in [each for each in geoms if each.contype or each.conaffinity] or geoms:
            geom.contype |= group
            geom.conaffinity |= _ALL & ~group


def collide(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Return whether MuJoCo lets two geoms collide that are no neighbours, by their numbers."""
    if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT):
        return False
    contype, conaffinity = model.geom_contype, model.geom_conaffinity
    return bool(contype[one] & conaffinity[other] or contype[other] & conaffinity[one])
