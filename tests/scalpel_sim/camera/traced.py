"""A twin of cameras: rays through the middles of pixels, and what they hit first."""

from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.camera.theatre import Theatre
from scalpel_sim.camera.viewpoints import Viewpoint

SNAP = 1 / 128
"""How far from the middle of a pixel a picture may be sampled [pixels]: renderers place corners of
triangles on a grid of 1/256, and both ends of an edge move."""


class Hit(NamedTuple):
    """Surface that a ray hits first."""

    depth: float
    """Depth along the line of sight [m]; infinite: nothing."""
    triangle: int = -1
    """Triangle of the tissue; -1: none."""
    geom: int = -1
    """Geom of the model; -1: none."""


class Tracer:
    """Casts rays of a picture at tissue and the geoms of a model, which it takes as exact."""

    def __init__(self, theatre: Theatre, view: Viewpoint, size: tuple[int, int]) -> None:
        self._theatre, self._view, self._size = theatre, view, size
        surface = theatre.link.surface()
        corners = theatre.frame.points_to_world(surface.positions)[surface.triangles]
        self._a = corners[:, 0]
        self._first, self._second = corners[:, 1] - self._a, corners[:, 2] - self._a

    def hit(self, row: float, column: float) -> Hit:
        """Return what the ray through a place of the picture hits, in pixels from its corner."""
        view, (width, height) = self._view, self._size
        forward = (view.target - view.eye) / np.linalg.norm(view.target - view.eye)
        right = np.cross(forward, view.up)
        right /= np.linalg.norm(right)
        above = np.cross(right, forward)
        half = np.tan(np.radians(view.fov_degrees) / 2)
        x, y = (2 * column - width) / height * half, (1 - 2 * row / height) * half
        way = forward + x * right + y * above  # by 1 m of depth
        triangle, depth = self._of_tissue(view.eye, way)
        geom = np.array([-1], np.int32)
        model, data = self._theatre.model, self._theatre.data
        length = np.linalg.norm(way)
        far = mujoco.mj_ray(model, data, view.eye, way / length, None, 1, -1, geom) / length
        if 0.0 <= far < depth:
            return Hit(far, geom=int(geom[0]))
        return Hit(depth, triangle=triangle)

    def hits_around(self, row: int, column: int) -> list[Hit]:
        """Return what rays around the middle of a pixel hit."""
        off = SNAP * np.array([[0, 0], [1, 1], [1, -1], [-1, 1], [-1, -1]])
        return [self.hit(row + 0.5 + i, column + 0.5 + j) for i, j in off]

    def _of_tissue(self, eye: np.ndarray, way: np.ndarray) -> tuple[int, float]:
        """Return the triangle that a ray hits first, and where along it (Moeller, Trumbore)."""
        p = np.cross(way, self._second)
        size = (self._first * p).sum(axis=1)
        size = np.where(np.abs(size) < 1e-16, np.inf, size)
        off = eye - self._a
        u = (off * p).sum(axis=1) / size
        q = np.cross(off, self._first)
        v, t = (q @ way) / size, (self._second * q).sum(axis=1) / size
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        best = int(t.argmin())
        return (best, float(t[best])) if np.isfinite(t[best]) else (-1, np.inf)
