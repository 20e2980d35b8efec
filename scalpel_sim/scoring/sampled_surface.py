"""A surface as places on it, evenly spaced, and how far other places are from it."""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray, IntArray

PLAN_SPACING = 2.5e-4
"""Distance between two places on a surface [m]."""

_HALF_DIAGONAL = 0.5 * 2.0**0.5
"""Half the diagonal of a square of side 1."""


class SampledSurface(NamedTuple):
    """Places in the middles of cells of `PLAN_SPACING`, in the body at rest."""

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
    """

    def __init__(self, surface: SampledSurface) -> None:
        from scipy.spatial import cKDTree  # 0.2 s, and only here

        self.surface = surface
        self.tree = cKDTree(surface.points)

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the distances of points from the surface [m], shape (n,).

        A cell counts as flat, and as a circle around its corners: along the surface a distance is
        too short by 0.2 of `PLAN_SPACING` at most, and across it none.

        Args:
            points: In the body at rest [m], shape (n, 3).
        """
        if len(points) == 0:
            return np.zeros(0)
        _, nearest = self.tree.query(points)
        offsets = points - self.surface.points[nearest]
        across = np.einsum("ni,ni->n", offsets, self.surface.normals[nearest])
        squares = np.einsum("ni,ni->n", offsets, offsets)
        along = np.sqrt(np.maximum(squares - across * across, 0.0))
        beside = np.maximum(along - _HALF_DIAGONAL * PLAN_SPACING, 0.0)
        return np.asarray(np.hypot(across, beside))


def sampled_triangles(corners: FloatArray, spacing: float = PLAN_SPACING) -> SampledSurface:
    """Return places on triangles: the middles of the equal parts that they are divided into.

    Args:
        corners: Of the triangles [m], shape (n, 3, 3).
        spacing: Longest side of a part [m].
    """
    points, normals, areas, _ = parts_of_triangles(corners, spacing)
    return SampledSurface(points, normals, areas)


class TriangleParts(NamedTuple):
    """The equal parts of triangles, one after the other."""

    middles: FloatArray
    """Middles of the parts [m], shape (n_parts, 3)."""
    normals: FloatArray
    """Their unit normals, shape (n_parts, 3)."""
    areas: FloatArray
    """Their areas [m2], shape (n_parts,)."""
    triangle: IntArray
    """The triangle of each, shape (n_parts,)."""


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
        weights = _weights_of_parts(k)
        middles.append(np.einsum("pk,nkx->npx", weights, corners[mine]).reshape(-1, 3))
        owner.append(np.repeat(mine, k * k))
    triangle = np.concatenate(owner)
    areas = 0.5 * lengths / counts**2
    return TriangleParts(np.concatenate(middles), normals[triangle], areas[triangle], triangle)


def _weights_of_parts(k: int) -> FloatArray:
    """Return the barycentric weights of the middles of the k x k parts of a triangle."""
    i, j = (each.ravel() for each in np.meshgrid(np.arange(k), np.arange(k), indexing="ij"))
    upright, turned = i + j < k, i + j < k - 1
    first = np.concatenate([i[upright] + 1.0 / 3.0, i[turned] + 2.0 / 3.0]) / k
    second = np.concatenate([j[upright] + 1.0 / 3.0, j[turned] + 2.0 / 3.0]) / k
    return np.column_stack([1.0 - first - second, first, second])
