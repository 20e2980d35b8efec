"""VTK's kinds of cells, and the tetrahedra among cells in one list of nodes."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.io.cells import Kind, expect_tetrahedra
from tissue.mesh.validation import MeshError

_TETRAHEDRON = 10

_KINDS = {
    0: Kind("empty cells", 0, 0),
    1: Kind("points", 0, 1),
    2: Kind("groups of points", 0, 0),
    3: Kind("lines", 1, 2),
    4: Kind("polylines", 1, 0),
    5: Kind("triangles", 2, 3),
    6: Kind("triangle strips", 2, 0),
    7: Kind("polygons", 2, 0),
    8: Kind("pixels", 2, 4),
    9: Kind("quadrangles", 2, 4),
    10: Kind("tetrahedra", 3, 4),
    11: Kind("voxels", 3, 8),
    12: Kind("hexahedra", 3, 8),
    13: Kind("wedges", 3, 6),
    14: Kind("pyramids", 3, 5),
    21: Kind("lines with 3 nodes", 1, 3),
    22: Kind("triangles with 6 nodes", 2, 6),
    23: Kind("quadrangles with 8 nodes", 2, 8),
    24: Kind("tetrahedra with 10 nodes", 3, 10),
    25: Kind("hexahedra with 20 nodes", 3, 20),
    28: Kind("quadrangles with 9 nodes", 2, 9),
    34: Kind("triangles with 7 nodes", 2, 7),
    42: Kind("polyhedra", 3, 0),
    68: Kind("Lagrange curves", 1, 0),
    69: Kind("Lagrange triangles", 2, 0),
    70: Kind("Lagrange quadrangles", 2, 0),
    71: Kind("Lagrange tetrahedra", 3, 0),
    75: Kind("Bezier curves", 1, 0),
    76: Kind("Bezier triangles", 2, 0),
    77: Kind("Bezier quadrangles", 2, 0),
    78: Kind("Bezier tetrahedra", 3, 0),
}


def tetrahedra_of(types: IntArray, starts: IntArray, sizes: IntArray, flat: IntArray) -> IntArray:
    """Return the nodes of the tetrahedra, shape (n_tets, 4).

    Args:
        types: Kind of each cell, shape (n_cells,).
        starts: Where in `flat` the nodes of each cell begin, shape (n_cells,).
        sizes: How many nodes each cell has, shape (n_cells,).
        flat: The nodes of all cells, one cell after another.

    Raises:
        MeshError: There are no tetrahedra, there are other volumes, or a cell is not within `flat`.
    """
    numbers, counts = np.unique(types, return_counts=True)
    expect_tetrahedra(
        dict(zip(numbers.tolist(), counts.tolist(), strict=True)), _KINDS, _TETRAHEDRON
    )
    outside = np.flatnonzero((starts < 0) | (sizes < 0) | (sizes > len(flat) - starts))
    if outside.size:
        cell = outside[0]
        raise MeshError(
            f"cell {cell} has {sizes[cell]} nodes from entry {starts[cell]} on, but there are "
            f"{len(flat)} entries"
        )
    is_tetrahedron = types == _TETRAHEDRON
    wrong = np.flatnonzero(is_tetrahedron & (sizes != 4))
    if wrong.size:
        raise MeshError(f"cell {wrong[0]} is a tetrahedron with {sizes[wrong[0]]} nodes, not 4")
    return flat[starts[is_tetrahedron][:, None] + np.arange(4)]
