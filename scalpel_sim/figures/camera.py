"""A camera: points in space become places on a picture."""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray

UP = np.array([0.0, 0.0, 1.0])


FITTINGS = 4
"""Times that a view is scaled and moved to fit: each leaves a tenth of what was off."""


class Margins(NamedTuple):
    """What is left free around what is shown, as shares of the picture."""

    side: float
    top: float
    bottom: float


class View(NamedTuple):
    """A way to look at things: from one point, or along one direction (`reach` is then given)."""

    right: FloatArray
    """Unit vector, shape (3,)."""
    up: FloatArray
    """Unit vector, shape (3,)."""
    forward: FloatArray
    """Unit vector, shape (3,)."""
    eye: FloatArray
    """Where it looks from [m], shape (3,)."""
    scale: float
    """Pixels for each metre: one metre ahead of the eye, or anywhere in a parallel view."""
    width: int
    """Pixels."""
    height: int
    """Pixels."""
    is_parallel: bool = False

    def project(self, points: FloatArray) -> FloatArray:
        """Return x and y [pixels] and nearness of points [m], shape (..., 3) each.

        Nearness is linear across a flat triangle on the picture, and larger is nearer: 1 / distance
        [1/m], or minus the distance [m] in a parallel view.
        """
        ahead = points - self.eye
        distance = ahead @ self.forward
        shrink = np.ones_like(distance) if self.is_parallel else 1.0 / distance
        x = 0.5 * self.width + self.scale * (ahead @ self.right) * shrink
        y = 0.5 * self.height - self.scale * (ahead @ self.up) * shrink
        return np.stack([x, y, -distance if self.is_parallel else shrink], axis=-1)


def framing(
    points: FloatArray, towards_eye: FloatArray, width: int, height: int, margins: Margins
) -> View:
    """Return a pinhole camera's view in which points [m], shape (n, 3), fill the picture.

    Args:
        points: What must be seen.
        towards_eye: From the points' middle to the eye [m]: it looks the other way.
        width: [pixels].
        height: [pixels].
        margins: What to leave free around the points.
    """
    free = np.array(
        [width * (1.0 - 2.0 * margins.side), height * (1.0 - margins.top - margins.bottom)]
    )
    down = 0.5 * height * (margins.top - margins.bottom)
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    view = View(*_axes(-towards_eye), target + towards_eye, 1.0, width, height)
    for _ in range(FITTINGS):
        low, high = _box(view, points)
        view = view._replace(scale=float(view.scale * (free / (high - low)).min()))
        low, high = _box(view, points)
        off = 0.5 * (low + high) - 0.5 * np.array([width, height]) - [0.0, down]
        across = float(np.linalg.norm(towards_eye)) / view.scale
        view = view._replace(eye=view.eye + across * (off[0] * view.right - off[1] * view.up))
    return view


def _box(view: View, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the box around points on the picture [pixels]."""
    seen = view.project(points)[:, :2]
    return seen.min(axis=0), seen.max(axis=0)


def look_along(direction: FloatArray, points: FloatArray, n_pixels: int) -> View:
    """Return a parallel view that just holds all points [m], shape (n, 3), in a square."""
    right, up, forward = _axes(direction)
    along = points @ np.stack([right, up, forward], axis=1)
    low, high = along.min(axis=0), along.max(axis=0)
    middle = 0.5 * (low + high)
    eye = middle[0] * right + middle[1] * up + (low[2] - 1.0) * forward
    extent = max(float((high - low)[:2].max()), np.finfo(float).tiny)
    scale = (n_pixels - 2) / extent
    return View(right, up, forward, eye, scale, n_pixels, n_pixels, is_parallel=True)


def _axes(direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return right, up and forward of a view in that direction."""
    forward = direction / np.linalg.norm(direction)
    right = np.cross(forward, UP)
    if np.linalg.norm(right) < 1e-9:  # straight up or down: any right will do
        right = np.array([1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return right, np.cross(right, forward), forward
