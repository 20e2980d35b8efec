"""What incisions surely leave whole, and what they surely separate, in exact geometry.

No mesh is cut and nothing snaps, as in `exact_pieces`. Cuts of a mesh lie off their surface, by the
path error. So material within that distance of a cut may belong to either side, and a cut may reach
so much less far. What is farther off is decided: where it is connected it must be whole, and what
the cuts separate even where each reaches less far must be apart.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from tests.support.exact_pieces import Parts, crossed_faces
from tissue import BoolArray, FloatArray, IntArray, Snapshot

RETRACTION = 2.0
"""By how much a rim is moved inward [path errors]: it may reach less far by one, and the cut that
it has to reach may lie aside by one."""

LEAST_SIDE = 2.0
"""Volume from which a region on one side of cuts is a piece [crumbs]: as soon as a smaller one is
separated it may stay with its neighbour."""

N_CANDIDATES = 24
"""Tetrahedra, those with the nearest centroids, among which the one around a point is sought."""


class Decided(NamedTuple):
    """The parts of a body that lie farther than the path error from every cut."""

    parts: IntArray
    """Their indices, shape (n,)."""
    core: IntArray
    """Number of the connected region that they are in where everything near a cut is taken away:
    each region is surely whole, shape (n,)."""
    side: IntArray
    """Number of the region that they are in where each cut reaches less far: two regions are surely
    apart, shape (n,)."""


def contradictions(found: Decided, piece: IntArray, volume: FloatArray, crumb: float) -> list[str]:
    """Return what pieces contradict, in words; pieces of less than a crumb are none.

    Args:
        found: What is decided.
        piece: The piece that holds each of its parts, -1 where that is not known, shape (n,).
        volume: Volume of each of its parts [m3], shape (n,).
        crumb: Volume up to which a piece is a crumb [m3].
    """
    faults = []
    for core in np.unique(found.core):
        shares = volumes_in_pieces(found.core == core, piece, volume)
        if (shares > crumb).sum() > 1:
            first, second = np.sort(shares / crumb)[[-1, -2]]
            faults.append(f"a whole region is in pieces, {first:.1f} and {second:.1f} crumbs of it")
    for own, other in itertools.combinations(np.unique(found.side), 2):
        shares = [volumes_in_pieces(found.side == side, piece, volume) for side in (own, other)]
        common = np.minimum(*shares).max(initial=0.0)
        if common > crumb and min(each.sum() for each in shares) > LEAST_SIDE * crumb:
            faults.append(f"two regions are one piece, {common / crumb:.1f} crumbs of the smaller")
    return faults


def volumes_in_pieces(chosen: BoolArray, piece: IntArray, volume: FloatArray) -> FloatArray:
    """Return the volume of the chosen parts in each piece [m3], shape (n_pieces,)."""
    chosen = chosen & (piece >= 0)
    return np.bincount(piece[chosen], volume[chosen], minlength=piece.max() + 1)


def decided(parts: Parts, surfaces: Sequence[FloatArray], error: FloatArray) -> Decided:
    """Return what cuts along ruled surfaces decide.

    Args:
        parts: The equal parts of the uncut body.
        surfaces: Positions of the edge along each cut [m], each of shape (n_positions, 2, 3).
        error: Path error at each part [m], shape (n_parts,).
    """
    n = len(parts.volumes)
    is_near = np.zeros(n, dtype=bool)
    is_crossed, is_surely_crossed = np.zeros((2, len(parts.pairs)), dtype=bool)
    centroids = centroids_of(parts)
    for surface in surfaces:
        is_near |= within(centroids, surface, error)
        is_crossed |= crossed_faces(parts, surface)
        is_surely_crossed |= crossed_faces(parts, trimmed(surface, RETRACTION * error.max()))
    open_faces = is_crossed | is_near[parts.pairs].any(axis=1)
    core, side = (regions(n, parts.pairs[~each]) for each in (open_faces, is_surely_crossed))
    (far,) = np.nonzero(~is_near)
    return Decided(far, core[far], side[far])


def regions(n: int, joined: IntArray) -> IntArray:
    """Return the number of the connected region of each of n parts, given the pairs that touch."""
    graph = coo_array((np.ones(len(joined), np.int8), (joined[:, 0], joined[:, 1])), (n, n))
    return connected_components(graph, directed=False)[1]


def centroids_of(parts: Parts) -> FloatArray:
    """Return the centroid of each part [m], shape (n_parts, 3)."""
    centroids = np.empty((len(parts.volumes), 3))
    centroids[parts.pairs.T.ravel()] = parts.start
    return centroids


def trimmed(surface: FloatArray, by: float) -> FloatArray:
    """Return a ruled surface without a margin along its rim [m]; it may be empty."""
    if len(surface) == 0:
        return surface
    middle = surface.mean(axis=1)
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))])
    span = surface[:, 1] - surface[:, 0]
    length = np.linalg.norm(span, axis=1)
    if at[-1] <= 2.0 * by or length.min() <= 2.0 * by:
        return surface[:0]
    inward = by * span / length[:, None]
    narrower = np.stack([surface[:, 0] + inward, surface[:, 1] - inward], axis=1)
    kept = np.concatenate([[by], at[(at > by) & (at < at[-1] - by)], [at[-1] - by]])
    rows = narrower.reshape(len(surface), 6)
    return np.stack([np.interp(kept, at, row) for row in rows.T], axis=1).reshape(-1, 2, 3)


def triangles(surface: FloatArray) -> Iterator[FloatArray]:
    """Yield the triangles of a ruled surface [m], each of shape (3, 3)."""
    for before, after in itertools.pairwise(surface):
        yield np.array([before[0], before[1], after[0]])
        yield np.array([before[1], after[1], after[0]])


def within(points: FloatArray, surface: FloatArray, reach: FloatArray) -> BoolArray:
    """Return which points lie within a distance of a ruled surface, shape (n,).

    Args:
        points: The points [m], shape (n, 3).
        surface: Positions of the edge [m], shape (n_positions, 2, 3).
        reach: The distance for each point [m], shape (n,).
    """
    is_within = np.zeros(len(points), dtype=bool)
    for triangle in triangles(surface):
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        normal /= np.linalg.norm(normal)
        height = np.abs(points @ normal - triangle[0] @ normal)
        (near,) = np.nonzero((height <= reach) & ~is_within)
        is_within[near] = distance(points[near], triangle, normal) <= reach[near]
    return is_within


def distance(points: FloatArray, triangle: FloatArray, normal: FloatArray) -> FloatArray:
    """Return the distance of points from a triangle with that unit normal [m], shape (n,)."""
    beside = np.full(len(points), np.inf)
    is_over = np.ones(len(points), dtype=bool)
    for a, b in itertools.pairwise([*triangle, triangle[0]]):
        along, offset = b - a, points - a
        share = np.clip(offset @ along / (along @ along), 0.0, 1.0)
        beside = np.minimum(beside, np.linalg.norm(offset - share[:, None] * along, axis=1))
        is_over &= offset @ np.cross(normal, along) >= 0.0
    return np.where(is_over, np.abs((points - triangle[0]) @ normal), beside)


def pieces_at(points: FloatArray, body: Snapshot, piece: IntArray) -> IntArray:
    """Return the piece that holds each point, -1 where no tetrahedron is found, shape (n,).

    Args:
        points: Points in the body at rest [m], shape (n, 3).
        body: The body.
        piece: Piece of each tetrahedron, shape (n_tetrahedra,).
    """
    corners = body.rest_positions[body.tetrahedra]
    to_weights = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
    n = min(N_CANDIDATES, len(corners))
    _, candidates = KDTree(corners.mean(axis=1)).query(points, n)
    offsets = points[:, None] - corners[candidates, 0]
    weights = np.einsum("nkij,nkj->nki", to_weights[candidates], offsets)
    depth = np.minimum(weights.min(axis=2), 1.0 - weights.sum(axis=2))
    deepest = depth.argmax(axis=1)
    at = np.arange(len(points))
    found = piece[candidates[at, deepest]]
    return np.where(depth[at, deepest] >= 0.0, found, -1)
