"""The blocks of tissue that benchmarks measure on, from 576 to 1,000,188 tetrahedra."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from tissue import BoolArray, FloatArray, IntArray, TetrahedralMesh, block

_Cells = tuple[int, int, int]

CELL = 0.01
"""Side of a cell [m]."""
JITTER = 0.1
"""Largest displacement of an inner node from the grid, in cells: no two tetrahedra are alike, as in
an organ."""
SEED = 1998
"""Seed of the jitter: every run measures the same blocks."""

BLOCKS: dict[int, _Cells] = {
    576: (4, 4, 6),
    5_400: (9, 10, 10),
    6_000: (10, 10, 10),
    20_250: (15, 15, 15),
    60_000: (20, 20, 25),
    199_800: (30, 30, 37),
    600_000: (40, 50, 50),
    1_000_188: (49, 54, 63),
}
"""Number of cells along x, y and z, by the number of tetrahedra."""


def jittered_block(n_tetrahedra: int) -> TetrahedralMesh:
    """Return the block of that many tetrahedra, one of `BLOCKS`."""
    cells = BLOCKS[n_tetrahedra]
    mesh = block(cells, [CELL * n for n in cells])
    off = np.random.default_rng(SEED).uniform(-JITTER, JITTER, mesh.positions.shape) * CELL
    on_surface = _is_on_sides(mesh.positions, (0, 1, 2))
    positions = mesh.positions + np.where(on_surface[:, None], 0.0, off)
    return TetrahedralMesh(positions, mesh.tetrahedra)


def held_nodes(mesh: TetrahedralMesh) -> BoolArray:
    """Return which nodes are held, shape (n_nodes,): those on the sides across x and y.

    The body sags between them.
    """
    return _is_on_sides(mesh.positions, (0, 1))


def _is_on_sides(positions: FloatArray, axes: tuple[int, ...]) -> BoolArray:
    """Return which nodes lie on the sides of the block across these axes."""
    along = positions[:, axes]
    near = 0.5 * JITTER * CELL
    low, high = along < along.min(axis=0) + near, along > along.max(axis=0) - near
    return np.asarray(np.any(low | high, axis=1))


class MeshEdges(NamedTuple):
    """The edges of a mesh, with what the springs along them and the nodal masses follow from."""

    nodes: IntArray
    """The two nodes of each edge, shape (n_edges, 2)."""
    lengths: FloatArray
    """Length of each edge [m], shape (n_edges,)."""
    volumes: FloatArray
    """Total volume of the tetrahedra around each edge [m3], shape (n_edges,)."""
    node_volumes: FloatArray
    """A quarter of the volume of the tetrahedra around each node [m3], shape (n_nodes,)."""


def measured_edges(mesh: TetrahedralMesh) -> MeshEdges:
    """Return the edges of a mesh."""
    corners = mesh.positions[mesh.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    pairs = [mesh.tetrahedra[:, list(pair)] for pair in combinations(range(4), 2)]
    nodes, edge = np.unique(np.sort(np.vstack(pairs), axis=1), axis=0, return_inverse=True)
    ends = mesh.positions[nodes]
    return MeshEdges(
        nodes,
        np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1),
        np.bincount(edge.ravel(), np.tile(volumes, len(pairs))).astype(np.float64),
        np.bincount(mesh.tetrahedra.ravel(), np.repeat(volumes / 4.0, 4)).astype(np.float64),
    )


def sizes_up_to(sizes: tuple[int, ...], largest: int | None) -> tuple[int, ...]:
    """Return the sizes that are not above the largest one wanted; None: all of them.

    Raises:
        UsageError: no size is left.
    """
    if largest is None:
        return sizes
    left = tuple(n for n in sizes if n <= largest)
    if not left:
        raise UsageError(
            f"--largest is {largest}; the smallest body of this benchmark has {min(sizes)} "
            "tetrahedra"
        )
    return left
