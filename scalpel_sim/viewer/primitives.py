"""Triangle meshes of MuJoCo's primitive shapes, made by trimesh.

Round shapes are made at unit radius and scaled, because trimesh drops triangles of less than
1e-8 m2, which millimetre-sized shapes consist of.
"""

from typing import TYPE_CHECKING

import numpy as np

from scalpel_sim.viewer.triangle_mesh import TriangleMesh
from tissue import FloatArray, IntArray

if TYPE_CHECKING:  # loading trimesh takes 0.3 s: it is loaded with the first shape
    from trimesh import Trimesh

_N_AROUND = 32
"""Segments around a round shape: at this count its outline looks round on a screen."""

BEVEL = 0.12
"""Rounded rim of a cylinder, as a fraction of its radius, or of its half length if that is less.
A perfectly sharp rim catches no light and looks like paper."""

_N_BEVEL = 5
"""Rings of vertices along a rounded rim."""

_HOLD = 1e-3
"""Distance in radii between a rounded rim and the ring that keeps the shade of the flat end, and of
the wall, apart from that of the rim."""


def box(half_sizes: FloatArray) -> TriangleMesh:
    """Return a box around the origin; `half_sizes` [m] has shape (3,)."""
    from trimesh import creation

    mesh = creation.box(extents=2.0 * half_sizes)
    return faceted(mesh.vertices, mesh.faces)


def ellipsoid(radii: FloatArray) -> TriangleMesh:
    """Return an ellipsoid around the origin; `radii` [m] along x, y and z has shape (3,)."""
    from trimesh import creation

    count = [_N_AROUND // 2 + 1, _N_AROUND // 2]  # trimesh doubles the second
    return _smooth(creation.uv_sphere(radius=1.0, count=count), radii)


def capsule(radius: float, half_length: float) -> TriangleMesh:
    """Return a capsule along z; `half_length` [m] is that of its straight part."""
    from trimesh import creation

    count = [_N_AROUND // 2, _N_AROUND]
    unit = creation.capsule(height=2.0 * half_length / radius, radius=1.0, count=count)
    return _smooth(unit, np.full(3, radius))


def rounded_cylinder(radius: float, half_length: float) -> TriangleMesh:
    """Return a cylinder along z with rounded rims, `radius` and `half_length` in [m]."""
    from trimesh import creation

    half = half_length / radius
    bevel = BEVEL * min(1.0, half)
    angle = np.linspace(0.0, np.pi / 2.0, _N_BEVEL)
    rim = np.stack([1.0 - bevel + bevel * np.cos(angle), half - bevel + bevel * np.sin(angle)], 1)
    wall, end = [1.0, half - bevel - _HOLD * bevel], [1.0 - bevel - _HOLD * bevel, half]
    upper = np.concatenate([[wall], rim, [end], [[0.0, half]]])
    lower = upper[::-1] * [1.0, -1.0]
    profile = np.concatenate([lower, upper])
    return _smooth(creation.revolve(profile, sections=_N_AROUND), np.full(3, radius))


def rectangle(half_sizes: FloatArray) -> TriangleMesh:
    """Return a rectangle at z = 0 that faces up; `half_sizes` [m] has shape (2,)."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
    return TriangleMesh(
        np.column_stack([corners * half_sizes, np.zeros(4)]),
        grid_triangles(2, 2),
        np.tile([0.0, 0.0, 1.0], (4, 1)),
        corners / 2 + 0.5,
    )


def grid_triangles(n_rows: int, n_columns: int) -> IntArray:
    """Return the triangles of a grid of vertices that are numbered row by row, shape (n, 3)."""
    corner = (np.arange(n_rows - 1)[:, None] * n_columns + np.arange(n_columns - 1)).ravel()
    right, above = corner + 1, corner + n_columns
    first = np.stack([corner, right, above], axis=1)
    second = np.stack([right, above + 1, above], axis=1)
    return np.concatenate([first, second])


def faceted(positions: FloatArray, triangles: IntArray) -> TriangleMesh:
    """Return a mesh whose triangles look flat: each has vertices of its own."""
    from trimesh import Trimesh

    mesh = Trimesh(positions, triangles, process=False)
    return TriangleMesh(
        mesh.triangles.reshape(-1, 3),
        np.arange(3 * len(triangles)).reshape(-1, 3),
        mesh.face_normals.repeat(3, axis=0),
    )


def _smooth(unit: "Trimesh", scale: FloatArray) -> TriangleMesh:
    """Return a mesh scaled along each axis, with normals that vary smoothly across triangles."""
    normals = unit.vertex_normals / scale
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return TriangleMesh(unit.vertices * scale, unit.faces, normals)
