"""Triangle meshes of MuJoCo's primitive shapes and of blades, made by trimesh.

Round shapes are made at unit radius and scaled, because trimesh drops triangles of less than
1e-8 m2, which millimetre-sized shapes consist of.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from tissue import FloatArray, IntArray

if TYPE_CHECKING:  # loading trimesh takes 0.3 s: it is loaded with the first shape
    from trimesh import Trimesh


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
    rest: FloatArray | None = None
    """Where the vertices are in the body at rest [m], shape (n_vertices, 3): for lines that are
    drawn on it. None: nobody draws."""


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


_MARGIN = 0.1
"""Distance by which heel and tip may lie outside the box that stands for the blade, as a fraction
of its length. A box that they do not fit is another part of the same body."""

#      spine_start ____________ spine_end
#                 |            \___
#   ground_start  |-----------------\--- ground_end
#            heel |____________________\ tip        sharp along heel-tip, no. 11 blade
#
SPINE_LENGTH = 0.45
"""Length of the blunt back of a no. 11 blade up to its slope, in lengths of the edge."""

GROUND_WIDTH = 0.22
"""Width of the strips that are ground to the edge, in widths of the blade."""

HOLLOW = 0.12
"""Lean of normals away from the middle of a blade, at its ends: as if its flats were ground
hollow. Flats that are quite flat reflect one thing, and look like card."""


def edge_in_geom(model: mujoco.MjModel, geom: int) -> tuple[FloatArray, FloatArray] | None:
    """Return heel and tip [m] in a box's frame, if the box is the sheet that carries them.

    The sites `heel` and `tip` may have a prefix, as those of a scalpel on an arm.
    """
    body = model.geom_bodyid[geom]
    sites = {model.site(int(i)).name: i for i in np.flatnonzero(model.site_bodyid == body)}
    pairs = [(name, f"{name.removesuffix('heel')}tip") for name in sites if name.endswith("heel")]
    names = next((pair for pair in pairs if pair[1] in sites), None)
    if names is None:
        return None
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    heel, tip = (
        (model.site_pos[sites[name]] - model.geom_pos[geom]) @ matrix.reshape(3, 3)
        for name in names
    )
    size = model.geom_size[geom]
    fits = (np.abs([heel, tip]) <= size + _MARGIN * size.max()).all()
    is_in_sheet = np.abs(tip - heel).argmax() != size.argmin() and not np.array_equal(heel, tip)
    return (heel, tip) if fits and is_in_sheet else None


def blade(size: FloatArray, heel: FloatArray, tip: FloatArray) -> TriangleMesh:
    """Return a thin sheet ground to an edge from heel to tip, as wide as the box it stands for.

    Args:
        size: Half sizes of the box [m]; the least is half the thickness of the sheet.
        heel: End of the edge nearest the handle [m], in the box's frame.
        tip: Sharp end [m], in the box's frame.
    """
    along = tip - heel
    across = np.cross(np.eye(3)[np.argmin(size)], along)
    across /= np.linalg.norm(across)
    towards_spine = -across if np.dot(across, heel + tip) > 0.0 else across
    width = 2.0 * float(np.abs(towards_spine) @ size)
    half = np.cross(along, towards_spine)
    half *= size.min() / np.linalg.norm(half)
    spine_start = heel + width * towards_spine
    spine_end = spine_start + SPINE_LENGTH * along
    middle = [heel + GROUND_WIDTH * (spine_start - heel), tip + GROUND_WIDTH * (spine_end - tip)]
    sheet = np.stack([*middle, spine_end, spine_start])
    corners = np.concatenate([[heel, tip], sheet + half, sheet - half])
    front = [[0, 1, 3], [0, 3, 2], [2, 3, 4], [2, 4, 5]]
    back = [[1, 0, 6], [1, 6, 7], [7, 6, 9], [7, 9, 8]]
    spine, slope = [[5, 4, 8], [5, 8, 9]], [[4, 3, 7], [4, 7, 8], [3, 1, 7]]
    end = [[0, 2, 6], [2, 5, 9], [2, 9, 6]]
    mesh = faceted(corners, np.array(front + back + spine + slope + end))
    share = (mesh.positions - heel) @ along / (along @ along)
    unit = along / np.linalg.norm(along)
    normals = mesh.normals + HOLLOW * (2.0 * share[:, None] - 1.0) * unit
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return mesh._replace(normals=normals)
