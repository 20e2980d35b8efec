"""Test bodies: ones small enough to check by hand, and small unstructured ones."""

import os
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

from tissue import BoolArray, FloatArray, TetrahedralMesh, block, read_mesh
from tissue.mesh.pieces import components
from tissue.mesh.validation import checked, quality
from tissue.shapes.isosurface_stuffing import stuff

FLAT = 1e-9
"""Highest quality of a tetrahedron that Delaunay makes of four points on one side of a box."""

WORST = 0.03
"""Quality below which a random mesh has slivers that no mesh generator would accept."""

FOLDER = os.environ.get("SCALPEL_SIM_TEST_MESHES")
"""Folder of the third-party meshes; tests that need them are skipped if it is not set."""

FILES = {  # file to its unit of length [m]; the organs measure about 0.1 m
    "sofa_liver.msh": 0.01,
    "sofa_truthcylinder1.msh": 0.005,
    "bullet_banana.vtk": 1.0,
    "sofaenv_tissue_volume.msh": 1.0,
}


def third_party_mesh(file: str) -> TetrahedralMesh:
    """Return one of the third-party meshes in `FOLDER`, checked and in metres."""
    return checked(read_mesh(Path(str(FOLDER)) / file, scale=FILES[file])).mesh


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

    Nodes on the sides stay on them, so that the body is the box. Meshes with slivers are
    skipped.
    """
    random = np.random.default_rng(seed)
    while True:
        lattice = block((n, n, n), (size, size, size)).positions
        spacing = size / n
        shift = random.uniform(-0.3, 0.3, lattice.shape) * spacing
        on_side = (lattice < 0.5 * spacing) | (lattice > size - 0.5 * spacing)
        positions = lattice + np.where(on_side, 0.0, shift)
        tetrahedra = positively_oriented(positions, Delaunay(positions).simplices.astype(np.int64))
        tetrahedra = tetrahedra[quality(positions, tetrahedra) > FLAT]
        if quality(positions, tetrahedra).min() > WORST:
            return TetrahedralMesh(positions, tetrahedra)


def positively_oriented(positions: FloatArray, tetrahedra: np.ndarray) -> np.ndarray:
    """Return the tetrahedra with two nodes of each inverted one swapped."""
    corners = positions[tetrahedra]
    inverted = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    oriented = tetrahedra.copy()
    oriented[inverted, 2], oriented[inverted, 3] = tetrahedra[inverted, 3], tetrahedra[inverted, 2]
    return oriented


def half_shell(wall: float, spacing: float, diameter: float = 0.06) -> TetrahedralMesh:
    """Return a bowl, open above, with that thickness of its wall and size of its elements [m]."""
    outer = 0.5 * diameter

    def inside(points: FloatArray) -> FloatArray:
        radius = np.linalg.norm(points, axis=1)
        return np.minimum(np.minimum(outer - radius, radius - (outer - wall)), -points[:, 2])

    reach = outer + 2.0 * spacing
    return _largest_piece(checked(stuff(inside, [[-reach] * 3, [reach] * 3], spacing)).mesh)


def _largest_piece(mesh: TetrahedralMesh) -> TetrahedralMesh:
    """Return the piece of most tetrahedra.

    Of a bowl with elements as large as its wall, parts of the rim share no face with the rest.
    """
    corners = mesh.tetrahedra
    edges = np.stack([np.repeat(corners[:, 0], 3), corners[:, 1:].ravel()], axis=1)
    _, piece_of_node = components(len(mesh.positions), edges)
    piece = piece_of_node[corners[:, 0]]
    used, kept = np.unique(corners[piece == np.bincount(piece).argmax()], return_inverse=True)
    return TetrahedralMesh(mesh.positions[used], kept.reshape(-1, 4))


def sides(mesh: TetrahedralMesh, axis: int = 0, share: float = 0.0) -> BoolArray:
    """Return a mask of the nodes within a share of the extent from the two sides across an axis."""
    x = mesh.positions[:, axis]
    extent = float(np.ptp(x))
    reach = share * extent + 1e-9 * extent
    return (x <= x.min() + reach) | (x >= x.max() - reach)


def jittered_grid(n: int, seed: int, size: float = 0.04, shift: float = 0.15) -> TetrahedralMesh:
    """Return a box of n x n x n cells of six tetrahedra, its inner nodes shifted at random.

    Args:
        n: Cells along each axis.
        seed: Seed of the random shifts.
        size: Edge of the box [m].
        shift: Largest shift of each coordinate, in cells.
    """
    mesh = block((n, n, n), (size, size, size))
    x = mesh.positions
    inner = ((x > 1e-6 * size) & (x < (1.0 - 1e-6) * size)).all(axis=1)
    random = np.random.default_rng(seed)
    shifts = random.uniform(-shift, shift, x.shape) * size / n
    return mesh._replace(positions=x + np.where(inner[:, None], shifts, 0.0))


def body_centred(n: int, seed: int, size: float = 0.04) -> TetrahedralMesh:
    """Return the Delaunay mesh of a box of corners and centres of n x n x n cells, shifted.

    No dihedral angle is less than 10 degrees, as in the output of a mesh generator.
    """
    random = np.random.default_rng(seed)
    corners = block((n, n, n), (size, size, size)).positions
    centres = (np.indices((n, n, n)).reshape(3, -1).T + 0.5) * size / n
    points = np.vstack([corners, centres])
    inner = ((points > 1e-6 * size) & (points < (1.0 - 1e-6) * size)).all(axis=1)
    while True:
        shifts = random.uniform(-0.12, 0.12, points.shape) * size / n
        mesh = _delaunay(points + np.where(inner[:, None], shifts, 0.0))
        if smallest_dihedral(mesh) >= 10.0:
            return mesh


def with_slivers(n: int, seed: int, size: float = 0.05) -> TetrahedralMesh:
    """Return a Delaunay mesh of a box whose flattest dihedral angle is 2 to 4 degrees."""
    random = np.random.default_rng(seed)
    x = block((n, n, n), (size, size, size)).positions
    inside = (x > 1e-6 * size) & (x < (1.0 - 1e-6) * size)
    while True:
        shifts = random.uniform(-0.25, 0.25, x.shape) * size / n
        mesh = _delaunay(x + np.where(inside, shifts, 0.0))
        if 2.0 <= smallest_dihedral(mesh) <= 4.0:
            return mesh


def _delaunay(positions: FloatArray) -> TetrahedralMesh:
    """Return the Delaunay mesh of a box, without the flat tetrahedra on its sides."""
    tetrahedra = positively_oriented(positions, Delaunay(positions).simplices.astype(np.int64))
    return TetrahedralMesh(positions, tetrahedra[quality(positions, tetrahedra) > FLAT])


def smallest_dihedral(mesh: TetrahedralMesh) -> float:
    """Return the smallest angle between two faces of a tetrahedron [degrees]."""
    x, tetrahedra = mesh.positions, mesh.tetrahedra
    smallest = 180.0
    for a, b, c, d in (
        (0, 1, 2, 3),
        (0, 2, 1, 3),
        (0, 3, 1, 2),
        (1, 2, 0, 3),
        (1, 3, 0, 2),
        (2, 3, 0, 1),
    ):
        p, q, r, s = (x[tetrahedra[:, k]] for k in (a, b, c, d))
        m, n = np.cross(q - p, r - p), np.cross(q - p, s - p)
        cosines = (
            np.einsum("ij,ij->i", m, n) / np.linalg.norm(m, axis=1) / np.linalg.norm(n, axis=1)
        )
        smallest = min(smallest, float(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).min()))
    return smallest
