"""The scene that is drawn: a model in MuJoCo, and triangle meshes in it."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.camera.finishes import Finish
from scalpel_sim.camera.lenses import aim, widen_range
from scalpel_sim.camera.lights import Rgb
from scalpel_sim.camera.render_model import RenderModel
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.viewer.primitives import TriangleMesh

SHADOW_PIXELS = 2048
"""Side of the map of a shadow [pixels]."""

SPARE = 1.5
"""Factor by which a mesh may grow before a new model is made for it."""

FIRST_ROOM = 3000
"""Triangles for which each mesh has room at first, at least: a cut begins small."""

_MOST_GEOMS = 10_000
"""Geoms and marks in a picture, at most: as many as MuJoCo's own renderer draws."""

_NO_SIZE, _UPRIGHT = np.zeros(3), np.eye(3).ravel()
"""Size and rotation of a geom whose triangles are where they are in the world."""


class Thing(NamedTuple):
    """Part of a picture."""

    mesh: str | None
    """Name of one of the meshes; None: part of the model."""
    kind: int = -1
    """Kind of the part: a value of `mujoco.mjtObj`."""
    number: int = -1
    """Its number in the model."""


class _Placed(NamedTuple):
    """A mesh, and where it is."""

    mesh: TriangleMesh
    frame: TissueFrame


class Composition:
    """Composes scenes of MuJoCo from a model, and from meshes that change.

    The model is only read: it stays as it is, to the byte.

    Args:
        model: A compiled model.
        finishes: Look of each mesh, by its name.
        shadows: Whether lamps cast shadows.
        samples: Samples of each pixel.
        background: Rgb where nothing is, by which the model has no sky of its own (sRGB).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        finishes: Mapping[str, Finish],
        *,
        shadows: bool,
        samples: int,
        background: Rgb,
    ) -> None:
        self._model, self._finishes = model, dict(finishes)
        self._shadows, self._samples, self._background = shadows, samples, background
        self._colours = {
            name: np.array(finish.colour, np.float32) for name, finish in finishes.items()
        }
        self._meshes: dict[str, _Placed] = {}
        self._written: dict[str, _Placed] = {}
        self._rooms: dict[str, int] = {}
        self._shapes: dict[str, TriangleMesh] = {}
        self._instead: dict[int, str] = {}
        self._render: RenderModel | None = None
        self._corners: dict[str, _Corners] = {}
        self._camera = mujoco.MjvCamera()
        self._aimed_at: Viewpoint | int | None = None
        self.scene = mujoco.MjvScene()
        """The scene as `look` has composed it."""
        self.n_models = 0
        """Models that were made so far for meshes that grew."""

    def put(self, name: str, mesh: TriangleMesh, frame: TissueFrame) -> None:
        """Put a mesh, or replace it; see `Canvas.put`."""
        if len(mesh.triangles):
            self._meshes[name] = _Placed(mesh, frame)
        else:
            self._meshes.pop(name, None)

    def replace_geom(self, geom: int, name: str, mesh: TriangleMesh) -> None:
        """Show a mesh in place of a geom of the model; see `Canvas.replace_geom`."""
        self._instead[geom], self._shapes[name] = name, mesh

    def tint(self, name: str, factor: Sequence[float]) -> None:
        """Multiply the colour of a mesh; see `Canvas.tint`."""
        *colour, opacity = self._finishes[name].colour
        tinted = np.minimum(np.multiply(colour, factor), 1.0)
        self._colours[name][:] = (*tinted, opacity)

    def with_room(self) -> RenderModel:
        """Return the second model, with room for all meshes as they are.

        Where one has grown out of its room, it is a new one, and so is the scene.
        """
        for name, (mesh, _) in self._meshes.items():
            if len(mesh.triangles) > self._rooms.get(name, 0):
                self._rooms[name] = max(FIRST_ROOM, int(SPARE * len(mesh.triangles)))
                self._render = None
        if self._render is None:
            for name in self._finishes.keys() - self._shapes.keys():
                self._rooms.setdefault(name, FIRST_ROOM)
            self._render = RenderModel(
                self._model,
                self._rooms,
                self._shapes,
                self._finishes,
                shadow_pixels=SHADOW_PIXELS if self._shadows else 0,
                samples=self._samples,
                background=self._background,
            )
            self.scene = mujoco.MjvScene(self._render.model, maxgeom=_MOST_GEOMS)
            self._corners = {
                name: _Corners.of(self.scene, self._render.room_number(name))
                for name in self._rooms
            }
            self._written.clear()
            self._aimed_at = None
            self.n_models += 1
        return self._render

    def look(
        self, view: Viewpoint | int, far: float, data: mujoco.MjData, option: mujoco.MjvOption
    ) -> None:
        """Compose what is seen from somewhere, by the lamps of the model.

        Args:
            view: The place; or the number of a camera of the model.
            far: Distance beyond which nothing is drawn [m].
            data: Data of the model.
            option: What is drawn of the model.
        """
        render, camera, scene = self.with_room(), self._camera, self.scene
        if not isinstance(view, Viewpoint):
            camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, view
            # MuJoCo lays infinite planes around the eye before it aims it: around that of the
            # picture before, which would show in this one.
            mujoco.mjv_updateCamera(self._model, data, camera, scene)
        elif view is not self._aimed_at:
            camera.type = mujoco.mjtCamera.mjCAMERA_USER
            aim(scene, view, far)
        self._aimed_at = view
        every = int(mujoco.mjtCatBit.mjCAT_ALL)
        mujoco.mjv_updateScene(self._model, data, option, None, camera, every, scene)
        if not isinstance(view, Viewpoint):
            widen_range(scene)
        self._replace_geoms(render)
        self._append_meshes(render)
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = self._shadows

    def things(self) -> list[Thing]:
        """Return what is in the scene, in the order of the numbers by which it is drawn."""
        geoms = self.scene.geoms[: self.scene.ngeom - len(self._meshes)]
        things = [Thing(None, geom.objtype, geom.objid) for geom in geoms]
        return things + [Thing(name) for name in self._meshes]

    def _replace_geoms(self, render: RenderModel) -> None:
        """Put meshes in the places of geoms."""
        if not self._instead:
            return
        kind, mesh = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtGeom.mjGEOM_MESH)
        for geom in self.scene.geoms[: self.scene.ngeom]:
            name = self._instead.get(geom.objid) if geom.objtype == kind else None
            if name is not None:
                geom.type, geom.dataid = mesh, 2 * render.shape_number(name)
                geom.size[:] = 1.0
                geom.rgba[:] = self._colours[name]
                self._finish(geom, name, render)

    def _append_meshes(self, render: RenderModel) -> None:
        """Append the other meshes to the scene, and write where they now are."""
        scene, kind = self.scene, int(mujoco.mjtGeom.mjGEOM_FLEX)
        for name, placed in self._meshes.items():
            geom, number = scene.geoms[scene.ngeom], render.room_number(name)
            place, colour = placed.frame.origin, self._colours[name]
            mujoco.mjv_initGeom(geom, kind, _NO_SIZE, place, _UPRIGHT, colour)
            geom.objtype, geom.objid = int(mujoco.mjtObj.mjOBJ_UNKNOWN), number
            # Of ink -1, with which it is left out where numbers are drawn.
            geom.segid = -1 if self._finishes[name].is_ink else scene.ngeom
            self._finish(geom, name, render)
            scene.ngeom += 1
            before = self._written.get(name)
            if before is not placed:
                self._corners[name].write(placed, before)
                self._written[name] = placed
            scene.flexfaceused[number] = len(placed.mesh.triangles)

    def _finish(self, geom: mujoco.MjvGeom, name: str, render: RenderModel) -> None:
        """Give a geom of the scene its look."""
        finish = self._finishes[name]
        geom.matid = render.material_number(name)
        geom.specular, geom.shininess = finish.gloss, finish.shininess
        geom.emission, geom.texcoord = finish.glow, finish.picture is not None


class _Corners(NamedTuple):
    """Arrays of a scene from which MuJoCo draws a mesh: a row for each triangle it has room for."""

    positions: np.ndarray
    """Corners of the triangles [m], world frame, float32, shape (room, 3, 3)."""
    normals: np.ndarray
    """Normals there, shape (room, 3, 3)."""
    uv: np.ndarray
    """Texture coordinates there, shape (room, 3, 2)."""

    @classmethod
    def of(cls, scene: mujoco.MjvScene, number: int) -> "_Corners":
        """Return those of a flex."""
        first, room = int(scene.flexfaceadr[number]), int(scene.flexfacenum[number])
        arrays = (
            array.reshape(-1, 3, width)[first : first + room]
            for array, width in (
                (scene.flexface, 3),
                (scene.flexnormal, 3),
                (scene.flextexcoord, 2),
            )
        )
        return cls(*arrays)

    def write(self, placed: _Placed, before: _Placed | None) -> None:
        """Write a mesh, where there was another one before."""
        (mesh, frame), old = placed, None if before is None else before.mesh
        corners = mesh.triangles
        _take(frame.points_to_world(mesh.positions), corners, self.positions)
        _take(frame.vectors_to_world(mesh.normals), corners, self.normals)
        is_same = old is not None and old.uv is mesh.uv and old.triangles is mesh.triangles
        if mesh.uv is not None and not is_same:
            _take(mesh.uv, corners, self.uv)


def _take(rows: np.ndarray, corners: np.ndarray, into: np.ndarray) -> None:
    """Write the rows of corners, shape (n, 3), to the first n places."""
    # Unlike "raise", "clip" writes to where it shall be without a copy between.
    np.take(rows.astype(np.float32), corners, axis=0, out=into[: len(corners)], mode="clip")
