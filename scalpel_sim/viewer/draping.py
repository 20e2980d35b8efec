"""Texture lies on tissue: the triangles of a body made ready to be drawn.

Texture coordinates come from the rest position, so that the pattern moves with the material. Each
triangle is seen along the axis that its rest normal is nearest to (a cube map). A vertex that is
seen along several axes becomes several, one for each chart; a colour that varies in space without
charts hides where they meet.
"""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray, IntArray, Surface

CREASE_COSINE = 0.87
"""Where the normals of a chart and of all the triangles around a vertex differ by more than 30
degrees at rest, the edge is sharp and stays sharp: the edges of a box, but not the rim of an
organ, whose charts meet at any angle. At 45 degrees boxes would look inflated."""

N_CHARTS = 6
"""The sides of the cube."""

CHART_AXES = np.array([[1, 2], [1, 2], [0, 2], [0, 2], [0, 1], [0, 1]])
"""The rest coordinates that serve as u and v when looking along -x, +x, -y, +y, -z, +z."""

CHART_SHIFT = np.array(
    [[0.0, 0.0], [0.37, 0.61], [0.71, 0.23], [0.13, 0.47], [0.59, 0.83], [0.29, 0.07]]
)
"""Shift of u and v, so that opposite sides of a body do not wear the same pattern."""

N_WAVES = 10
"""Plane waves that add up to the slow variation of the tint."""

TINT_DEPTH = 0.22
"""Standard deviation of the tint about 1. Without it one sees that the texture repeats."""


class TriangleMesh(NamedTuple):
    """What a viewer draws."""

    positions: FloatArray
    """[m], shape (n_vertices, 3)."""
    triangles: IntArray
    """Indices into the vertices, shape (n_triangles, 3)."""
    normals: FloatArray
    """Unit vectors, shape (n_vertices, 3)."""
    uv: FloatArray | None = None
    """Texture coordinates in tiles, shape (n_vertices, 2)."""
    tints: FloatArray | None = None
    """Factors of the colour between 0 and 1, shape (n_vertices, 3)."""


class DrapedSurface(NamedTuple):
    """A body's surface, one mesh per texture."""

    skin: TriangleMesh
    cut: TriangleMesh


def drape(surface: Surface, tile: float) -> DrapedSurface:
    """Return the skin and the cut faces of a body with texture coordinates and normals.

    Args:
        surface: The boundary triangles.
        tile: Length of material that one repeat of the texture covers [m].
    """
    skin, cut = (
        _drape_triangles(surface, surface.triangles[chosen], tile)
        for chosen in (~surface.is_cut, surface.is_cut)
    )
    return DrapedSurface(skin, cut)


def _drape_triangles(surface: Surface, triangles: IntArray, tile: float) -> TriangleMesh:
    """Return some triangles of the surface as a mesh of their own."""
    rest_faces = _area_normals(surface.rest_positions, triangles)
    axis = np.abs(rest_faces).argmax(axis=1)
    upward = np.take_along_axis(rest_faces, axis[:, None], axis=1)[:, 0] > 0.0
    corner_keys = N_CHARTS * triangles + (2 * axis + upward)[:, None]
    keys, corners = _unique(corner_keys, N_CHARTS * len(surface.positions))
    node, chart = keys // N_CHARTS, keys % N_CHARTS

    faces = _area_normals(surface.positions, triangles)
    is_sharp = _is_sharp(rest_faces, triangles, corners, node, len(surface.positions))
    of_chart = _gather(faces, corners, len(keys))
    of_node = _gather(faces, triangles, len(surface.positions))[node]

    rest = surface.rest_positions[node]
    return TriangleMesh(
        positions=surface.positions[node],
        triangles=corners,
        normals=_unit(np.where(is_sharp[:, None], of_chart, of_node)),
        uv=np.take_along_axis(rest, CHART_AXES[chart], axis=1) / tile + CHART_SHIFT[chart],
        tints=_tints(rest / tile),
    )


def _unique(keys: IntArray, n_keys: int) -> tuple[IntArray, IntArray]:
    """Return the sorted keys that occur, and the keys' places among them, without sorting."""
    occurs = np.zeros(n_keys, dtype=bool)
    occurs[keys] = True
    place = np.cumsum(occurs) - 1
    return np.flatnonzero(occurs), place[keys]


def _area_normals(positions: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the normal of each triangle, as long as twice its area; shape (n_triangles, 3)."""
    a, b, c = (positions[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def _is_sharp(
    rest_faces: FloatArray, triangles: IntArray, corners: IntArray, node: IntArray, n_nodes: int
) -> np.ndarray:
    """Return whether each vertex lies on a crease of the body at rest, shape (n_vertices,)."""
    of_chart = _unit(_gather(rest_faces, corners, len(node)))
    of_node = _unit(_gather(rest_faces, triangles, n_nodes))[node]
    return np.einsum("ij,ij->i", of_chart, of_node) < CREASE_COSINE


def _gather(faces: FloatArray, corners: IntArray, n_vertices: int) -> FloatArray:
    """Return the sum of the normals of the triangles around each vertex, shape (n_vertices, 3)."""
    flat = corners.ravel()
    return np.stack(
        [np.bincount(flat, np.repeat(faces[:, i], 3), n_vertices) for i in range(3)], axis=1
    )


def _unit(vectors: FloatArray) -> FloatArray:
    """Return vectors of length one; a zero vector points up."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0.0, vectors / np.where(length > 0.0, length, 1.0), (0.0, 0.0, 1.0))


def _tints(places: FloatArray) -> FloatArray:
    """Return a slowly varying tint at places measured in tiles, shape (n, 3), between 0 and 1.

    A sum of plane waves of random directions, so that it has no charts and no seams.
    """
    random = np.random.default_rng(7)
    waves = random.standard_normal((3, N_WAVES)) * 4.0
    phases = random.uniform(0.0, 2.0 * np.pi, N_WAVES)
    height = np.sin(places @ waves + phases).sum(axis=1) / np.sqrt(N_WAVES / 2.0)
    tint = 0.80 + TINT_DEPTH * height[:, None] * np.array([0.55, 0.9, 1.0])
    return np.clip(tint, 0.0, 1.0)
