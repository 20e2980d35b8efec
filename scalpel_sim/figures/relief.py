"""A textured mesh whose normals follow the relief of its picture."""

import functools
import io
from typing import Any

import numpy as np
from PIL import Image
from trimesh import remesh

from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray

RELIEF = 0.006
"""Depth of the relief from the darkest to the brightest place, in repeats of the picture."""

_subdivide: Any = remesh.subdivide

_FLAT = 1e-12
"""Area in the picture, in repeats, below which a triangle has no direction there."""


def with_relief(mesh: TriangleMesh, png: bytes, most: int) -> TriangleMesh:
    """Return a mesh divided into small triangles, with normals that a picture's relief turns.

    Light is computed at vertices: only small triangles show a relief, and highlights in one piece.

    Args:
        mesh: With texture coordinates.
        png: Its picture: what is dark lies deep.
        most: Number of triangles above which it is not divided.
    """
    fine = _divided(mesh, most)
    assert fine.uv is not None
    along_u, along_v = _directions(fine, fine.uv)
    slope_u, slope_v = (_sampled(each, fine.uv) for each in _slopes(png))
    gradient = slope_u[:, None] * along_u + slope_v[:, None] * along_v
    return fine._replace(normals=_unit(fine.normals - RELIEF * gradient))


def _divided(mesh: TriangleMesh, most: int) -> TriangleMesh:
    """Return a mesh with each triangle in four, as often as it has `most` triangles at most."""
    assert mesh.uv is not None
    # As columns of the vertices: attributes of vertices come out wrong of trimesh 4.5.
    vertices, triangles = np.column_stack([mesh.positions, mesh.normals, mesh.uv]), mesh.triangles
    while 4 * len(triangles) <= most:
        vertices, triangles = _subdivide(vertices, triangles)
    positions, normals, uv = np.split(vertices, [3, 6], axis=1)
    return TriangleMesh(positions, triangles, _unit(normals), uv)


def _directions(mesh: TriangleMesh, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the unit vectors in space along u and v at each vertex, shape (n, 3) each."""
    a, b, c = mesh.triangles.T
    first, second = mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]
    p, q = uv[b] - uv[a], uv[c] - uv[a]
    area = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = np.where(np.abs(area) > _FLAT, area, np.inf)[:, None]
    of_faces = (first * q[:, 1:] - second * p[:, 1:]) / area, (second * p[:, :1] - first * q[:, :1])
    along = []
    for each in (of_faces[0], of_faces[1] / area):
        corners, values = mesh.triangles.ravel(), np.repeat(each, 3, axis=0)
        sums = [np.bincount(corners, values[:, i], len(mesh.positions)) for i in range(3)]
        along.append(_unit(np.stack(sums, axis=1)))
    return along[0], along[1]


@functools.lru_cache(maxsize=32)
def _slopes(png: bytes) -> tuple[FloatArray, FloatArray]:
    """Return the change of a picture's brightness along u and v per repeat, shape (h, w) each."""
    with Image.open(io.BytesIO(png)) as image:
        bright = np.asarray(image.convert("L"), np.float64)[::-1] / 255.0
    height, width = bright.shape
    along_u = (np.roll(bright, -1, axis=1) - np.roll(bright, 1, axis=1)) * width / 2.0
    along_v = (np.roll(bright, -1, axis=0) - np.roll(bright, 1, axis=0)) * height / 2.0
    return along_u, along_v


def _sampled(picture: FloatArray, uv: FloatArray) -> FloatArray:
    """Return the values of a picture that repeats, lowest row first, at texture coordinates."""
    height, width = picture.shape
    column, row = np.floor(uv * [width, height]).astype(np.int64).T
    values: FloatArray = picture[row % height, column % width]
    return values


def _unit(vectors: FloatArray) -> FloatArray:
    """Return the vectors at unit length, shape (n, 3); a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: FloatArray = vectors / np.where(length > 0.0, length, 1.0)
    return unit
