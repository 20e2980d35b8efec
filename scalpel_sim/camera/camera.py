"""A camera of a simulation, or of a model and tissue of your own."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple, Self

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_name
from scalpel_sim.camera.canvas import Canvas, PixelSize
from scalpel_sim.camera.composition import Thing
from scalpel_sim.camera.finishes import PEN_INK, POLISHED_STEEL
from scalpel_sim.camera.identities import Identities
from scalpel_sim.camera.lenses import pixels_through, sight_through
from scalpel_sim.camera.lights import WALL_COLOUR, Light, usual_lights
from scalpel_sim.camera.theatre import Theatre, theatre_of
from scalpel_sim.camera.tissue_parts import TissueParts, part_finishes, part_names
from scalpel_sim.camera.viewpoints import (
    Viewpoint,
    camera_names,
    expect_camera,
    model_cameras,
    shipped_viewpoint,
    usual_camera,
    viewpoint_of,
)
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.looks import look_of
from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from tissue import FloatArray, IntArray
from tissue.support import labels_of_part

_MOST_PIXELS = 8192
"""Longest side of an image [pixels]."""

_NO_TINTS: Mapping[str, Sequence[float]] = MappingProxyType({})


class CameraImage(NamedTuple):
    """Arrays of one instant."""

    rgb: np.ndarray
    """Red, green and blue as bytes, shape (height, width, 3)."""
    depth: np.ndarray
    """Depth along the line of sight [m], float32, shape (height, width)."""
    segmentation: IntArray
    """Number of what each pixel shows, int32, shape (height, width): see `Camera.ids`."""


def image_size(width: int, height: int) -> PixelSize:
    """Return the size of images [pixels].

    Raises:
        UsageError: an image cannot have it.
    """
    for side in (width, height):
        if not isinstance(side, int | np.integer) or not 1 <= side <= _MOST_PIXELS:
            raise UsageError(
                f"an image of {width} x {height} pixels: each side must have 1 to {_MOST_PIXELS}, "
                "a whole number"
            )
    return PixelSize(width, height)


class Camera:
    """A camera that sees the arm and the tissue as they are when an image is taken.

    For example:

        camera = Camera(prepare(SCENES["organ"]), "endoscope", width=320, height=240)
        rgb, depth, segmentation = camera.image()

    The first row of an image is the upper one. Nothing of the simulation is changed, and the
    user's model stays the same to the byte. Images need no screen and no graphics card; the first
    one opens OpenGL, in the process and for the thread that takes it.

    Args:
        sees: A simulation; or a `Theatre`, for a loop of your own.
        name: A `[[view]]` of the scene, a camera of the model, or `overview` or `endoscope`, which
            are always there: for arms and body as they are when the camera is made. None: the
            first view, which pages show at the start; without views the overview.
        width: Width of the images [pixels].
        height: Height of the images [pixels].
        shadows: Whether lamps cast shadows: an image then takes several times as long.
        samples: Samples of each pixel against jagged edges, such as 4; 0: one.
        lights: Lamps; None: those of the model for its own cameras, a lamp beside the lens for
            `endoscope`, the lamps of the page for all others.

    Raises:
        UsageError: no camera has this name, or an image cannot have this size.
    """

    def __init__(
        self,
        sees: Simulation | Theatre,
        name: str | None = None,
        *,
        width: int = 640,
        height: int = 480,
        shadows: bool = False,
        samples: int = 0,
        lights: Sequence[Light] | None = None,
    ) -> None:
        theatre = sees if isinstance(sees, Theatre) else theatre_of(sees)
        self._stage = _Stage(theatre, shadows=shadows, samples=samples)
        self._aim(name or usual_camera(theatre.views), image_size(width, height), lights)

    def another(
        self,
        name: str,
        *,
        width: int | None = None,
        height: int | None = None,
        lights: Sequence[Light] | None = None,
    ) -> "Camera":
        """Return a further camera of the same, which costs less than one by itself.

        Args:
            name: See `Camera`.
            width: Width of its images [pixels]; None: as of this one.
            height: Height of its images [pixels]; None: as of this one.
            lights: See `Camera`.

        Raises:
            UsageError: no camera has this name, or an image cannot have this size.
        """
        other = Camera.__new__(Camera)
        other._stage = self._stage
        other._aim(name, image_size(width or self.width, height or self.height), lights)
        return other

    def _aim(self, name: str, size: PixelSize, lights: Sequence[Light] | None) -> None:
        """Choose the place, the size and the lamps."""
        self.name = name
        """Name of the camera."""
        self._size = size
        self._view = self._usual_view = self._stage.view(name)
        self._has_own_lights = lights is not None
        self.lights: Sequence[Light] | None = lights
        """Lamps of the next image; None: those of the model, and one at the eye."""
        self._put_lights()

    def _put_lights(self) -> None:
        """Put the usual lamps where the camera is, unless it has others."""
        if isinstance(self._view, Viewpoint) and not self._has_own_lights:
            self.lights = usual_lights(self.name, self._view)

    def move_eye(self, by: Sequence[float] | FloatArray) -> None:
        """Put the eye elsewhere; it looks at the same point, and its usual lamps move with it.

        Args:
            by: Displacement from where it was at first [m], world frame, shape (3,).

        Raises:
            UsageError: it is a camera of the model.
        """
        if not isinstance(self._usual_view, Viewpoint):
            raise UsageError(
                f"the camera '{self.name}' is one of the model, and stays where the model has it; "
                "a [[view]] can be put elsewhere"
            )
        eye = self._usual_view.eye + np.asarray(by, np.float64)
        self._view = replace(self._usual_view, eye=eye)
        self._put_lights()

    def parts_of(self, label: str | None = None) -> list[str]:
        """Return the names, as `ids` has them, of the skin and the cut faces of a part of the body.

        Args:
            label: Name of the part; None: all of the body.

        Raises:
            UsageError: the body has no such part.
        """
        return self._stage.parts_of(label)

    def change_look(
        self, brightness: float = 1.0, tints: Mapping[str, Sequence[float]] = _NO_TINTS
    ) -> None:
        """Change lamps and colours of all cameras that come of one another.

        Args:
            brightness: Factor of the light of all lamps.
            tints: Factors of red, green and blue (sRGB) by the name of a part of the body, as
                `ids` has it; those that are not named are as usual.

        Raises:
            UsageError: the body has no such part.
        """
        canvas, parts = self._stage.canvas, self.parts_of()
        for name in tints:
            if name not in parts:
                raise unknown("part of the body", name, parts)
        canvas.brightness = brightness
        for name in parts:
            canvas.tint(name, tints.get(name, (1.0, 1.0, 1.0)))

    @property
    def width(self) -> int:
        """Width of the images [pixels]."""
        return self._size.width

    @property
    def height(self) -> int:
        """Height of the images [pixels]."""
        return self._size.height

    @property
    def names(self) -> list[str]:
        """Names of all cameras that there are."""
        theatre = self._stage.theatre
        return camera_names(theatre.views, theatre.model)

    @property
    def ids(self) -> Mapping[str, int]:
        """Numbers of a segmentation by the names of what they stand for.

        0 is `nothing`; then `skin` and `cut`, or the outside of each label by its name and its cut
        faces as `cut NAME`; then `blade`, each grasper by its name, `arm` and `world`. They
        depend on the scene, and not on what is in the image.
        """
        return MappingProxyType(self._stage.identities.table)

    @property
    def far(self) -> float:
        """Depth where nothing is [m]: `zfar` times the extent of the model, as MuJoCo has it."""
        return self._stage.canvas.far

    @property
    def option(self) -> mujoco.MjvOption:
        """MuJoCo's options of what is drawn of the model, which may be changed.

        All cameras that come of one another share them.
        """
        return self._stage.canvas.option

    @property
    def renderer(self) -> str:
        """Name of what draws; images of two differ in a few bits: note it in a dataset."""
        return self._stage.canvas.renderer()

    def rgb(self) -> np.ndarray:
        """Return red, green and blue as bytes, shape (height, width, 3)."""
        self._look()
        return self._stage.canvas.colours(self._size)

    def depth(self) -> np.ndarray:
        """Return the depth along the line of sight [m], float32, shape (height, width).

        Where nothing is, it is `far`. What is transparent counts as solid.
        """
        self._look()
        return self._stage.canvas.depth(self._size)

    def segmentation(self) -> IntArray:
        """Return what each pixel shows, int32, shape (height, width): see `ids`."""
        self._look()
        places, things = self._stage.canvas.numbers(self._size)
        return self._ids_of(things)[places]

    def image(self) -> CameraImage:
        """Return all that the camera sees at this instant, for less than one after the other."""
        self._look()
        canvas = self._stage.canvas
        places, things, depth = canvas.numbers_and_depth(self._size)
        return CameraImage(canvas.colours(self._size), depth, self._ids_of(things)[places])

    @property
    def theatre(self) -> Theatre:
        """Arm and tissue that the camera sees."""
        return self._stage.theatre

    def lines_of_sight(self, pixels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the eye [m], shape (3,), and directions from it that places of the image show.

        Args:
            pixels: Places as columns and rows, from the upper left corner of the image, shape
                (n, 2): the middle of the first pixel is (0.5, 0.5).

        Returns:
            The eye, and unit vectors of shape (n, 3); world frame.
        """
        canvas = self._stage.canvas
        canvas.look(self._view, self._stage.theatre.data, self.lights)
        return sight_through(canvas.lenses, *self._size, pixels)

    def pixels_of(self, points: FloatArray) -> FloatArray:
        """Return where points are in the image, as columns and rows, shape (n, 2).

        Args:
            points: Before the camera [m], world frame, shape (n, 3).
        """
        canvas = self._stage.canvas
        canvas.look(self._view, self._stage.theatre.data, self.lights)
        return pixels_through(canvas.lenses, *self._size, points)

    def close(self) -> None:
        """Free what OpenGL holds, of all cameras that come of one another."""
        self._stage.canvas.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _look(self) -> None:
        self._stage.refresh()
        self._stage.canvas.look(self._view, self._stage.theatre.data, self.lights)

    def _ids_of(self, things: Iterable[Thing]) -> IntArray:
        return self._stage.identities.of(things)


class _Stage:
    """Canvas of cameras that come of one another, and the tissue in it.

    Args:
        theatre: What they see.
        shadows: Whether lamps cast shadows.
        samples: Samples of each pixel.
    """

    def __init__(self, theatre: Theatre, *, shadows: bool, samples: int) -> None:
        self.theatre, self._link = theatre, theatre.link
        labels: dict[int, str] = {}
        finishes, self._parts = {}, None
        if self._link is not None:
            material = self._link.describe().material
            look = theatre.look or look_of(material)
            labels = theatre.labels()
            self._parts = TissueParts(labels)
            finishes = part_finishes(labels, look)
        self.identities = Identities(theatre, list(finishes))
        self._ink = free_name("ink", finishes)
        if theatre.ink is not None:
            finishes[self._ink] = PEN_INK
        sheets = [shape for shape in shapes_of(theatre.model) if shape.is_blade]
        names = {shape.geom: f"blade of geom {shape.geom}" for shape in sheets}
        self.canvas = Canvas(
            theatre.model,
            finishes=finishes | dict.fromkeys(names.values(), POLISHED_STEEL),
            shadows=shadows,
            samples=samples,
            background=WALL_COLOUR,
        )
        for shape in sheets:  # a box in the model, whose edge is in the middle of a side
            self.canvas.replace_geom(shape.geom, names[shape.geom], shape.mesh)
        if self._link is not None:
            points = theatre.frame.points_to_world(self._link.surface().positions)
            self.canvas.aim_lamps(points)

    def parts_of(self, label: str | None) -> list[str]:
        """See `Camera.parts_of`."""
        if self._link is None:
            return []
        titles = self.theatre.labels()
        names = part_names(titles)
        if label is None:
            return list(names.values())
        known = dict(self._link.describe().labels)
        numbers = labels_of_part(list(titles), known, label)
        return [name for key, name in names.items() if key.label in numbers]

    def view(self, name: str) -> Viewpoint | int:
        """Return the place of a camera; or its number, of one of the model.

        Raises:
            UsageError: no camera has this name.
        """
        theatre = self.theatre
        expect_camera(name, theatre.views, theatre.model)
        for view in theatre.views:
            if view.name == name:
                return viewpoint_of(view, theatre.frame)
        number = model_cameras(theatre.model).get(name)
        if number is not None:
            return number
        points = np.zeros((1, 3)) if self._link is None else self._link.surface().positions
        shapes, poses = list(shapes_of(theatre.model)), body_poses(theatre.data)
        return shipped_viewpoint(name, shapes, poses, points, theatre.frame)

    def refresh(self) -> None:
        """Draw the tissue as it now is."""
        if self._link is None or self._parts is None:
            return
        if self._parts.show(self._link.surface()):
            for name, mesh in self._parts.meshes.items():
                self.canvas.put(name, mesh, self.theatre.frame)
        if self.theatre.ink is not None:
            self.canvas.put(self._ink, self.theatre.ink(), self.theatre.frame)
