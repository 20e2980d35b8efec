"""A camera that sees a recorded run: shapes of the arm, and surfaces of the body."""

from collections.abc import Mapping, Sequence

import numpy as np

from bridge import TissueFrame
from scalpel_sim.camera.canvas import Canvas, PixelSize
from scalpel_sim.camera.finishes import POLISHED_STEEL, Finish
from scalpel_sim.camera.lights import WALL_COLOUR, usual_lights
from scalpel_sim.camera.tissue_parts import TissueParts, part_finishes
from scalpel_sim.camera.viewpoints import SHIPPED, Viewpoint, shipped_viewpoint, viewpoint_of
from scalpel_sim.errors import unknown
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.looks import Look
from scalpel_sim.viewer.model_shapes import Shape, position_and_rotation
from tissue import FloatArray, Surface


class PlayedCamera:
    """Draws instants of a run that is not simulated.

    Args:
        shapes: Visible shapes of the arm's model.
        frame: Where the tissue lies in the world.
        labels: Names of the labels of the body; none of a body with one.
        look: Look of the body.
        shadows: Whether lamps cast shadows.
        samples: Samples of each pixel, against jagged edges; 0: one.
    """

    def __init__(
        self,
        shapes: Sequence[Shape],
        frame: TissueFrame,
        labels: Mapping[int, str],
        look: Look,
        *,
        shadows: bool = False,
        samples: int = 0,
    ) -> None:
        self._shapes = [shape for shape in shapes if not shape.is_target]
        self._frame, self._parts = frame, TissueParts(labels)
        finishes = part_finishes(labels, look)
        self._names = [f"geom {shape.geom}" for shape in self._shapes]
        for name, shape in zip(self._names, self._shapes, strict=True):
            red, green, blue, opacity = shape.colour.tolist()
            painted = Finish((red, green, blue, opacity))
            finishes[name] = POLISHED_STEEL if shape.is_blade else painted
        self._canvas = Canvas(
            finishes=finishes, shadows=shadows, samples=samples, background=WALL_COLOUR
        )
        self._view: Viewpoint | None = None
        self._name = ""

    def aim(
        self, name: str, views: Sequence[ViewTable], surface: Surface, body_poses: FloatArray
    ) -> None:
        """Choose the place, for arms and body at the start.

        Args:
            name: One of the views, or `overview` or `endoscope`.
            views: Cameras of the scene.
            surface: Surface of the body.
            body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.

        Raises:
            UsageError: no camera has this name.
        """
        places = {view.name: viewpoint_of(view, self._frame) for view in reversed(views)}
        if name not in places and name not in SHIPPED:
            raise unknown("camera", name, [*(view.name for view in views), *SHIPPED])
        shipped = (self._shapes, body_poses, surface.positions, self._frame)
        self._name, self._view = name, places.get(name) or shipped_viewpoint(name, *shipped)
        points = self._frame.points_to_world(surface.positions)
        self._canvas.aim_lamps(points)

    def rgb(self, surface: Surface, body_poses: FloatArray, size: PixelSize) -> np.ndarray:
        """Return what is seen of an instant: bytes, shape (height, width, 3).

        Args:
            surface: Surface of the body.
            body_poses: Poses of all bodies of the model.
            size: Size of the picture [pixels].
        """
        assert self._view is not None
        if self._parts.show(surface):
            for name, mesh in self._parts.meshes.items():
                self._canvas.put(name, mesh, self._frame)
        for name, shape in zip(self._names, self._shapes, strict=True):
            self._canvas.put(name, shape.mesh, _pose_of(shape, body_poses))
        self._canvas.look(self._view, lights=usual_lights(self._name, self._view))
        return self._canvas.colours(size)

    def renderer(self) -> str:
        """Return what draws: see `gl_context.renderer_name`."""
        return self._canvas.renderer()

    def close(self) -> None:
        """Free what OpenGL holds."""
        self._canvas.close()


def _pose_of(shape: Shape, body_poses: FloatArray) -> TissueFrame:
    """Return where a shape is in the world."""
    (place, own), (origin, turned) = (
        position_and_rotation(_of_unit(pose)) for pose in (shape.pose, body_poses[shape.body])
    )
    return TissueFrame(turned @ own, turned @ place + origin)


def _of_unit(pose: FloatArray) -> FloatArray:
    """Return a pose whose quaternion has length 1: a recorded one is of single precision."""
    pose = np.array(pose, np.float64)
    pose[3:] /= np.linalg.norm(pose[3:])
    return pose
