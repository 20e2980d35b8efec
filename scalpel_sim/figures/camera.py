"""A camera, which projects points in space to the picture."""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.scene.schema import ViewTable
from tissue import FloatArray

UP = np.array([0.0, 0.0, 1.0])
"""Direction that points up in a picture."""

N_FIT_STEPS = 4
"""Number of times that a view is scaled and moved to fit. Each time a tenth of the error is
left."""


class Margins(NamedTuple):
    """Free space around the body, as fractions of the picture."""

    side: float
    """Fraction of the width, on the left and on the right."""
    top: float
    """Fraction of the height."""
    bottom: float
    """Fraction of the height."""


class View(NamedTuple):
    """A perspective or parallel projection."""

    right: FloatArray
    """Unit vector to the right of the picture, shape (3,)."""
    up: FloatArray
    """Unit vector to the top of the picture, shape (3,)."""
    forward: FloatArray
    """Unit vector into the picture, shape (3,)."""
    eye: FloatArray
    """Position of the eye [m], shape (3,)."""
    scale: float
    """Pixels per metre, one metre ahead of the eye or anywhere in a parallel projection."""
    width: int
    """Width of the picture [pixels]."""
    height: int
    """Height of the picture [pixels]."""
    is_parallel: bool = False
    """Whether the projection is parallel rather than perspective."""

    def sampled(self, samples: int) -> "View":
        """Return the view with so many samples along each side of a pixel, against aliasing."""
        return self._replace(
            width=samples * self.width, height=samples * self.height, scale=samples * self.scale
        )

    def project(self, points: FloatArray) -> FloatArray:
        """Return x and y [pixels] and nearness of points [m], shape (..., 3) each.

        Nearness is larger for nearer points and linear across a triangle of the picture: it is
        1 / distance [1/m], or minus the distance [m] in a parallel projection.
        """
        ahead = points - self.eye
        distance = ahead @ self.forward
        shrink = np.ones_like(distance) if self.is_parallel else 1.0 / distance
        x = 0.5 * self.width + self.scale * (ahead @ self.right) * shrink
        y = 0.5 * self.height - self.scale * (ahead @ self.up) * shrink
        return np.stack([x, y, -distance if self.is_parallel else shrink], axis=-1)


def mean_of_samples(image: FloatArray, samples: int) -> FloatArray:
    """Return an image, shape (height, width, 3), from one of so many samples along each side."""
    height, width, _ = image.shape
    pixels = image.reshape(height // samples, samples, width // samples, samples, 3)
    return np.asarray(pixels.mean(axis=(1, 3)))


def fit_view(
    points: FloatArray, towards_eye: FloatArray, width: int, height: int, margins: Margins
) -> View:
    """Return the perspective view in which points fill the picture up to its margins.

    Args:
        points: Points that must be visible [m], shape (n, 3).
        towards_eye: Vector from the centre of the points to the eye [m], shape (3,).
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
        margins: Free space around the points.
    """
    free = np.array(
        [width * (1.0 - 2.0 * margins.side), height * (1.0 - margins.top - margins.bottom)]
    )
    down = 0.5 * height * (margins.top - margins.bottom)
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    view = View(*_axes(-towards_eye), target + towards_eye, 1.0, width, height)
    for _ in range(N_FIT_STEPS):
        low, high = _box(view, points)
        view = view._replace(scale=float(view.scale * (free / (high - low)).min()))
        low, high = _box(view, points)
        off = 0.5 * (low + high) - 0.5 * np.array([width, height]) - [0.0, down]
        across = float(np.linalg.norm(towards_eye)) / view.scale
        view = view._replace(eye=view.eye + across * (off[0] * view.right - off[1] * view.up))
    return view


def view_from(camera: ViewTable, width: int, height: int) -> View:
    """Return the perspective view of a scene's camera; lengths in the frame of the tissue.

    Args:
        camera: Where it is, and how it is turned.
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
    """
    eye = np.array(camera.eye)
    axes = _axes(np.array(camera.target) - eye, np.array(camera.up))
    scale = 0.5 * height / math.tan(0.5 * math.radians(camera.fov_degrees))
    return View(*axes, eye, scale, width, height)


def _box(view: View, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the bounding box of the projected points [pixels]."""
    seen = view.project(points)[:, :2]
    return seen.min(axis=0), seen.max(axis=0)


def parallel_view(direction: FloatArray, points: FloatArray, n_pixels: int) -> View:
    """Return the parallel view in which points [m], shape (n, 3), fill a square picture."""
    right, up, forward = _axes(direction)
    along = points @ np.stack([right, up, forward], axis=1)
    low, high = along.min(axis=0), along.max(axis=0)
    middle = 0.5 * (low + high)
    eye = middle[0] * right + middle[1] * up + (low[2] - 1.0) * forward
    extent = max(float((high - low)[:2].max()), np.finfo(float).tiny)
    scale = (n_pixels - 2) / extent
    return View(right, up, forward, eye, scale, n_pixels, n_pixels, is_parallel=True)


def _axes(
    direction: FloatArray, upward: FloatArray = UP
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the unit vectors right, up and forward of a view in a direction, the right way up."""
    forward = direction / np.linalg.norm(direction)
    right = np.cross(forward, upward)
    if np.linalg.norm(right) < 1e-9:  # straight up or down: any direction can be right
        right = np.array([1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return right, np.cross(right, forward), forward
