"""Surfaces as places on them, evenly spaced, and how far other places are from them."""

from typing import NamedTuple

import numpy as np

from tissue import BoolArray, FloatArray
from tissue.support import (
    count_places,
    least_distance,
    mark_near_triangles,
    place_tree,
    write_distances,
    write_edge_places,
    write_parts,
)

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
        self._tree = place_tree(surface.points)
        in_order = self._tree.number
        self._normals, self._areas = surface.normals[in_order], surface.areas[in_order]
        self._cell = _HALF_DIAGONAL * spacing
        # Compiled before the first frame, as a cut would wait for it.
        first = surface.points[[0, 0, 0]]
        self.least_distance(first, float(self.distances(first).max()))
        self.mark_near(first, 0.0, np.zeros(len(surface.points), bool))

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the distances of points from the surface [m], shape (n,).

        A cell counts as flat, and as a circle around its corners: along the surface a distance is
        too short by 0.2 of its side at most, and across it none.

        Args:
            points: In the body at rest [m], shape (n, 3).
        """
        found = np.empty(len(points))
        write_distances(self._tree, self._normals, self._cell, points, found)
        return found

    def least_distance(self, points: FloatArray, least: float) -> float:
        """Return the least of a distance and those of points [m]: faster than all of them."""
        return least_distance(self._tree, self._normals, self._cell, points, least)

    def mark_near(self, corners: FloatArray, within: float, marked: BoolArray) -> float:
        """Mark the places of the surface near some triangles; return the area of new ones [m2].

        Args:
            corners: Corners of the triangles one after the other [m], shape (3 n, 3).
            within: Distance up to which a place is near [m].
            marked: Those that are marked already are not looked at, shape (n_places,).
        """
        return mark_near_triangles(self._tree, self._areas, corners, within, marked)


class TriangleParts(NamedTuple):
    """The equal parts of triangles."""

    middles: FloatArray
    """Middles of the parts [m], shape (n_parts, 3)."""
    normals: FloatArray
    """Their unit normals, shape (n_parts, 3)."""
    areas: FloatArray
    """Their areas [m2], shape (n_parts,)."""


def parts_of_triangles(corners: FloatArray, spacing: float) -> TriangleParts:
    """Divide triangles into equal parts, k x k of each.

    Args:
        corners: Of the triangles one after the other [m], shape (3 n, 3).
        spacing: Longest side of a part [m].
    """
    counts = np.empty(len(corners), np.int64)
    n, _ = count_places(corners, spacing, counts)
    parts = TriangleParts(np.empty((n, 3)), np.empty((n, 3)), np.empty(n))
    write_parts(corners, counts, *parts)
    return parts


def places_on_edges(corners: FloatArray, spacing: float) -> FloatArray:
    """Return places on the edges of triangles, shape (n_places, 3).

    In any direction the farthest place of a triangle is on an edge.

    Args:
        corners: Of the triangles one after the other [m], shape (3 n, 3).
        spacing: Their distance along an edge at most [m].
    """
    counts = np.empty(len(corners), np.int64)
    _, n = count_places(corners, spacing, counts)
    places = np.empty((n, 3))
    write_edge_places(corners, counts, places)
    return places


def sampled_triangles(corners: FloatArray, spacing: float = PLAN_SPACING) -> SampledSurface:
    """Return places on triangles: the middles of the equal parts that they are divided into.

    Args:
        corners: Of the triangles [m], shape (n, 3, 3).
        spacing: Longest side of a part [m].
    """
    parts = parts_of_triangles(np.ascontiguousarray(corners).reshape(-1, 3), spacing)
    return SampledSurface(parts.middles, parts.normals, parts.areas)
