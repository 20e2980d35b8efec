"""Circular cylinders of rings and layers, each prism divided into three tetrahedra."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.mesh.validation import signed_volumes
from tissue.types import TetrahedralMesh

MOST_PRISMS = 10_000_000
"""Prisms of the largest cylinder: a larger one would take gigabytes."""


def cylinder(
    cells: Sequence[int] = (4, 8), radius: float = 0.02, height: float = 0.04
) -> TetrahedralMesh:
    """Return a cylinder whose axis is z, its base around the origin.

    The nodes of ring k lie on the 6 k-th part of a circle, so that triangles of the base are nearly
    equilateral. The outer ring is a polygon of the area of the circle: the volume is exact.

    Args:
        cells: Rings around the axis, and layers along it.
        radius: Radius of the circle [m].
        height: Length along the axis [m].

    Raises:
        ValueError: a number of cells is not a whole number of at least 1, a length is not finite
            and positive, or there would be more than `MOST_PRISMS`.
    """
    given = list(cells)
    is_whole = [isinstance(n, int | np.integer) and not isinstance(n, bool) for n in given]
    if len(given) != 2 or not all(is_whole) or min(given) < 1:
        raise ValueError(f"cells are {cells!r}; they are two whole numbers of at least 1")
    for name, length in (("radius", radius), ("height", height)):
        if not (math.isfinite(length) and length > 0.0):
            raise ValueError(f"{name} is {length} m; it must be finite and positive")
    n_rings, n_layers = (int(n) for n in given)
    if 6 * n_rings**2 * n_layers > MOST_PRISMS:
        raise ValueError(f"cells are {cells!r}: more than {MOST_PRISMS} prisms; take fewer")
    base, triangles = _disc(n_rings, radius)
    heights = np.linspace(0.0, height, n_layers + 1)
    positions = np.concatenate(
        [np.column_stack((base, np.full(len(base), z))) for z in heights.tolist()]
    )
    return TetrahedralMesh(positions, _extruded(positions, triangles, len(base), n_layers))


def _disc(n_rings: int, radius: float) -> tuple[FloatArray, IntArray]:
    """Return the nodes of a disc [m], shape (n, 2), and its triangles, shape (m, 3)."""
    # A hexagon of a triangular lattice, whose rings are bent to circles.
    corner = math.pi / (3.0 * n_rings)  # the outer polygon has 6 n_rings corners
    outer = radius * math.sqrt(corner / math.sin(corner))
    across = range(-n_rings, n_rings + 1)
    number: dict[tuple[int, int], int] = {}
    places: list[tuple[float, float]] = []
    for q, r in itertools.product(across, across):
        ring = max(abs(q), abs(r), abs(q + r))
        if ring <= n_rings:
            number[q, r] = len(places)
            angle = math.pi / 3.0 * _along_ring(q, r, ring) if ring else 0.0
            distance = outer * ring / n_rings
            places.append((distance * math.cos(angle), distance * math.sin(angle)))
    triangles = [
        [number[corner] for corner in corners]
        for q, r in itertools.product(across, across)
        for corners in (((q, r), (q + 1, r), (q, r + 1)), ((q + 1, r), (q + 1, r + 1), (q, r + 1)))
        if all(corner in number for corner in corners)
    ]
    return np.array(places), np.array(triangles, dtype=np.int64)


def _along_ring(q: int, r: int, ring: int) -> float:
    """Return how far along its ring a lattice point is, in sides of the hexagon, from 0 to 6."""
    # The corners of a ring are (k, 0), (0, k), (-k, k), (-k, 0), (0, -k) and (k, -k).
    if q > 0 and r >= 0:
        return r / ring
    if r > 0 and q + r > 0:
        return 1.0 - q / ring
    if r > 0 and q < 0:
        return 2.0 + (ring - r) / ring
    if q < 0:
        return 3.0 - r / ring
    if q + r < 0:
        return 4.0 + q / ring
    return 5.0 + (ring + r) / ring


def _extruded(positions: FloatArray, triangles: IntArray, n_base: int, n_layers: int) -> IntArray:
    """Return the tetrahedra of the prisms over all triangles, in all layers, shape (n, 4)."""
    # Sorted by number, so that neighbours agree on the diagonal of their common side.
    a, b, c = np.sort(triangles, axis=1).T
    top_a, top_b, top_c = a + n_base, b + n_base, c + n_base
    layer = np.concatenate(
        [
            np.column_stack(nodes)
            for nodes in ((a, b, c, top_c), (a, b, top_b, top_c), (a, top_a, top_b, top_c))
        ]
    )
    tetrahedra: IntArray = np.concatenate([layer + k * n_base for k in range(n_layers)])
    inverted = signed_volumes(positions, tetrahedra) < 0.0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 1, 3, 2]]
    return tetrahedra
