"""How deep the surface of cuts lies in other parts of the body: a look that knows no contacts.

Nodes, middles of edges and middles of faces of cuts are searched for in all tetrahedra that share
no node with them. The depth of one that is inside is its distance from the nearest face of the
boundary that shares no node with it either.
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tissue import BoolArray, FloatArray, Tissue
from tissue.core.array_types import IntArray
from tissue.mesh.body import CUT, OUTER
from tissue.mesh.faces import OUTWARD

_MOST_PAIRS = 1 << 20
"""Pairs of a point and a tetrahedron that are tested at once."""


class Overlaps(NamedTuple):
    """Depths of points that are inside another part of the body [m]."""

    n_points: int
    """How many points were searched for."""
    depths: FloatArray
    """Depth of each that is inside [m]."""

    def deeper_than(self, depth: float) -> int:
        """Return how many points are deeper than that [m]."""
        return int((self.depths > depth).sum())


def overlaps_of_cuts(tissue: Tissue) -> dict[str, Overlaps]:
    """Return the overlaps of nodes, middles of edges and middles of faces of the body's cuts."""
    body, n_tetrahedra = tissue._body, tissue.n_tetrahedra
    links, tetrahedra = body.links[:n_tetrahedra], body.tetrahedra[:n_tetrahedra]
    boundary = _faces(tetrahedra, (links == CUT) | (links == OUTER))
    cut = _faces(tetrahedra, links == CUT)
    edges = np.unique(np.sort(cut[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    points = {"nodes": np.unique(cut)[:, None], "edges": edges, "faces": cut}
    return {
        name: _overlaps(body.positions, tetrahedra, boundary, own) for name, own in points.items()
    }


def report(tissue: Tissue) -> None:
    """Print how many points overlap by more than a tenth and a fifth of an element."""
    for name, overlaps in overlaps_of_cuts(tissue).items():
        size, depths = tissue.node_size, overlaps.depths
        deepest = 1e6 * float(depths.max(initial=0.0))
        counts = f"{overlaps.deeper_than(0.1 * size)} / {overlaps.deeper_than(0.2 * size)}"
        print(
            f"{name}: {overlaps.n_points} looked at, {len(depths)} inside, deeper than 10 / 20 % "
            f"of an element: {counts}, deepest {deepest:.0f} um"
        )


def _faces(tetrahedra: IntArray, wanted: BoolArray) -> IntArray:
    """Return the nodes of the faces that are wanted of each tetrahedron, shape (n_tets, 4)."""
    tetrahedron, face = np.nonzero(wanted)
    return tetrahedra[tetrahedron[:, None], OUTWARD[face]]


def _overlaps(x: FloatArray, tetrahedra: IntArray, boundary: IntArray, own: IntArray) -> Overlaps:
    """Return the overlaps of the points in the middle of some nodes, shape (n, n_nodes_each)."""
    if len(own) == 0:
        return Overlaps(0, np.zeros(0))
    points = x[own].mean(axis=1)
    inside = _are_inside(points, own, x, tetrahedra)
    depths = [_depth(points[i], own[i], x, boundary) for i in np.flatnonzero(inside)]
    return Overlaps(len(points), np.array(depths))


def _are_inside(
    points: FloatArray, own: IntArray, x: FloatArray, tetrahedra: IntArray
) -> np.ndarray:
    """Return which points are inside a tetrahedron that shares no node with them."""
    corners = x[tetrahedra]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    inside = np.zeros(len(points), dtype=bool)
    # Balls around large tetrahedra would list nearly all: they are searched apart.
    bounds = np.quantile(radii, [0.0, 0.5, 0.9, 0.99, 1.0])
    for low, high in itertools.pairwise(bounds):
        which = np.flatnonzero((radii > low) & (radii <= high) | (radii == bounds[0]))
        if len(which) == 0:
            continue
        near = cKDTree(points).query_ball_point(centres[which], radii[which])
        counts = np.array([len(found) for found in near])
        point = np.concatenate([np.array(found, dtype=np.int64) for found in near])
        tetrahedron = np.repeat(which, counts)
        for begin in range(0, len(point), _MOST_PAIRS):
            part = slice(begin, begin + _MOST_PAIRS)
            p, t = point[part], tetrahedron[part]
            inside[p[_is_in(points[p], own[p], x, tetrahedra[t])]] = True
    return inside


def _is_in(points: FloatArray, own: IntArray, x: FloatArray, tetrahedra: IntArray) -> np.ndarray:
    """Return whether each point is in the tetrahedron in its row, and shares no node with it."""
    is_other = ~(own[:, :, None] == tetrahedra[:, None, :]).any(axis=(1, 2))
    a, b, c, d = (x[tetrahedra[:, k]] for k in range(4))
    volume = _volume(a, b, c, d)
    weights = (
        _volume(points, b, c, d),
        _volume(a, points, c, d),
        _volume(a, b, points, d),
        _volume(a, b, c, points),
    )
    # In a tetrahedron inside out nothing can be.
    return is_other & (volume > 0.0) & (np.array(weights) > 0.0).all(axis=0)


def _volume(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return six times the signed volume of tetrahedra [m3]."""
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)


def _depth(point: FloatArray, own: IntArray, x: FloatArray, boundary: IntArray) -> float:
    """Return the distance of a point from the nearest face that has none of its nodes [m]."""
    others = boundary[~np.isin(boundary, own).any(axis=1)]
    a, b, c = (x[others[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    square = np.einsum("ij,ij->i", normal, normal) + 1e-300
    height = np.einsum("ij,ij->i", point - a, normal) / square
    foot = point - height[:, None] * normal
    within = np.ones(len(a), dtype=bool)
    nearest = np.full(len(a), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        within &= np.einsum("ij,ij->i", np.cross(q - p, foot - p), normal) >= 0.0
        along = np.einsum("ij,ij->i", point - p, q - p) / (
            np.einsum("ij,ij->i", q - p, q - p) + 1e-300
        )
        at = p + np.clip(along, 0.0, 1.0)[:, None] * (q - p)
        nearest = np.minimum(nearest, np.linalg.norm(point - at, axis=1))
    to_plane = np.linalg.norm(point - foot, axis=1)
    return float(np.where(within, to_plane, nearest).min())
