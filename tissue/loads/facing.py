"""Skin of one body that faces that of another: pairs of material points, for ties between them."""

import itertools
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.loads.material_points import MaterialPoints
from tissue.mesh.body import OUTER, Body
from tissue.mesh.faces import OUTWARD

_SMALLEST = np.finfo(np.float64).tiny


class Facing(NamedTuple):
    """Points of the skin of one body, and the nearest points of the skin of another."""

    points: MaterialPoints
    """Middles of faces of the one, each with its share of their area."""
    others: MaterialPoints
    """The point of the other body that is nearest to each, at rest."""
    area: float
    """Area of these faces at rest [m2]."""


def facing_points(body: Body, one: BoolArray, other: BoolArray, within: float) -> Facing:
    """Return the skin of one part of a body at rest that faces that of another part.

    Args:
        body: The body.
        one: Tetrahedra of the one part, shape (n_tets,).
        other: Tetrahedra of the other part, shape (n_tets,).
        within: Farthest distance between the two [m].

    Raises:
        ValueError: no face of the one is so near to one of the other that faces it.
    """
    mine, theirs = _skin(body, one), _skin(body, other)
    middles, towards = mine.corners.mean(axis=1), _normals(mine.corners)
    i, j = _near_pairs(middles, theirs.corners, within)
    opposite = np.einsum("nx,nx->n", towards[i], _normals(theirs.corners)[j]) < 0.0
    i, j = i[opposite], j[opposite]
    at = _nearest_on(theirs.corners[j], middles[i])
    distance = np.linalg.norm(at - middles[i], axis=1)
    order = np.lexsort((j, distance, i))
    first = order[np.unique(i[order], return_index=True)[1]]
    first = first[distance[first] <= within]
    if not len(first):
        raise ValueError(
            f"no skin of the one body faces skin of the other within {within:g} m; lay them nearer "
            "to each other, or allow a larger distance"
        )
    areas = 0.5 * np.linalg.norm(towards[i[first]], axis=1)
    shares = areas / areas.sum()
    return Facing(
        MaterialPoints(middles[i[first]], mine.tetrahedra[i[first]], shares),
        MaterialPoints(at[first], theirs.tetrahedra[j[first]], shares),
        float(areas.sum()),
    )


class _Skin(NamedTuple):
    """Faces of the skin of a part."""

    tetrahedra: IntArray
    """Tetrahedron of each, shape (n,)."""
    corners: FloatArray
    """Corners at rest [m], counter-clockwise seen from outside, shape (n, 3, 3)."""


def _skin(body: Body, part: BoolArray) -> _Skin:
    n = body.n_tetrahedra
    tetrahedra, face = np.nonzero((body.links[:n] == OUTER) & part[:, None])
    nodes = np.take_along_axis(body.tetrahedra[tetrahedra], OUTWARD[face], axis=1)
    return _Skin(tetrahedra, body.rest[nodes])


def _normals(corners: FloatArray) -> FloatArray:
    """Return the outward normals of triangles, twice as long as their areas [m2], shape (n, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _near_pairs(
    points: FloatArray, corners: FloatArray, within: float
) -> tuple[IntArray, IntArray]:
    """Return pairs of points and triangles that may be so near: numbers of both, shape (n,)."""
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    none = np.zeros(0, np.int64)
    if not (len(points) and len(corners)):
        return none, none
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    near = cKDTree(points).query_ball_point(middles, reach + within)
    triangle = np.repeat(np.arange(len(near)), [len(found) for found in near])
    return np.array(list(itertools.chain.from_iterable(near)), np.int64), triangle


def _nearest_on(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return the point of each triangle that is nearest to a point [m], shape (n, 3).

    It is below the point, if that is inside, or else on one of the edges.

    Args:
        corners: Of the triangles [m], shape (n, 3, 3).
        points: The points [m], shape (n, 3).
    """
    a, b, c = corners.transpose(1, 0, 2)
    normal = _normals(corners)
    square = np.maximum(np.einsum("nx,nx->n", normal, normal), _SMALLEST)
    height = np.einsum("nx,nx->n", points - a, normal) / square
    best = points - height[:, None] * normal
    inside = np.ones(len(points), np.bool_)
    for start, end in ((a, b), (b, c), (c, a)):
        turned = np.cross(end - start, best - start)
        inside &= np.einsum("nx,nx->n", turned, normal) >= 0.0
    distance = np.where(inside, 0.0, np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        way = end - start
        length = np.maximum(np.einsum("nx,nx->n", way, way), _SMALLEST)
        share = np.clip(np.einsum("nx,nx->n", points - start, way) / length, 0.0, 1.0)
        on_edge = start + share[:, None] * way
        far = np.linalg.norm(on_edge - points, axis=1)
        best = np.where((far < distance)[:, None], on_edge, best)
        distance = np.minimum(distance, far)
    return np.asarray(best)
