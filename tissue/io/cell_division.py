"""Hexahedra, wedges and pyramids divided into tetrahedra whose faces agree with their neighbours'.

A cell is divided from its node of smallest number: each side that does not hold this node makes a
tetrahedron with it, or two where the side has four corners. A side of four corners is divided from
its own node of smallest number, whichever cell it is seen from, so the halves of neighbours match.

Source: J. Dompierre, P. Labbe, M.-G. Vallet and R. Camarero, "How to subdivide pyramids, prisms and
hexahedra into tetrahedra", 8th International Meshing Roundtable (1999).
"""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, IntArray

_WEDGE = ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))

_HEXAHEDRON = (
    *((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5)),
    *((2, 3, 7, 6), (3, 0, 4, 7)),
)

_ROUND_A_VOXEL = (0, 1, 3, 2, 4, 5, 7, 6)
"""Corners of a voxel, which VTK lists along x, y and z, in the order of those of a hexahedron."""

_SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "pyramids": ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "prisms": _WEDGE,
    "wedges": _WEDGE,
    "hexahedra": _HEXAHEDRON,
    "voxels": tuple(tuple(_ROUND_A_VOXEL[k] for k in side) for side in _HEXAHEDRON),
}
"""Corners of the sides of a cell, around each."""


class Divided(NamedTuple):
    """The tetrahedra that cells are divided into."""

    tetrahedra: IntArray
    """Node indices, shape (n_tets, 4); they wind either way."""
    parent: IntArray
    """Which of the cells each was a part of, shape (n_tets,), in order."""
    uncommon: IntArray
    """Triangles of the sides of four corners as they would be if divided the other way, shape
    (n, 3): if a tetrahedron has one, it does not match."""
    n_collapsed: int
    """Number of cells that have a node twice, which are flat there and make fewer tetrahedra."""


def divided(corners: IntArray, shape: str) -> Divided:
    """Divide cells of one shape into tetrahedra.

    Args:
        corners: The corners of each cell, shape (n_cells, n_corners).
        shape: "tetrahedra", which stay, "pyramids", "prisms", "wedges", "hexahedra" or "voxels".
    """
    if shape == "tetrahedra":
        return Divided(corners, np.arange(len(corners)), np.zeros((0, 3), np.int64), 0)
    apex = corners.min(axis=1)
    tetrahedra, parents, uncommon = [], [], [np.zeros((0, 3), np.int64)]
    for side in _SIDES[shape]:
        around = corners[:, side]
        if len(side) == 4:
            turned = _from_smallest(around)
            uncommon += [turned[:, [0, 1, 3]], turned[:, [1, 2, 3]]]
        far = np.flatnonzero((around != apex[:, None]).all(axis=1))
        for triangle in _triangles(around[far]):
            tetrahedra.append(np.column_stack((triangle, apex[far])))
            parents.append(far)
    parent = np.concatenate(parents)
    order = np.argsort(parent, kind="stable")
    made, parent = np.concatenate(tetrahedra)[order], parent[order]
    whole = ~_has_twin(made)
    return Divided(
        made[whole], parent[whole], np.concatenate(uncommon), int(_has_twin(corners).sum())
    )


def _triangles(sides: IntArray) -> tuple[IntArray, ...]:
    """Return the triangles of sides of three or four corners."""
    if sides.shape[1] == 3:
        return (sides,)
    turned = _from_smallest(sides)
    return turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]


def _from_smallest(sides: IntArray) -> IntArray:
    """Return the corners of sides of four from the smallest on."""
    first = sides.argmin(axis=1)[:, None]
    return np.take_along_axis(sides, (first + np.arange(4)) % 4, axis=1)


def _has_twin(nodes: IntArray) -> BoolArray:
    """Return whether a row has an entry twice, shape (n_rows,)."""
    in_order = np.sort(nodes, axis=1)
    return np.asarray((in_order[:, 1:] == in_order[:, :-1]).any(axis=1))
