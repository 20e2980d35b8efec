"""Bodies that can be drawn on paper, and small unstructured ones."""

import numpy as np
from scipy.spatial import Delaunay

from tissue.shapes import grid
from tissue.types import BoolArray, FloatArray, TetrahedralMesh
from tissue.validation import quality

FLAT = 1e-9
"""Quality of a tetrahedron that Delaunay makes of four points on the side of a box, at most."""

WORST = 0.03
"""Quality below which a random mesh has slivers that no mesh generator would let pass."""


def unit_tetrahedron() -> TetrahedralMesh:
    """Return the corner of a cube: nodes at the origin and one along each axis."""
    positions = np.vstack([np.zeros(3), np.eye(3)])
    return TetrahedralMesh(positions, np.array([[0, 1, 2, 3]]))


def two_tetrahedra() -> TetrahedralMesh:
    """Return two tetrahedra on either side of the face of nodes 1, 2, 3."""
    positions = np.vstack([np.zeros(3), np.eye(3), np.ones(3)])
    return TetrahedralMesh(positions, np.array([[0, 1, 2, 3], [4, 1, 3, 2]]))


def jittered(n: int, seed: int, size: float = 0.04) -> TetrahedralMesh:
    """Return the Delaunay mesh of a box of n x n x n cells whose nodes are shifted at random.

    Nodes on the sides stay on them, so that the body is the box. Meshes with slivers are passed
    over.
    """
    random = np.random.default_rng(seed)
    while True:
        lattice = grid((n, n, n), (size, size, size)).positions
        spacing = size / n
        shift = random.uniform(-0.3, 0.3, lattice.shape) * spacing
        on_side = (lattice < 0.5 * spacing) | (lattice > size - 0.5 * spacing)
        positions = lattice + np.where(on_side, 0.0, shift)
        tetrahedra = positively_turned(positions, Delaunay(positions).simplices.astype(np.int64))
        tetrahedra = tetrahedra[quality(positions, tetrahedra) > FLAT]
        if quality(positions, tetrahedra).min() > WORST:
            return TetrahedralMesh(positions, tetrahedra)


def positively_turned(positions: FloatArray, tetrahedra: np.ndarray) -> np.ndarray:
    """Return the tetrahedra with the nodes of inverted ones swapped."""
    corners = positions[tetrahedra]
    inverted = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    turned = tetrahedra.copy()
    turned[inverted, 2], turned[inverted, 3] = tetrahedra[inverted, 3], tetrahedra[inverted, 2]
    return turned


def sides(mesh: TetrahedralMesh, axis: int = 0, share: float = 0.0) -> BoolArray:
    """Return the nodes on, or within a share of the extent from, the two sides across an axis."""
    x = mesh.positions[:, axis]
    extent = float(np.ptp(x))
    reach = share * extent + 1e-9 * extent
    return (x <= x.min() + reach) | (x >= x.max() - reach)
