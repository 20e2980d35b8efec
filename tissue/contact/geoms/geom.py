"""`Geom`: a rigid solid of simple shape that tissue can touch; and the forces between the two."""

import math
from typing import Final, NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray

PLANE: Final = 0
SPHERE: Final = 1
CAPSULE: Final = 2
CYLINDER: Final = 3
ELLIPSOID: Final = 4
BOX: Final = 5
"""Numbers of the shapes for kernels; a mesh has the next."""

N_SIZES = {"plane": 0, "sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Number of sizes of each shape but for the mesh; the shapes are in the order of their numbers."""

_SAME_PLANE = 1e-9
"""Difference of two planes of a hull, in unit normals and in sizes of the mesh, up to which they
are one: the hull divides each flat side into triangles. Larger: sides that are nearly flat vanish
one by one; smaller: each triangle is tested."""


class Geom(NamedTuple):
    """A rigid solid that tissue can touch, in a frame of its own. Shapes and sizes are MuJoCo's.

    `plane` fills all below z = 0; `sphere` has a radius; `capsule` and `cylinder` have a radius and
    half a length along z, a capsule without its caps; `ellipsoid` and `box` have half their sizes
    along x, y, z; `mesh` is the convex hull of points.
    """

    name: str
    """Name of the geom, for reports and errors."""
    shape: str
    """One of those above."""
    size: tuple[float, ...] = ()
    """Sizes of the shape [m], as many as it has."""
    friction: float | None = 0.0
    """Coefficient of friction between the geom and the tissue; None: that of the tissue there
    (`Material.friction`)."""
    vertices: FloatArray | None = None
    """Points of a mesh [m], shape (n, 3); None for other shapes."""

    def box(self) -> tuple[FloatArray, FloatArray]:
        """Return the middle of a box around it, and half its sizes [m], in its own frame.

        That around a plane is infinite.
        """
        if self.shape == "mesh":
            points = np.asarray(self.vertices, dtype=np.float64)
            low, high = points.min(axis=0), points.max(axis=0)
            return 0.5 * (low + high), 0.5 * (high - low)
        if self.shape == "plane":
            half = np.full(3, np.inf)
        elif self.shape == "sphere":
            half = np.full(3, self.size[0])
        elif self.shape in ("capsule", "cylinder"):
            radius, length = self.size
            caps = radius if self.shape == "capsule" else 0.0
            half = np.array([radius, radius, length + caps])
        else:
            half = np.array(self.size)
        return np.zeros(3), half


class GeomForces(NamedTuple):
    """Where tissue touched geoms in a step. Copies."""

    geom: IntArray
    """Number of the geom of each contact, in the order in which they were given; shape (n,)."""
    point: FloatArray
    """Where each is [m], shape (n, 3)."""
    normal: FloatArray
    """Unit normal out of the geom, shape (n, 3)."""
    force: FloatArray
    """Force on the tissue, averaged over the step [N], shape (n, 3): pressure and friction."""


def planes_of(geom: Geom) -> FloatArray:
    """Return the sides of a geom that is a mesh, after checking it; none for other shapes.

    Returns:
        Unit normals that point outwards, and distances: x is inside where normal . x + distance is
        negative for all; shape (n, 4).

    Raises:
        ValueError: the shape is unknown, a size is missing or is not positive, the friction is
            negative, or the points of a mesh have no volume.
    """
    what = f"geom '{geom.name}'"
    if geom.shape != "mesh" and geom.shape not in N_SIZES:
        raise ValueError(
            f"{what} has the shape {geom.shape!r}; there are {', '.join([*N_SIZES, 'mesh'])}"
        )
    friction = geom.friction
    if friction is not None and not (math.isfinite(friction) and friction >= 0.0):
        raise ValueError(
            f"{what} has a friction of {friction}; it must be finite and not negative, or None for "
            "that of the tissue"
        )
    if geom.shape == "mesh":
        return _planes_of_hull(what, geom.vertices)
    n = N_SIZES[geom.shape]
    if len(geom.size) != n or not all(math.isfinite(s) and s > 0.0 for s in geom.size):
        raise ValueError(
            f"{what} has the sizes {geom.size}; a {geom.shape} has {n}, positive and finite [m]"
        )
    return np.zeros((0, 4))


def shape_number(geom: Geom) -> int:
    """Return the number of the shape for kernels."""
    return [*N_SIZES, "mesh"].index(geom.shape)


def half_thickness(geom: Geom) -> float:
    """Return how deep in a geom the point is that is deepest [m]; infinite for a plane."""
    if geom.shape == "plane":
        return math.inf
    if geom.shape == "mesh":
        planes = planes_of(geom)
        assert geom.vertices is not None
        return float(-(planes[:, :3] @ geom.vertices.mean(axis=0) + planes[:, 3]).max())
    return min(geom.size[:1] if geom.shape in ("sphere", "capsule") else geom.size)


def _planes_of_hull(what: str, vertices: FloatArray | None) -> FloatArray:
    """Return the sides of the convex hull of points, each once."""
    if vertices is None or np.ndim(vertices) != 2 or np.shape(vertices)[1] != 3:
        raise ValueError(f"{what} is a mesh and needs `vertices`, shape (n, 3)")
    points = np.asarray(vertices, dtype=np.float64)
    if not np.isfinite(points).all():
        raise ValueError(f"{what} has a vertex that is not finite")
    # Loading it takes 0.1 s, and only meshes need it.
    from scipy.spatial import ConvexHull, QhullError

    try:
        sides = ConvexHull(points).equations
    except (QhullError, ValueError) as error:
        raise ValueError(
            f"{what} has {len(points)} vertices without a volume: a convex mesh needs four that "
            "are not in one plane"
        ) from error
    scale = np.array([1.0, 1.0, 1.0, float(np.ptp(points, axis=0).max())])
    _, first = np.unique(np.round(sides / scale / _SAME_PLANE), axis=0, return_index=True)
    return np.ascontiguousarray(sides[np.sort(first)])
