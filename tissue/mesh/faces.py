"""Faces that tetrahedra share, and boundary faces of a mesh."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.mesh.mesh_arrays import tetrahedron_array

OUTWARD = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Local nodes of the face opposite each node, counter-clockwise seen from outside; shape (4, 3)."""


class SortedFaces(NamedTuple):
    """The four faces of every tetrahedron, equal ones next to each other."""

    halves: IntArray
    """Each face as 4 * tetrahedron + local face, shape (4 n_tets,)."""
    starts: IntArray
    """Where in `halves` each distinct face begins, shape (n_faces,)."""
    counts: IntArray
    """Number of tetrahedra that have the face, shape (n_faces,)."""


def sorted_faces(tetrahedra: IntArray) -> SortedFaces:
    """Sort the faces of `tetrahedra`, shape (n_tets, 4), so that equal ones are neighbours."""
    nodes = np.sort(tetrahedra[:, OUTWARD].reshape(-1, 3), axis=1)
    n_nodes = int(tetrahedra.max(initial=-1)) + 1
    first_two = nodes[:, 0] * n_nodes + nodes[:, 1]
    halves = np.lexsort((nodes[:, 2], first_two))
    first_two, third = first_two[halves], nodes[halves, 2]
    is_start = np.ones(len(halves), dtype=bool)
    is_start[1:] = (first_two[1:] != first_two[:-1]) | (third[1:] != third[:-1])
    starts = np.flatnonzero(is_start)
    return SortedFaces(halves, starts, np.diff(starts, append=len(halves)))


def boundary_faces(tetrahedra: IntArray) -> IntArray:
    """Return the triangles that belong to one tetrahedron only, shape (n_triangles, 3).

    Counter-clockwise seen from outside, where the signed volumes are positive.

    Args:
        tetrahedra: Node indices of any type of whole numbers, shape (n_tets, 4).

    Raises:
        MeshError: there are no tetrahedra, or they have another shape or are no whole numbers.
    """
    tetrahedra = tetrahedron_array(tetrahedra)
    faces = sorted_faces(tetrahedra)
    tets, local = np.divmod(np.sort(faces.halves[faces.starts[faces.counts == 1]]), 4)
    return np.take_along_axis(tetrahedra[tets], OUTWARD[local], axis=1)
