"""A camera that sees a recorded run: arm and body at any of its steps."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Self

import numpy as np

from bridge import TissueFrame
from scalpel_sim.camera.camera import CameraImage, image_size
from scalpel_sim.camera.canvas import Canvas
from scalpel_sim.camera.finishes import POLISHED_STEEL, Finish
from scalpel_sim.camera.identities import IdentityTable, identity_table
from scalpel_sim.camera.lights import WALL_COLOUR, usual_lights
from scalpel_sim.camera.tissue_parts import TissueParts, part_finishes
from scalpel_sim.camera.viewpoints import (
    Viewpoint,
    shipped_viewpoint,
    usual_camera,
    viewpoint_of,
)
from scalpel_sim.errors import unknown
from scalpel_sim.saved_run.saved_run import SavedRun
from scalpel_sim.saved_run.saved_step import SavedStep
from scalpel_sim.scene.schema import SHIPPED_CAMERAS
from scalpel_sim.viewer.model_shapes import Shape, position_and_rotation
from tissue import FloatArray, IntArray


class PlayedCamera:
    """Takes images of the steps of a recorded run, which is not simulated.

    It has the cameras that `Camera` has, and the same numbers of a segmentation. Lamps are those of
    the page, as a recording has none of the model.

    Args:
        run: The run; it must stay open.
        name: A view of the scene, a camera of the arm's model, or `overview` or `endoscope`, which
            stand where the start of the run has them. None: see `Camera`.
        width: Width of the images [pixels].
        height: Height of the images [pixels].
        shadows: Whether lamps cast shadows.
        samples: Samples of each pixel, against jagged edges; 0: one.

    Raises:
        UsageError: no camera has this name, or an image cannot have this size.
    """

    def __init__(
        self,
        run: SavedRun,
        name: str | None = None,
        *,
        width: int = 640,
        height: int = 480,
        shadows: bool = False,
        samples: int = 0,
    ) -> None:
        self._size = image_size(width, height)
        stage, first = run.stage, run.step(0)
        self._run, self._frame = run, run.frame
        labels = {} if first.surface.labels is None else dict(run.label_names)
        labels |= {each.label: each.title for each in stage.look.labels if labels}
        self._parts = TissueParts(labels)
        finishes = part_finishes(labels, stage.look)
        table = identity_table(list(finishes), run.graspers)
        self.ids: Mapping[str, int] = MappingProxyType(table.by_name)
        """Numbers of a segmentation: see `Camera.ids`."""
        self._numbers = {part: table.by_name[part] for part in finishes}
        self._shapes = {f"geom {each.geom}": each for each in stage.shapes if not each.is_target}
        for key, shape in self._shapes.items():
            red, green, blue, opacity = shape.colour.tolist()
            painted = Finish((red, green, blue, opacity))
            finishes[key] = POLISHED_STEEL if shape.is_blade else painted
            self._numbers[key] = self._number_of(shape, table)
        self._canvas = Canvas(
            finishes=finishes, shadows=shadows, samples=samples, background=WALL_COLOUR
        )
        self._canvas.aim_lamps(self._frame.points_to_world(first.surface.positions))
        self.name = name or usual_camera(stage.views)
        """Name of the camera."""
        self._fixed_view = self._view_at_start(first)

    @property
    def names(self) -> list[str]:
        """Names of all cameras that there are."""
        stage = self._run.stage
        cameras = (camera.name for camera in stage.cameras)
        return list(
            dict.fromkeys([*(view.name for view in stage.views), *cameras, *SHIPPED_CAMERAS])
        )

    @property
    def far(self) -> float:
        """Depth where nothing is [m]."""
        return self._canvas.far

    @property
    def renderer(self) -> str:
        """Name of what draws: see `gl_context.renderer_name`."""
        return self._canvas.renderer()

    def rgb(self, step: SavedStep) -> np.ndarray:
        """Return red, green and blue of a step as bytes, shape (height, width, 3)."""
        self._look(step)
        return self._canvas.colours(self._size)

    def image(self, step: SavedStep) -> CameraImage:
        """Return all that the camera sees of a step."""
        self._look(step)
        places, things, depth = self._canvas.numbers_and_depth(self._size)
        numbers = [self._numbers[str(thing.mesh)] for thing in things]
        ids: IntArray = np.array([*numbers, 0], np.int32)
        return CameraImage(self._canvas.colours(self._size), depth, ids[places])

    def close(self) -> None:
        """Free what OpenGL holds."""
        self._canvas.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _number_of(self, shape: Shape, table: IdentityTable) -> int:
        """Return the number of a shape in a segmentation."""
        if shape.is_blade:
            return table.blade
        stage = self._run.stage
        for name, bodies in stage.graspers.items():
            if shape.body in bodies:
                return table.graspers[name]
        return table.arm if shape.body in stage.arm_bodies else table.world

    def _view_at_start(self, first: SavedStep) -> Viewpoint | None:
        """Return the place of the camera; None of one of the model, which may move.

        Raises:
            UsageError: no camera has its name.
        """
        stage = self._run.stage
        for view in stage.views:
            if view.name == self.name:
                return viewpoint_of(view, self._frame)
        if any(camera.name == self.name for camera in stage.cameras):
            return None
        if self.name not in SHIPPED_CAMERAS:
            raise unknown("camera", self.name, self.names)
        shapes = list(self._shapes.values())
        return shipped_viewpoint(
            self.name, shapes, first.body_poses, first.surface.positions, self._frame
        )

    def _view(self, step: SavedStep) -> Viewpoint:
        """Return where the camera is."""
        if self._fixed_view is not None:
            return self._fixed_view
        cameras = self._run.stage.cameras
        number = [camera.name for camera in cameras].index(self.name)
        eye, rotation = position_and_rotation(_of_unit(step.camera_poses[number]))
        _, up, backward = rotation.T
        return Viewpoint(eye, eye - backward, up, cameras[number].fov_degrees)

    def _look(self, step: SavedStep) -> None:
        """Compose what is seen of a step."""
        if self._parts.show(step.surface):
            for name, mesh in self._parts.meshes.items():
                self._canvas.put(name, mesh, self._frame)
        for key, shape in self._shapes.items():
            self._canvas.put(key, shape.mesh, _pose_of(shape, step.body_poses))
        view = self._view(step)
        self._canvas.look(view, lights=usual_lights(self.name, view))


def _pose_of(shape: Shape, body_poses: FloatArray) -> TissueFrame:
    """Return where a shape is in the world."""
    (place, own), (origin, turned) = (
        position_and_rotation(_of_unit(pose)) for pose in (shape.pose, body_poses[shape.body])
    )
    return TissueFrame(turned @ own, turned @ place + origin)


def _of_unit(pose: FloatArray) -> FloatArray:
    """Return a pose whose quaternion has length 1 in double precision."""
    pose = np.array(pose, np.float64)
    pose[3:] /= np.linalg.norm(pose[3:])
    return pose
