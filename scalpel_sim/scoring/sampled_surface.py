"""Surfaces as places on them, evenly spaced, and how far other places are from them."""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray

PLAN_SPACING = 2.5e-4
"""Distance between two places on a plan [m]."""

_HALF_DIAGONAL = 0.5 * 2.0**0.5
"""Half the diagonal of a square of side 1."""


class SampledSurface(NamedTuple):
    """Places in the middles of the cells of a surface, in the body at rest."""

    points: FloatArray
    """The places [m], shape (n, 3)."""
    normals: FloatArray
    """Unit normals there, shape (n, 3)."""
    areas: FloatArray
    """Areas of their cells [m2], shape (n,)."""


class SurfaceSearch:
    """Distances from a surface.

    Args:
        surface: The surface, of one place at least.
        spacing: Longest side of its cells [m].
    """

    def __init__(self, surface: SampledSurface, spacing: float = PLAN_SPACING) -> None:
        from scipy.spatial import cKDTree  # 0.2 s, and only here

        self.surface = surface
        self._tree = cKDTree(surface.points)
        self._cell = _HALF_DIAGONAL * spacing

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the distances of points from the surface [m], shape (n,).

        A cell counts as flat, and as a circle around its corners: along the surface a distance is
        too short by 0.2 of its side at most, and across it none.

        Args:
            points: In the body at rest [m], shape (n, 3).
        """
        _, nearest = self._tree.query(points)
        offsets = points - self.surface.points[nearest]
        across = np.einsum("ni,ni->n", offsets, self.surface.normals[nearest])
        squares = np.einsum("ni,ni->n", offsets, offsets)
        along = np.sqrt(np.maximum(squares - across * across, 0.0))
        return np.asarray(np.hypot(across, np.maximum(along - self._cell, 0.0)))


class TriangleParts(NamedTuple):
    """The equal parts of triangles."""

    middles: FloatArray
    """Middles of the parts [m], shape (n_parts, 3)."""
    normals: FloatArray
    """Their unit normals, shape (n_parts, 3)."""
    areas: FloatArray
    """Their areas [m2], shape (n_parts,)."""


def parts_of_triangles(corners: FloatArray, spacing: float) -> TriangleParts:
    """Divide triangles into equal parts, k x k of each, with sides of `spacing` [m] at most."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    counts = np.maximum(np.ceil(sides.max(axis=1, initial=0.0) / spacing), 1).astype(np.int64)
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(crossed, axis=1)
    normals = crossed / np.maximum(lengths, np.finfo(float).tiny)[:, None]
    middles, owner = [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    for k in np.unique(counts).tolist():
        mine = np.flatnonzero(counts == k)
        middles.append(np.einsum("pk,nkx->npx", _weights_of_parts(k), corners[mine]).reshape(-1, 3))
        owner.append(np.repeat(mine, k * k))
    triangle = np.concatenate(owner)
    areas = (0.5 * lengths / counts**2)[triangle]
    return TriangleParts(np.concatenate(middles), normals[triangle], areas)


def _weights_of_parts(k: int) -> FloatArray:
    """Return the barycentric weights of the middles of the k x k parts of a triangle."""
    i, j = (each.ravel() for each in np.meshgrid(np.arange(k), np.arange(k), indexing="ij"))
    upright, turned = i + j < k, i + j < k - 1
    first = np.concatenate([i[upright] + 1.0 / 3.0, i[turned] + 2.0 / 3.0]) / k
    second = np.concatenate([j[upright] + 1.0 / 3.0, j[turned] + 2.0 / 3.0]) / k
    return np.column_stack([1.0 - first - second, first, second])


def places_on_edges(corners: FloatArray, spacing: float) -> FloatArray:
    """Return places on the edges of triangles, `spacing` apart at most, shape (n, 3).

    In any direction the farthest place of a triangle is on an edge.

    Args:
        corners: Of the triangles [m], shape (n_triangles, 3, 3).
        spacing: [m].
    """
    starts = corners.reshape(-1, 3)
    ways = np.roll(corners, -1, axis=1).reshape(-1, 3) - starts
    counts = np.maximum(np.ceil(np.linalg.norm(ways, axis=1) / spacing), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(starts)), counts)
    first = np.cumsum(counts) - counts
    shares = (np.arange(len(edge)) - first[edge]) / counts[edge]
    return np.asarray(starts[edge] + shares[:, None] * ways[edge])


def sampled_triangles(corners: FloatArray, spacing: float = PLAN_SPACING) -> SampledSurface:
    """Return places on triangles: the middles of the equal parts that they are divided into.

    Args:
        corners: Of the triangles [m], shape (n, 3, 3).
        spacing: Longest side of a part [m].
    """
    parts = parts_of_triangles(corners, spacing)
    return SampledSurface(parts.middles, parts.normals, parts.areas)
