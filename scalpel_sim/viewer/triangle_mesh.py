"""The triangles that a view draws."""

from collections.abc import Mapping
from typing import NamedTuple

from tissue import FloatArray, IntArray


class TriangleMesh(NamedTuple):
    """A triangle mesh with the vertex attributes that a view needs."""

    positions: FloatArray
    """Vertex positions [m], shape (n_vertices, 3)."""
    triangles: IntArray
    """Vertex indices, counter-clockwise seen from outside, shape (n_triangles, 3)."""
    normals: FloatArray
    """Unit vertex normals, shape (n_vertices, 3)."""
    uv: FloatArray | None = None
    """Texture coordinates in repeats of the texture, shape (n_vertices, 2)."""
    tints: FloatArray | None = None
    """Factors of the colour between 0 and 1, shape (n_vertices, 3)."""
    levels: Mapping[str, IntArray] = {}
    """Quantities that may be shown as colours, from 0 to 255, by name; shape (n_vertices,) each."""
