"""Pieces that cuts leave in exact geometry: no mesh is cut, nothing snaps.

Each tetrahedron of the uncut body is divided into equal parts. Two neighbours are connected where
the way from the one's centroid, over the centroid of their common face, to the other's crosses no
cut.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tests.support.soundness import faces_of, triangle_areas, volumes
from tissue import FloatArray, IntArray, TetrahedralMesh

SEAM = 1e-12
"""Share of a triangle by which it is made larger, so that no way slips through between two."""

CHILDREN = np.array(  # corners 0 to 3, then the middles of edges 01, 02, 03, 12, 13, 23
    [
        [0, 4, 5, 6],
        [4, 1, 7, 8],
        [5, 7, 2, 9],
        [6, 8, 9, 3],
        [4, 5, 6, 8],
        [4, 7, 5, 8],
        [5, 7, 9, 8],
        [5, 9, 6, 8],
    ]
)
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


@dataclass(frozen=True)
class Parts:
    """The equal parts of a body, and the ways between neighbours."""

    volumes: FloatArray
    """Volume of each part [m3], shape (n_parts,)."""
    pairs: IntArray
    """Parts on the two sides of each inner face, shape (n_faces, 2)."""
    areas: FloatArray
    """Area of each inner face [m2], shape (n_faces,)."""
    start: FloatArray
    """Centroid of the part on either side of each inner face [m], shape (2 n_faces, 3)."""
    stop: FloatArray
    """Centroid of the face [m], shape (2 n_faces, 3)."""

    @cached_property
    def low(self) -> FloatArray:
        """Lowest corner of the box around each way [m], shape (3, 2 n_faces)."""
        return np.ascontiguousarray(np.minimum(self.start, self.stop).T)

    @cached_property
    def high(self) -> FloatArray:
        """Highest corner of the box around each way [m], shape (3, 2 n_faces)."""
        return np.ascontiguousarray(np.maximum(self.start, self.stop).T)


def divided(mesh: TetrahedralMesh, times: int) -> Parts:
    """Return the parts of a body of which each tetrahedron is divided into eight so many times."""
    x, tetrahedra = mesh.positions, mesh.tetrahedra
    for _ in range(times):
        x, tetrahedra = _divided_once(x, tetrahedra)
    faces = faces_of(tetrahedra)
    order = np.argsort(faces.group, kind="stable")
    last = np.cumsum(faces.count)[faces.count == 2] - 1
    sides = np.stack([order[last - 1], order[last]], axis=1)
    corners = faces.nodes[sides[:, 0]]
    centroids = x[tetrahedra].mean(axis=1)
    pairs = sides // 4
    return Parts(
        np.abs(volumes(x, tetrahedra)),
        pairs,
        triangle_areas(x, corners),
        centroids[pairs.T.ravel()],
        np.tile(x[corners].mean(axis=1), (2, 1)),
    )


def _divided_once(x: FloatArray, tetrahedra: IntArray) -> tuple[FloatArray, IntArray]:
    ends = np.sort(tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    edges, middle = np.unique(ends, axis=0, return_inverse=True)
    nodes = np.hstack([tetrahedra, len(x) + middle.reshape(-1, 6)])
    return np.vstack([x, x[edges].mean(axis=1)]), nodes[:, CHILDREN].reshape(-1, 4)


class ExactPieces:
    """The pieces of a body, cut by cut.

    Args:
        parts: The equal parts of the uncut body.
        crumb: Volume up to which a piece is not cut loose but stays with the side of the cut that
            it touches most (`CutSettings.crumb`) [m3].
    """

    def __init__(self, parts: Parts, crumb: float) -> None:
        self.parts = parts
        self.crumb = crumb
        self.is_open = np.zeros(len(parts.pairs), dtype=bool)

    def cut(self, edges: FloatArray) -> None:
        """Cut along the ruled surface of an edge [m], shape (n_positions, 2, 3)."""
        new = crossed_faces(self.parts, edges) & ~self.is_open
        self.is_open |= new
        self._keep_crumbs(new)

    def volumes(self) -> FloatArray:
        """Return the volume of each piece [m3], shape (n_pieces,)."""
        return np.bincount(self._labels(), weights=self.parts.volumes)

    def _labels(self) -> IntArray:
        n, joined = len(self.parts.volumes), self.parts.pairs[~self.is_open]
        graph = coo_array((np.ones(len(joined), np.int8), (joined[:, 0], joined[:, 1])), (n, n))
        return connected_components(graph, directed=False)[1]

    def _keep_crumbs(self, new: np.ndarray) -> None:
        """Join each crumb that a cut made to the side that it touches most across the cut."""
        while True:
            label = self._labels()
            is_crumb = np.bincount(label, weights=self.parts.volumes) <= self.crumb
            sides = label[self.parts.pairs]
            (faces,) = np.nonzero(new & self.is_open & (sides[:, 0] != sides[:, 1]))
            own = np.concatenate([sides[faces], sides[faces, ::-1]])
            faces = np.tile(faces, 2)
            faces, own = faces[is_crumb[own[:, 0]]], own[is_crumb[own[:, 0]]]
            if len(faces) == 0:
                return
            contacts, of_face = np.unique(own, axis=0, return_inverse=True)
            area = np.bincount(of_face.ravel(), weights=self.parts.areas[faces])
            by_area = np.lexsort((area, contacts[:, 0]))  # of each crumb, the largest is last
            is_last = np.append(np.diff(contacts[by_area, 0]) != 0, True)
            most = np.zeros(len(contacts), dtype=bool)
            most[by_area[is_last]] = True
            self.is_open[faces[most[of_face.ravel()]]] = False


def crossed_faces(parts: Parts, edges: FloatArray) -> np.ndarray:
    """Return which inner faces lie on a way that a ruled surface crosses, shape (n_faces,).

    Args:
        parts: The parts of a body.
        edges: Positions of the edge [m], shape (n_positions, 2, 3).
    """
    crossed = np.zeros(len(parts.start), dtype=bool)
    for before, after in itertools.pairwise(edges):
        corners = np.array([*before, *after])
        is_near = ~crossed
        for low, high, place in zip(parts.low, parts.high, corners.T, strict=True):
            is_near &= (low <= place.max()) & (high >= place.min())
        (near,) = np.nonzero(is_near)
        start, stop = parts.start[near], parts.stop[near]
        hit = _crosses(start, stop, before[0], before[1], after[0])
        hit |= _crosses(start, stop, before[1], after[1], after[0])
        crossed[near[hit]] = True
    return crossed.reshape(2, -1).any(axis=0)


def _crosses(
    start: FloatArray, stop: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray
) -> np.ndarray:
    """Return which segments cross a triangle, shape (n,).

    A point in the plane counts as below it, so that of two ways that meet there one crosses.
    """
    normal = np.cross(b - a, c - a)
    above, below = _height(start, a, normal), _height(stop, a, normal)
    (index,) = np.nonzero((above > 0.0) != (below > 0.0))
    share = (above[index] / (above[index] - below[index]))[:, None]
    at = start[index] + share * (stop[index] - start[index])
    least = -SEAM * float(normal @ normal)
    is_within = np.ones(len(index), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        is_within &= np.cross(q - p, at - p) @ normal >= least
    crosses = np.zeros(len(start), dtype=bool)
    crosses[index[is_within]] = True
    return crosses


def _height(p: FloatArray, a: FloatArray, normal: FloatArray) -> FloatArray:
    """Return heights over a plane, each point by the same arithmetic whichever segment it ends."""
    d = p - a
    return d[:, 0] * normal[0] + d[:, 1] * normal[1] + d[:, 2] * normal[2]
