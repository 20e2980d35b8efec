"""A fixture in the MuJoCo model of a run: it stops instruments and arms."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from bridge import Fixture, FixtureBox, FixtureMesh
from scalpel_sim.arm.collision_groups import STANDING
from scalpel_sim.arm.free_names import free_prefix
from tissue import FloatArray

_PREFIX = "fixture_"
"""Prefix of the name of its body, where that is free; the name of the fixture follows."""

_THICKNESS = 2e-4
"""Thickness of the plate that a triangle of a mesh is [m]: half that of a scalpel's blade."""

STEEL = (0.004, 1.0)
"""MuJoCo's `solref` of rigid parts: as stiff as a step of 1 ms allows, and critically damped. With
its usual 20 ms an arm that is pressed down with 20 N sinks in by 1 mm."""

_COMMON: dict[str, Any] = {
    "contype": 1 | STANDING,
    "conaffinity": 1,
    "solref": STEEL,
    "rgba": (0.45, 0.47, 0.5, 1.0),
}


class StandingFixture(NamedTuple):
    """A fixture, as it stands in the world."""

    fixture: Fixture
    """Its shape, world frame."""

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
