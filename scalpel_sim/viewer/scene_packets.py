"""Packets of scene commands that show a run: the arm, the table, the tissue and the forces."""

from collections.abc import Iterable, Mapping, Sequence

import mujoco
import numpy as np
from msgspec.structs import replace

from bridge import TissueFrame
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer import textures
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import Shape, position_and_rotation
from scalpel_sim.viewer.own_camera import own_eye
from scalpel_sim.viewer.primitives import TriangleMesh
from scalpel_sim.viewer.scene3d import Appearance, Scene3D
from scalpel_sim.viewer.stand import stand_under
from scalpel_sim.viewer.textures import map_texture
from tissue import FloatArray, IntArray, Surface, SurfaceQuantity

TISSUE = "/tissue"
"""Path of the tissue. Objects below it are in the tissue frame, all others in the world frame."""

STAND = "/stand"
"""Path of what is drawn below the tissue."""

CLOTH = "cloth"
"""Name of the appearance of drapes, and of the tables that they cover."""

CLOTH_TILE = 0.8
"""Length of one repeat of the cloth, in diagonals of the body."""

TILES_PER_BODY = 2.2
"""Repeats of the texture along the diagonal of the body."""

TABLE_RADIUS = 4.5
"""Half width of a plane, in diagonals of the body. Planes are infinite in MuJoCo, whatever size the
model gives; the plane that is drawn fades out around the body."""

ARROW_LENGTH = 0.15
"""Length of the force arrow per newton, in diagonals of the body."""

TARGET_OPACITY = 0.15
"""Opacity of the marker of the hand's target pose: only a hint."""

MIX, ADD = 1, 2
"""Combinations of a reflection with the colour below it, in the numbers of three.js: metal mixes,
varnish adds."""

_WET = {
    "color": 0xFFFFFF,
    "vertexColors": True,
    "specular": 0x6E625F,
    "shininess": 55,
    "reflectivity": 0.06,
    "combine": ADD,
    "finish": "wet",
}
"""Properties of the material of wet tissue."""

_STEEL = {
    "color": 0x98A1A8,
    "specular": 0xFFFFFF,
    "shininess": 120,
    "reflectivity": 0.7,
    "combine": MIX,
    "finish": "steel",
}
"""Properties of the material of the blade."""

_TRAY = {**_STEEL, "color": 0x8B949A, "finish": "brushed"}
"""Properties of the material of the tray."""

_CLOTH = {"color": 0x5A8C85, "specular": 0x0A0A0A, "shininess": 8, "finish": "cloth"}
"""Properties of the material of a drape: the green of operating theatres, beside which tissue is
red."""

_PAINT = {"specular": 0x555555, "shininess": 60, "reflectivity": 0.05, "combine": ADD}
"""Properties of the material of painted parts."""

OWN_VIEW = "where the blade enters"
"""Name of the page's own camera; a scene that has a view of this name replaces it."""

HIGHEST_LEVEL = 255
"""Level of the top, and of all above it."""

TOP_PERCENTILE = 99.0
"""Share of the vertices whose values are below the top [%]. In a few around the edge of the blade
they are so high that all others would have one colour."""


class ScenePackets:
    """Makes the packets that show a run on a page: an opening packet, then one packet a frame."""

    def __init__(
        self,
        shapes: Iterable[Shape],
        frame: TissueFrame | None = None,
        *,
        wireframe: bool = False,
        views: Sequence[ViewTable] = (),
        look: Look = ORGAN_LOOK,
        is_drawn_on: bool = False,
    ) -> None:
        """Prepare the packets of one run.

        Args:
            shapes: Visible shapes of the MuJoCo model, from `model_shapes.shapes_of`.
            frame: Pose of the tissue frame in the world; by default they coincide.
            wireframe: Whether the edges of the tissue's triangles are drawn at the start.
            views: Cameras that the page offers besides its own; it begins with the first.
            look: Look of the body's material.
            is_drawn_on: Whether lines may be drawn on the skin, which takes 12 bytes a vertex.
        """
        self._is_drawn_on = is_drawn_on
        self._shapes = list(shapes)
        self._frame = frame or TissueFrame()
        self._wireframe = wireframe
        self._views = tuple(views)
        self._look = look
        self._bodies = sorted({shape.body for shape in self._shapes})
        self._diagonal = 1.0

    def opening(self, surface: Surface, body_poses: FloatArray) -> bytes:
        """Return the packet that is sent once, before the first frame: appearances, shapes, camera.

        Args:
            surface: Surface of the body at the start, for which the camera is placed.
            body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.
        """
        lowest, highest = surface.positions.min(axis=0), surface.positions.max(axis=0)
        centre = self._frame.points_to_world((lowest + highest) / 2.0)
        self._diagonal = float(np.linalg.norm(highest - lowest))
        scene = Scene3D()
        _set_tissue_appearances(scene, self._diagonal, self._look)
        scene.set_appearance(CLOTH, _cloth(self._diagonal))
        for shape in self._shapes:
            self._set_shape(scene, shape, centre, body_poses[shape.body])
        self._set_stand(scene, surface, body_poses)
        scene.set_pose(TISSUE, self._frame.origin, self._frame.rotation)
        cameras = [*map(self._camera, self._views)]
        if OWN_VIEW not in [camera.name for camera in cameras]:
            eye = own_eye(self._shapes, body_poses, surface.positions, self._frame)
            cameras.append(ViewTable(name=OWN_VIEW, eye=eye.tolist(), target=centre.tolist()))
        scene.set_cameras(cameras, self._diagonal)
        scene.set_legend(self._look.labels)
        scene.set_wireframe(self._wireframe)
        return scene.take()

    def frame(self, state: SceneState) -> bytes:
        """Return the packet that shows one instant."""
        scene = Scene3D()
        levels, tops = levels_of(state.values)
        textured = map_texture(state.surface, self._diagonal / TILES_PER_BODY, levels, self._look)
        skin = textured.skin if self._is_drawn_on else textured.skin._replace(rest=None)
        scene.set_mesh(f"{TISSUE}/skin", skin, "skin")
        scene.set_mesh(f"{TISSUE}/cut", textured.cut._replace(rest=None), "cut")
        scene.set_scales(tops)
        for body in self._bodies:
            scene.set_pose(f"/bodies/{body}", *position_and_rotation(state.body_poses[body]))
        if state.readings is not None:
            scene.set_readings(state.readings, ARROW_LENGTH * self._diagonal)
        if state.judged is not None:
            scene.set_judged(state.judged, self._frame)
        if state.live is not None:
            scene.set_live(state.live)
        return scene.take()

    def _set_shape(
        self, scene: Scene3D, shape: Shape, centre: FloatArray, body_pose: FloatArray
    ) -> None:
        """Put one shape below its body's path, with an appearance of its own."""
        path, appearance = f"/bodies/{shape.body}/{shape.name}", f"appearance of {shape.name}"
        position, rotation = position_and_rotation(shape.pose)
        mesh = shape.mesh
        if shape.kind == int(mujoco.mjtGeom.mjGEOM_PLANE):
            body_position, body_rotation = position_and_rotation(body_pose)
            below = ((centre - body_position) @ body_rotation - position) @ rotation
            mesh = _plane_around(mesh, below, TABLE_RADIUS * self._diagonal)
        if shape.is_table:
            scene.set_mesh(path, self._on_cloth(mesh), CLOTH)
            scene.set_pose(path, position, rotation)
            return
        part = "end" if shape.is_end else "link" if shape.is_link else None
        scene.set_appearance(appearance, _appearance_of(shape)._replace(part=part))
        scene.set_mesh(path, mesh, appearance)
        scene.set_pose(path, position, rotation)

    def _set_stand(self, scene: Scene3D, surface: Surface, body_poses: FloatArray) -> None:
        """Put a draped stand below the body, where there is room."""
        positions = self._frame.points_to_world(surface.positions)
        stand = stand_under(self._shapes, body_poses, positions)
        if stand is None:
            return
        scene.set_mesh(f"{STAND}/drape", self._on_cloth(stand.drape), CLOTH)
        if stand.tray is not None:
            scene.set_appearance("tray", Appearance("MeshPhongMaterial", _TRAY))
            scene.set_mesh(f"{STAND}/tray", stand.tray, "tray")

    def _on_cloth(self, mesh: TriangleMesh) -> TriangleMesh:
        """Return a mesh with texture coordinates of cloth: by lengths on it, or from above."""
        lengths = mesh.positions[:, :2] if mesh.uv is None else mesh.uv
        return mesh._replace(uv=lengths / (CLOTH_TILE * self._diagonal))

    def _camera(self, view: ViewTable) -> ViewTable:
        """Return a view in the frame of the world."""
        eye, target = self._frame.points_to_world(np.array([view.eye, view.target])).tolist()
        up = self._frame.vectors_to_world(np.array(view.up)).tolist()
        return replace(view, eye=eye, target=target, up=up)


def _set_tissue_appearances(scene: Scene3D, diagonal: float, look: Look) -> None:
    """Define the appearances of skin and cut faces, with relief [m] in proportion to the body."""
    wet = {**_WET, "bumpScale": 0.0025 * diagonal, "translucency": look.translucency}
    for name, picture, own in (
        ("skin", textures.skin(look), {}),
        ("cut", textures.cut_face(look), {"finish": "cut", "emissive": look.glow}),
    ):
        properties = {**wet, **own}
        maps = {"map": picture, "bumpMap": picture}
        scene.set_appearance(name, Appearance("MeshPhongMaterial", properties, maps))


def _cloth(diagonal: float) -> Appearance:
    """Return the appearance of a drape, with relief in proportion to the body's diagonal [m]."""
    picture = textures.cloth()
    properties = {**_CLOTH, "bumpScale": 0.002 * diagonal}
    return Appearance("MeshPhongMaterial", properties, {"map": picture, "bumpMap": picture})


def _appearance_of(shape: Shape) -> Appearance:
    """Return the appearance of a shape of the model: steel, floor, or paint."""
    if shape.is_end:
        return Appearance("MeshPhongMaterial", _STEEL)
    red, green, blue, opacity = (float(channel) for channel in shape.colour)
    colour = int(np.dot(np.round(255.0 * np.clip([red, green, blue], 0.0, 1.0)), [65536, 256, 1]))
    if shape.kind == int(mujoco.mjtGeom.mjGEOM_PLANE):
        return Appearance(
            "MeshLambertMaterial",
            {"color": colour, "transparent": True},
            {"alphaMap": textures.fading_disc()},
        )
    if shape.is_target:
        opacity *= TARGET_OPACITY
    see_through = {"opacity": opacity, "transparent": opacity < 1.0}
    return Appearance("MeshPhongMaterial", {**_PAINT, **see_through, "color": colour})


def _plane_around(mesh: TriangleMesh, centre: FloatArray, radius: float) -> TriangleMesh:
    """Return a plane's mesh, resized around a point given in the plane's frame."""
    half = np.abs(mesh.positions).max(axis=0)
    scale = np.array([radius / half[0], radius / half[1], 1.0])
    return mesh._replace(positions=mesh.positions * scale + [centre[0], centre[1], 0.0])


def levels_of(
    values: Mapping[SurfaceQuantity, FloatArray],
) -> tuple[dict[str, IntArray], dict[str, float]]:
    """Return the levels of quantities, and the value of each for which the highest level stands.

    Values below 0 have level 0, those above the top the highest.
    """
    levels: dict[str, IntArray] = {}
    tops: dict[str, float] = {}
    for name, array in values.items():
        top = max(float(np.percentile(array, TOP_PERCENTILE)), 0.0)
        shares = array / top if top > 0.0 else np.zeros_like(array)
        levels[name] = np.rint(HIGHEST_LEVEL * np.clip(shares, 0.0, 1.0)).astype(np.int64)
        tops[name] = top
    return levels, tops
