"""Angles of tetrahedra, for tests of mesh quality."""

import itertools

import numpy as np

from tissue import FloatArray, TetrahedralMesh


def dihedral_angles(mesh: TetrahedralMesh) -> FloatArray:
    """Return the angles between the faces of each tetrahedron [degrees], shape (6, n_tets)."""
    corners = mesh.positions[mesh.tetrahedra].transpose(1, 0, 2)
    angles = []
    for i, j in itertools.combinations(range(4), 2):
        k, m = sorted({0, 1, 2, 3} - {i, j})
        along = corners[j] - corners[i]
        one, other = (np.cross(along, corners[n] - corners[i]) for n in (k, m))
        cosines = (one * other).sum(1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))))
    return np.array(angles)
