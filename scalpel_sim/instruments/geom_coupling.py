"""Geoms of a MuJoCo model and tissue that touch each other, both ways."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from bridge import Bridge, DrivenContact, GeomLoads, GeomPoses, TissueFrame, TouchedGeoms
from scalpel_sim.arm.blade import about_centre_of_mass, number_in
from scalpel_sim.arm.collision_geoms import WORLD
from scalpel_sim.instruments.grip import frame_of
from tissue import FloatArray, Geom, IntArray, Tissue, Wrench

_SHAPES: dict[int, tuple[str, int]] = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): ("plane", 0),
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): ("cylinder", 2),
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): ("ellipsoid", 3),
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_MESH): ("mesh", 0),
}
"""The types of geom that tissue can touch: shape, and how many of MuJoCo's sizes it has."""


class GeomCouplingError(ValueError):
    """The model has no such body, or was handed a wrench that no tissue can exert."""


class GeomForceList(NamedTuple):
    """Where tissue touched geoms in a step, world frame. Copies."""

    geom: IntArray
    """MuJoCo's number of the geom of each contact, shape (n,)."""
    point: FloatArray
    """Where each is [m], shape (n, 3)."""
    normal: FloatArray
    """Unit normal out of the geom, shape (n, 3)."""
    force: FloatArray
    """Force of the tissue on the geom, averaged over the step [N], shape (n, 3)."""


class GeomCoupling:
    """Contact between tissue and the geoms of bodies of a MuJoCo model.

    Geoms push tissue out and rub on it with their own friction, the first of MuJoCo's three, and
    their bodies feel it. A tissue has one coupling at a time: with all that it can touch.

    Call `follow` before the step of tissue or bridge and `apply` after it, between `mj_step1` and
    `mj_step2`: there the bodies are where `qpos` says, and feel the wrench in the same step.

    Args:
        data: Data of a compiled model, for which `mj_kinematics` or a step was called.
        tissue: What they touch: a tissue in this process, or a bridge to one anywhere.
        bodies: Names of bodies whose geoms take part; of each those that MuJoCo lets collide, or
            all of its geoms where it lets none. None: all bodies but `without`.
        without: Names or numbers of bodies that take no part where `bodies` is None: that of the
            blade, which the tissue knows already.
        frame: Where the tissue lies in the world; of a bridge it is that of the bridge.

    Raises:
        GeomCouplingError: the model has no such body, or a body has no geom that tissue can touch.
        ValueError: a geom is inside the tissue; see `tissue.Tissue.collide_with`.
        LinkError: the tissue is in another process, and refuses that or did not answer.
    """

    def __init__(
        self,
        data: mujoco.MjData,
        tissue: Tissue | Bridge,
        bodies: Sequence[str] | None = None,
        *,
        without: Sequence[str | int] = (),
        frame: TissueFrame = TissueFrame(),
    ) -> None:
        model: mujoco.MjModel = data.model
        self._data, self._frame = data, frame_of(tissue, frame)
        if bodies is None:
            left_out = {_number(model, body) for body in without}
            chosen = [i for i in range(model.nbody) if i not in left_out]
            chosen = [i for i in chosen if int(model.body_mocapid[i]) < 0]  # a hand is not solid
        else:
            chosen = [_number(model, name) for name in bodies]
        found = {body: _geoms_of_body(model, body) for body in chosen}
        if bodies is not None:
            for body, ids in found.items():
                if not ids:
                    raise GeomCouplingError(
                        f"the body '{model.body(body).name}' has no geom that tissue can touch; "
                        f"those are of the types {', '.join(name for name, _ in _SHAPES.values())}"
                    )
        self.geom_ids = [geom for ids in found.values() for geom in ids]
        """MuJoCo's numbers of the geoms that take part."""
        self._bodies = np.array([int(model.geom_bodyid[i]) for i in self.geom_ids], np.int64)
        self._of_tissue: FloatArray = np.zeros((model.nbody, 6))
        geoms = [_geom(model, i) for i in self.geom_ids]
        self._poses = self._poses_now()
        self._contact: TouchedGeoms | DrivenContact
        if isinstance(tissue, Bridge):
            self._contact = tissue.collide_with(geoms, self._poses)
        else:
            self._contact = TouchedGeoms(tissue, geoms, self._poses)

    def follow(self) -> None:
        """Lead the geoms to where their bodies are, at even speeds in the next step."""
        self._poses = self._poses_now()
        self._contact.move(self._poses)

    def apply(self) -> None:
        """Apply the forces of the last step to the bodies, besides what others apply to them.

        Raises:
            GeomCouplingError: a wrench is not finite, or too large; see `body_wrench`. Those of the
                call before stay applied.
        """
        loads = self._contact.loads
        now = np.zeros_like(self._of_tissue)
        for body in {int(each) for each in self._bodies[loads.forces.any(axis=1)]} - {WORLD}:
            wrench = self._wrench_on(body, loads)
            try:
                now[body] = about_centre_of_mass(wrench, self._data.xipos[body])
            except ValueError as error:
                name = self._data.model.body(body).name
                raise GeomCouplingError(f"the body '{name}': {error}") from error
        self._data.xfrc_applied += now - self._of_tissue
        self._of_tissue = now

    def wrench(self, body: str | int) -> Wrench:
        """Return the wrench of the tissue on a body in the last step, about its origin, world.

        Args:
            body: Its name or number.

        Raises:
            GeomCouplingError: the model has no such body.
        """
        return self._wrench_on(_number(self._data.model, body), self._contact.loads)

    def forces(self) -> GeomForceList:
        """Return where tissue touched geoms in the last step, and how it pushed them."""
        found, to_world = self._contact.forces(), self._frame.vectors_to_world
        return GeomForceList(
            np.array(self.geom_ids, np.int64)[found.geom],
            self._frame.points_to_world(found.point),
            to_world(found.normal),
            to_world(-found.force),
        )

    def _wrench_on(self, body: int, loads: GeomLoads) -> Wrench:
        """Return the wrench on a body, of the loads on all geoms; see `wrench`."""
        origin = self._frame.points_to_tissue(self._data.xpos[body])
        force, torque = np.zeros(3), np.zeros(3)
        for geom in np.flatnonzero(self._bodies == body):
            on_geom = Wrench(loads.forces[geom], loads.torques[geom], self._poses.origins[geom])
            force += on_geom.force
            torque += on_geom.about(origin).torque
        to_world = self._frame.vectors_to_world
        return Wrench(to_world(force), to_world(torque), self._data.xpos[body].copy())

    def _poses_now(self) -> GeomPoses:
        """Return where the geoms are now, in the frame of the tissue."""
        places = self._data.geom_xpos[self.geom_ids]
        axes = self._data.geom_xmat[self.geom_ids].reshape(-1, 3, 3)
        return GeomPoses(self._frame.points_to_tissue(places), self._frame.rotation.T @ axes)


def _number(model: mujoco.MjModel, body: str | int) -> int:
    """Return MuJoCo's number of a body that is given by its name or number."""
    return number_in(model, "body", body, GeomCouplingError) if isinstance(body, str) else body


def _geoms_of_body(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the geoms of a body that take part."""
    first = int(model.body_geomadr[body])
    ids = [first + i for i in range(int(model.body_geomnum[body]))]
    ids = [i for i in ids if int(model.geom_type[i]) in _SHAPES]
    colliding = [i for i in ids if model.geom_contype[i] or model.geom_conaffinity[i]]
    return colliding or ids


def _geom(model: mujoco.MjModel, i: int) -> Geom:
    """Return a geom of a model as tissue knows it."""
    shape, n_sizes = _SHAPES[int(model.geom_type[i])]
    body = model.body(int(model.geom_bodyid[i])).name
    vertices = None
    if shape == "mesh":
        mesh = int(model.geom_dataid[i])
        first = int(model.mesh_vertadr[mesh])
        rows = slice(first, first + int(model.mesh_vertnum[mesh]))
        vertices = model.mesh_vert[rows].astype(np.float64)
    return Geom(
        f"{model.geom(i).name or f'{body} geom'} ({i})",
        shape,
        tuple(model.geom_size[i][:n_sizes].tolist()),
        float(model.geom_friction[i][0]),
        vertices,
    )
