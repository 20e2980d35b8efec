"""Draws a MuJoCo model, and triangle meshes that change, into arrays. No screen is needed."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.camera.composition import Composition, Thing
from scalpel_sim.camera.finishes import Finish
from scalpel_sim.camera.gl_context import (
    chosen_backend,
    current_renderer,
    expect_own_process,
    open_context,
)
from scalpel_sim.camera.lights import Light, Rgb, put_light
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray, IntArray

_REACH, _SHADOWED = 4.0, 0.9
"""Distance of lamps that are far away, and half the width in which they cast shadows, over the size
of what is in the middle. MuJoCo's own width is the extent of the model, and gives an arm's length
as many pixels of shadow as a cut."""


class PixelSize(NamedTuple):
    """Size of a picture [pixels]."""

    width: int
    height: int


class Canvas:
    """Draws a MuJoCo model, and triangle meshes that change, into arrays.

    Put meshes, `look` from somewhere, then take what was seen. The model is only read: it stays as
    it is, to the byte. OpenGL is opened with the first picture, in the process and for the thread
    that draws it. For example, a mesh alone, lit from above:

        canvas = Canvas(finishes={"stone": Finish(colour=(0.9, 0.9, 0.8, 1.0))})
        canvas.put("stone", mesh)
        canvas.look(Viewpoint(eye, target), lights=[Light((0.0, 0.0, -1.0))])
        rgb = canvas.colours(PixelSize(640, 480))

    To average pictures with a lamp that moves, which makes soft shadows, call `look` and `colours`
    again with other lights: meshes stay.

    Args:
        model: A compiled model; None: nothing but the meshes.
        finishes: Look of each mesh that is put later, by its name.
        shadows: Whether lamps cast shadows.
        samples: Samples of each pixel, against jagged edges: 0, 2, 4, 8 or more.
        background: Rgb where nothing is, by which the model has no sky of its own (sRGB).
    """

    def __init__(
        self,
        model: mujoco.MjModel | None = None,
        *,
        finishes: Mapping[str, Finish],
        shadows: bool = False,
        samples: int = 0,
        background: Rgb = (0.0, 0.0, 0.0),
    ) -> None:
        self._model = mujoco.MjSpec().compile() if model is None else model
        self._data = mujoco.MjData(self._model) if model is None else None
        self._composition = Composition(
            self._model, finishes, shadows=shadows, samples=samples, background=background
        )
        self.option = mujoco.MjvOption()
        """MuJoCo's options of what is drawn of the model. Sites are left out."""
        self.option.sitegroup[:] = 0
        self.brightness = 1.0
        """Factor of the light of all lamps."""
        self.middle, self.extent = np.zeros(3), 1.0
        """Middle and size of what lamps that are far away shadow [m], world frame."""
        self._gl: Any = None
        self._context: Any = None
        self._lamps_are_ours, self._clip = False, 0.0
        self._size = PixelSize(0, 0)

    @property
    def n_models(self) -> int:
        """Models that were made so far for meshes that grew."""
        return self._composition.n_models

    def put(self, name: str, mesh: TriangleMesh, frame: TissueFrame = TissueFrame()) -> None:
        """Put a mesh, or replace it; its arrays must not be changed afterwards.

        Args:
            name: One of the names of the finishes.
            mesh: Triangles with normals and, for a picture, texture coordinates.
            frame: Where its frame is in the world.
        """
        self._composition.put(name, mesh, frame)

    def replace_geom(self, geom: int, name: str, mesh: TriangleMesh) -> None:
        """Draw a mesh in place of a geom of the model; call it before the first picture.

        Args:
            geom: MuJoCo's number of the geom.
            name: One of the names of the finishes, which no other mesh has.
            mesh: What it looks like, in its own frame.
        """
        self._composition.replace_geom(geom, name, mesh)

    def tint(self, name: str, factor: Sequence[float]) -> None:
        """Multiply the colour of a mesh, as its finish has it.

        Args:
            name: One of the names of the finishes.
            factor: Factors of red, green and blue (sRGB); none becomes more than 1.
        """
        self._composition.tint(name, factor)

    def aim_lamps(self, points: FloatArray) -> None:
        """Choose what lamps that are far away shadow: points of it [m], world frame, (n, 3)."""
        self.middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        self.extent = float(np.linalg.norm(np.ptp(points, axis=0)))

    @property
    def lenses(self) -> Sequence[mujoco.MjvGLCamera]:
        """MuJoCo's two lenses, as `look` has aimed them; one picture is of both, which are one."""
        return list(self._composition.scene.camera)

    def look(
        self,
        view: Viewpoint | int,
        data: mujoco.MjData | None = None,
        lights: Sequence[Light] | None = None,
    ) -> None:
        """Compose what is seen from somewhere, by these lamps.

        Args:
            view: The place; or the number of a camera of the model.
            data: Data of the model; None where there is no model.
            lights: Lamps that replace those of the model and the one at the eye; None: those.
        """
        composition = self._composition
        composition.look(view, self.far, data or self._data, self.option)
        self._lamps_are_ours = lights is not None
        if lights is not None:
            composition.scene.nlight = len(lights)
            for light, into in zip(lights, composition.scene.lights, strict=False):
                reach = _REACH * self.extent
                put_light(light, into, middle=self.middle, reach=reach)
        if self.brightness != 1.0:
            for light in composition.scene.lights[: composition.scene.nlight]:
                for part in (light.diffuse, light.specular, light.ambient):
                    part *= self.brightness

    def colours(self, size: PixelSize) -> np.ndarray:
        """Return what was seen, red, green and blue as bytes, shape (height, width, 3)."""
        return self._drawn(size, colours=True, depth=False)[0]

    def depth(self, size: PixelSize) -> np.ndarray:
        """Return the depth along the line of sight [m], float32, shape (height, width).

        Where nothing is, it is `far`. What is transparent counts as solid.
        """
        with self._as_numbers():
            return self._drawn(size, colours=False, depth=True)[1]

    def numbers(self, size: PixelSize) -> tuple[IntArray, list[Thing]]:
        """Return what each pixel shows, as places in a list; -1: nothing.

        Returns:
            Places in the list, shape (height, width); and the list.
        """
        return self._numbers(size, depth=False)[:2]

    def numbers_and_depth(self, size: PixelSize) -> tuple[IntArray, list[Thing], np.ndarray]:
        """Return `numbers` and `depth` of one drawing."""
        return self._numbers(size, depth=True)

    def _numbers(self, size: PixelSize, *, depth: bool) -> tuple[IntArray, list[Thing], np.ndarray]:
        with self._as_numbers():
            colours, metres = self._drawn(size, colours=True, depth=depth)
        things = self._composition.things()
        red, green, blue = (colours[:, :, i].astype(np.int32) for i in range(3))
        return (red | green << 8 | blue << 16) - 1, things, metres

    @contextmanager
    def _as_numbers(self) -> Iterator[None]:
        """Draw the numbers of geoms in place of colours."""
        flags, kinds = self._composition.scene.flags, mujoco.mjtRndFlag
        flags[kinds.mjRND_SEGMENT] = flags[kinds.mjRND_IDCOLOR] = True
        try:
            yield
        finally:
            flags[kinds.mjRND_SEGMENT] = flags[kinds.mjRND_IDCOLOR] = False

    def renderer(self) -> str:
        """Return what draws: see `gl_context.renderer_name`."""
        self._open(PixelSize(1, 1))
        return current_renderer()

    def close(self) -> None:
        """Free what OpenGL holds. The next picture opens it again."""
        if self._gl is not None:
            self._gl.make_current()
            if self._context is not None:
                self._context.free()
            self._gl.free()
        self._gl = self._context = None

    def __del__(self) -> None:
        # MuJoCo would free its textures and lists in the context that is current: another canvas's.
        if not sys.is_finalizing() and getattr(self, "_gl", None) is not None:
            self.close()

    @property
    def far(self) -> float:
        """Depth beyond which there is nothing [m]: MuJoCo's."""
        return float(self._model.vis.map.zfar * self._model.stat.extent)

    def _drawn(
        self, size: PixelSize, *, colours: bool, depth: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return colours and depth of what was seen; empty arrays where they are not wanted."""
        self._open(size)
        self._context.shadowClip = _SHADOWED * self.extent if self._lamps_are_ours else self._clip
        rectangle = mujoco.MjrRect(0, 0, size.width, size.height)
        mujoco.mjr_render(rectangle, self._composition.scene, self._context)
        rgb = np.empty((size.height, size.width, 3), np.uint8) if colours else None
        shares = np.empty((size.height, size.width), np.float32) if depth else None
        mujoco.mjr_readPixels(rgb, shares, rectangle, self._context)
        found = np.empty((0, 0, 3), np.uint8) if rgb is None else np.ascontiguousarray(rgb[::-1])
        return found, np.empty((0, 0), np.float32) if shares is None else self._metres(shares[::-1])

    def _metres(self, shares: np.ndarray) -> np.ndarray:
        """Return the depth that values of the reversed depth buffer stand for [m]."""
        lens = self._composition.scene.camera[0]
        near, far = float(lens.frustum_near), float(lens.frustum_far)
        values = shares.astype(np.float64)
        if lens.orthographic:
            metres = far - values * (far - near)
        else:
            metres = near * far / (near + values * (far - near))
        return np.minimum(metres, self.far).astype(np.float32)

    def _open(self, size: PixelSize) -> None:
        """Make the context current, with room for a picture of this size."""
        if self._gl is None:
            self._gl = open_context()
        else:
            expect_own_process()
            self._gl.make_current()
        larger = PixelSize(max(size.width, self._size.width), max(size.height, self._size.height))
        if self._context is None:
            self._make_context(larger)
        elif larger != self._size:
            mujoco.mjr_resizeOffscreen(*larger, self._context)
        self._size = larger

    def _make_context(self, size: PixelSize) -> None:
        """Make MuJoCo's context of the second model, for pictures up to a size.

        Where a mesh grows, only the scene needs more room: the context stays.
        """
        model = self._composition.with_room().model
        model.vis.global_.offwidth, model.vis.global_.offheight = size
        with chosen_backend():
            font = int(mujoco.mjtFontScale.mjFONTSCALE_50)
            self._context = mujoco.MjrContext(model, font)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._clip = self._context.shadowClip
