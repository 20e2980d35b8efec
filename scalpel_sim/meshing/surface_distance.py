"""The distance of two surfaces, both ways: how far a surface moved as it was filled."""

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from scalpel_sim.meshing.surface import FileSurface
from tissue import FloatArray, IntArray

SAMPLES_OF_SIZE = 60
"""Places along the size of the body at which the distance is measured at least, besides corners."""

NEAR_TRIANGLES = 12
"""Triangles near a place by their middles, among which the nearest is sought first; then twice as
many, until no other one can be nearer."""

MOST_ANGLES = 4e8
"""Solid angles of triangles that are summed at most, some 20 s: where more places are in doubt, the
rest counts."""

MOST_HALVINGS = 20
"""Times that triangles are divided for the samples, at most."""


class _Samples(NamedTuple):
    """A surface of small triangles."""

    points: FloatArray
    triangles: IntArray

    @classmethod
    def of(cls, surface: FileSurface, spacing: float) -> "_Samples":
        """Return that of a surface, with triangles whose sides are at most `spacing` [m] long."""
        from trimesh import remesh

        divide: Any = remesh.subdivide_to_size  # has no types
        points, triangles = divide(
            surface.vertices, surface.triangles, spacing, max_iter=MOST_HALVINGS
        )
        used, triangles = np.unique(triangles, return_inverse=True)
        return cls(points[used], triangles.reshape(-1, 3))

    def distances(self, points: FloatArray) -> FloatArray:
        """Return how far points are from it [m]."""
        from trimesh import triangles

        closest: Any = triangles.closest_point  # has no types
        corners = self.points[self.triangles]
        middles = corners.mean(axis=1)
        reach = np.linalg.norm(corners - middles[:, None], axis=2).max()
        tree, least = cKDTree(middles), np.full(len(points), np.inf)
        unsure, n_near = np.arange(len(points)), NEAR_TRIANGLES
        while len(unsure):
            n_near = min(n_near, len(corners))
            far, near = tree.query(points[unsure], k=np.arange(1, n_near + 1))
            for k in range(n_near):
                ways = np.linalg.norm(
                    closest(corners[near[:, k]], points[unsure]) - points[unsure], axis=1
                )
                least[unsure] = np.fmin(least[unsure], ways)
            if n_near == len(corners):
                break
            unsure = unsure[far[:, -1] - reach < least[unsure]]
            n_near *= 2
        return least

    def normals(self) -> FloatArray:
        """Return the direction in which each place faces."""
        a, b, c = self.points[self.triangles].swapaxes(0, 1)
        areas = np.cross(b - a, c - a)
        normals = np.zeros_like(self.points)
        for k in range(3):
            np.add.at(normals, self.triangles[:, k], areas)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        directions: FloatArray = normals / np.maximum(lengths, np.finfo(np.float64).tiny)
        return directions


def farthest_apart(old: FileSurface, new: FileSurface, step: float) -> float:
    """Return the largest distance of a place of one surface from the other one [m].

    Places of the old surface that lie inside of the body that it encloses do not count: where parts
    overlap, nothing of the new one belongs there.

    Args:
        old: The surface that was filled: closed, with triangles that face one way.
        new: That of what it was filled with.
        step: Distance from the old surface at which it is asked whether that is inside [m].
    """
    spacing = old.size() / SAMPLES_OF_SIZE
    before, after = _Samples.of(old, spacing), _Samples.of(new, spacing)
    ways = after.distances(before.points)
    normals = before.normals()
    most = int(MOST_ANGLES / len(old.triangles))
    for place in np.argsort(ways)[::-1][:most]:
        if ways[place] <= step or not _is_within(old, before.points[place], step * normals[place]):
            break
        ways[place] = 0.0
    return float(max(ways.max(), before.distances(after.points).max()))


def _is_within(surface: FileSurface, place: FloatArray, way: FloatArray) -> bool:
    """Return whether there is body on both sides of a place of a surface, so far from it [m]."""
    corners = surface.vertices[surface.triangles]
    return all(abs(_winding_number(corners - (place + w))) > 0.5 for w in (way, -way))


def _winding_number(corners: FloatArray) -> float:
    """Return how often triangles wind round the origin (Van Oosterom and Strackee, 1983)."""
    a, b, c = corners.swapaxes(0, 1)
    la, lb, lc = np.linalg.norm(corners, axis=2).T
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return float(np.arctan2(volume, below).sum() / (2.0 * np.pi))
