"""Exact geometric predicates: the side of a plane, whether a segment pierces a triangle.

Decisions are taken on integer coordinates. A `Lattice` covers the body at rest with 2^18 points
along its longest side; a determinant of coordinate differences below 2^20 fits an int64, so its
sign is exact. Zero counts as positive, and a line is always tested with its ends in the same order,
so that all elements that share an edge, a face or a line get the same answer.
"""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3

LATTICE_POINTS = 1 << 18
"""Lattice points along the body's longest side. Four times as many would overflow the determinant
of points that lie outside the body; fewer only make the lattice coarser (0.4 um in 0.1 m)."""

LATTICE_LIMIT = (1 << 19) - 1
"""Largest coordinate. Points further out (a blade far from the body) are clamped to it."""


class LatticePoint(NamedTuple):
    """A point of the lattice, by whole numbers."""

    x: int
    y: int
    z: int


class Lattice(Arrays):
    """Origin and spacing of the lattice."""

    origin: FloatArray
    """Centre of the body at rest [m], shape (3,)."""
    spacing: float
    """Distance of lattice points [m]."""


def lattice_around(positions: FloatArray) -> Lattice:
    """Return the lattice of a body with these rest positions [m], shape (n_nodes, 3)."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    return Lattice(origin=0.5 * (low + high), spacing=float((high - low).max()) / LATTICE_POINTS)


@kernel
def nearest(lattice: Lattice, p: Vec3) -> LatticePoint:
    """Return the lattice point nearest to `p` [m]."""
    return LatticePoint(
        _round((p.x - lattice.origin[0]) / lattice.spacing),
        _round((p.y - lattice.origin[1]) / lattice.spacing),
        _round((p.z - lattice.origin[2]) / lattice.spacing),
    )


@kernel
def _round(value: float) -> int:
    return int(np.floor(min(max(value, -LATTICE_LIMIT), LATTICE_LIMIT) + 0.5))


@kernel
def lattice_point(array: IntArray, i: int) -> LatticePoint:
    """Return row `i` of an array of lattice points, shape (n, 3)."""
    return LatticePoint(array[i, 0], array[i, 1], array[i, 2])


@kernel
def orient3d(a: LatticePoint, b: LatticePoint, c: LatticePoint, d: LatticePoint) -> int:
    """Return six times the signed volume of abcd in lattice units, exact; positive: d above abc."""
    ux = b.x - a.x
    uy = b.y - a.y
    uz = b.z - a.z
    vx = c.x - a.x
    vy = c.y - a.y
    vz = c.z - a.z
    wx = d.x - a.x
    wy = d.y - a.y
    wz = d.z - a.z
    return wx * (uy * vz - uz * vy) + wy * (uz * vx - ux * vz) + wz * (ux * vy - uy * vx)


@kernel
def _comes_before(p: LatticePoint, q: LatticePoint) -> bool:
    if p.x != q.x:
        return p.x < q.x
    if p.y != q.y:
        return p.y < q.y
    return p.z < q.z


@kernel
def _passes_left(a: LatticePoint, b: LatticePoint, p: LatticePoint, q: LatticePoint) -> bool:
    """Return on which side line ab passes the directed line pq; reversing pq reverses it."""
    if _comes_before(p, q):
        return orient3d(a, b, p, q) >= 0
    return not orient3d(a, b, q, p) >= 0


@kernel
def pierces(
    a: LatticePoint, b: LatticePoint, p: LatticePoint, q: LatticePoint, r: LatticePoint
) -> bool:
    """Return whether segment ab pierces triangle pqr.

    Where the segment passes through an edge that two triangles share, exactly one of them is
    pierced; where the end that two segments share lies in the triangle, exactly one of them pierces
    it. A flat triangle is never pierced.

    Args:
        a: Start of the segment.
        b: End of the segment.
        p: First corner of the triangle.
        q: Second corner.
        r: Third corner.
    """
    if (orient3d(p, q, r, a) >= 0) == (orient3d(p, q, r, b) >= 0):
        return False
    side = _passes_left(a, b, p, q)
    return side == _passes_left(a, b, q, r) and side == _passes_left(a, b, r, p)
