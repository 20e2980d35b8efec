"""Views in which a body fills a picture up to its margins."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.camera.viewpoints import Viewpoint
from tissue import FloatArray

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


def projected(view: Viewpoint, size: PixelSize, points: FloatArray) -> FloatArray:
    """Return where points [m], shape (n, 3), are in a picture: x to the right, y down [pixels]."""
    forward, up = view.axes
    ahead = points - view.eye
    distance = ahead @ forward
    x = 0.5 * size.width + _scale(view, size) * (ahead @ np.cross(forward, up)) / distance
    y = 0.5 * size.height - _scale(view, size) * (ahead @ up) / distance
    return np.stack([x, y], axis=-1)


def pixel_at(view: Viewpoint, size: PixelSize) -> float:
    """Return the width of a pixel at the distance of the target [m]."""
    return float(np.linalg.norm(view.target - view.eye)) / _scale(view, size)


def fitted(
    points: FloatArray, towards_eye: FloatArray, size: PixelSize, margins: Margins
) -> Viewpoint:
    """Return the view in which points fill a picture up to its margins.

    Args:
        points: Points that must be visible [m], shape (n, 3).
        towards_eye: Vector from the middle of the points to the eye [m], shape (3,).
        size: PixelSize of the picture.
        margins: Free space around the points.
    """
    free = np.array([size.width * (1.0 - 2.0 * margins.side), 0.0])
    free[1] = size.height * (1.0 - margins.top - margins.bottom)
    middle = 0.5 * np.array([size.width, size.height * (1.0 + margins.top - margins.bottom)])
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    view = Viewpoint(target + towards_eye, target)
    for _ in range(N_FIT_STEPS):
        low, high = _box(view, size, points)
        half = np.tan(0.5 * np.radians(view.fov_degrees)) / (free / (high - low)).min()
        view = replace(view, fov_degrees=float(2.0 * np.degrees(np.arctan(half))))
        low, high = _box(view, size, points)
        across, down = (0.5 * (low + high) - middle) * pixel_at(view, size)
        forward, up = view.axes
        way = across * np.cross(forward, up) - down * up
        view = replace(view, eye=view.eye + way, target=view.target + way)
    return view


def _scale(view: Viewpoint, size: PixelSize) -> float:
    """Return how many pixels a metre has, a metre ahead of the eye."""
    return 0.5 * size.height / float(np.tan(0.5 * np.radians(view.fov_degrees)))


def _box(view: Viewpoint, size: PixelSize, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest places of projected points [pixels]."""
    seen = projected(view, size, points)
    return seen.min(axis=0), seen.max(axis=0)
