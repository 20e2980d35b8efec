"""Places of cameras: those of the scene and of the model, and two that are always there."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.errors import unknown
from scalpel_sim.scene.schema import DEFAULT_FOV, OVERVIEW, SHIPPED_CAMERAS, ViewTable
from scalpel_sim.viewer.model_shapes import Shape
from scalpel_sim.viewer.own_camera import own_eye
from tissue import FloatArray

ENDOSCOPE_FOV = 60.0
"""Angle from the lower to the upper side of the picture of an endoscope [degree]: laparoscopes have
60 to 80 across their round picture."""

ENDOSCOPE_DISTANCE = 1.0
"""Distance of the endoscope from the middle of the body, in diagonals of the body: all of it is in
the picture, and fills it."""

_ASIDE = 1e-6
"""Least sine of the angle between the line of sight and the direction that points up."""


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """Where a camera is, and how it is turned, world frame."""

    eye: FloatArray
    """Where it is [m], shape (3,)."""
    target: FloatArray
    """Point in the middle of the picture [m], shape (3,)."""
    up: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """Direction to the upper side of the picture, shape (3,)."""
    fov_degrees: float = DEFAULT_FOV
    """Angle from the lower to the upper side of the picture [degree]."""

    @cached_property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Unit vectors forward and up of the picture, shape (3,) each."""
        forward = np.subtract(self.target, self.eye).astype(np.float64)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        if np.linalg.norm(right) < _ASIDE:  # straight up or down: any direction can be right
            right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
        right /= np.linalg.norm(right)
        return forward, np.cross(right, forward)


def viewpoint_of(view: ViewTable, frame: TissueFrame) -> Viewpoint:
    """Return the place of a `[[view]]` in the world.

    Args:
        view: The view, in the frame of the tissue.
        frame: Where the tissue lies in the world.
    """
    eye, target = frame.points_to_world(np.array([view.eye, view.target], np.float64))
    up = frame.vectors_to_world(np.array(view.up, np.float64))
    return Viewpoint(eye, target, up, view.fov_degrees)


def model_cameras(model: mujoco.MjModel) -> dict[str, int]:
    """Return the numbers of the cameras of a model by their names."""
    names = (model.camera(i).name for i in range(model.ncam))
    return {name: i for i, name in enumerate(names) if name}


def shipped_viewpoint(
    name: str,
    shapes: Sequence[Shape],
    body_poses: FloatArray,
    surface: FloatArray,
    frame: TissueFrame,
) -> Viewpoint:
    """Return the place of a camera that is always there, for arms and body as they are now.

    Both look from where the blade enters, past the arms: the overview at body and instruments, the
    endoscope from near.

    Args:
        name: `overview` or `endoscope`.
        shapes: Visible shapes of the model.
        body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.
        surface: Points of the body's surface [m], tissue frame, shape (n, 3).
        frame: Where the tissue lies in the world.
    """
    lowest, highest = surface.min(axis=0), surface.max(axis=0)
    centre = frame.points_to_world(0.5 * (lowest + highest))
    eye = own_eye(shapes, body_poses, surface, frame)
    if name == OVERVIEW:
        return Viewpoint(eye, centre)
    way = (eye - centre) / np.linalg.norm(eye - centre)
    distance = ENDOSCOPE_DISTANCE * float(np.linalg.norm(highest - lowest))
    return Viewpoint(centre + distance * way, centre, fov_degrees=ENDOSCOPE_FOV)


def usual_camera(views: Sequence[ViewTable]) -> str:
    """Return the name of the camera where none is asked for: the first view, else the overview."""
    return views[0].name if views else OVERVIEW


def camera_names(views: Sequence[ViewTable], model: mujoco.MjModel) -> list[str]:
    """Return the names of all cameras: of the scene, of the model, and those always there."""
    names = [*(view.name for view in views), *model_cameras(model), *SHIPPED_CAMERAS]
    return list(dict.fromkeys(names))


def expect_camera(name: str, views: Sequence[ViewTable], model: mujoco.MjModel) -> None:
    """Refuse a camera that is not there.

    Raises:
        UsageError: no camera has this name; the message names them all.
    """
    names = camera_names(views, model)
    if name not in names:
        raise unknown("camera", name, names)
