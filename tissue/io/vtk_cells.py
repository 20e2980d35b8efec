"""VTK's types of cells, and the tetrahedra among cells in one list of nodes."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.io.cell_types import CellType, expect_ignorable, expect_tetrahedra
from tissue.mesh.mesh_arrays import MeshError

_TETRAHEDRON = 10

_CELL_TYPES = {
    0: CellType("empty cells", 0, 0),
    1: CellType("points", 0, 1),
    2: CellType("groups of points", 0, 0),
    3: CellType("lines", 1, 2),
    4: CellType("polylines", 1, 0),
    5: CellType("triangles", 2, 3),
    6: CellType("triangle strips", 2, 0),
    7: CellType("polygons", 2, 0),
    8: CellType("pixels", 2, 4),
    9: CellType("quadrangles", 2, 4),
    10: CellType("tetrahedra", 3, 4),
    11: CellType("voxels", 3, 8),
    12: CellType("hexahedra", 3, 8),
    13: CellType("wedges", 3, 6),
    14: CellType("pyramids", 3, 5),
    21: CellType("lines with 3 nodes", 1, 3),
    22: CellType("triangles with 6 nodes", 2, 6),
    23: CellType("quadrangles with 8 nodes", 2, 8),
    24: CellType("tetrahedra with 10 nodes", 3, 10),
    25: CellType("hexahedra with 20 nodes", 3, 20),
    28: CellType("quadrangles with 9 nodes", 2, 9),
    34: CellType("triangles with 7 nodes", 2, 7),
    42: CellType("polyhedra", 3, 0),
    68: CellType("Lagrange curves", 1, 0),
    69: CellType("Lagrange triangles", 2, 0),
    70: CellType("Lagrange quadrangles", 2, 0),
    71: CellType("Lagrange tetrahedra", 3, 0),
    75: CellType("Bezier curves", 1, 0),
    76: CellType("Bezier triangles", 2, 0),
    77: CellType("Bezier quadrangles", 2, 0),
    78: CellType("Bezier tetrahedra", 3, 0),
}


def tetrahedra_of(types: IntArray, starts: IntArray, sizes: IntArray, flat: IntArray) -> IntArray:
    """Return the nodes of the tetrahedra, shape (n_tets, 4).

    Args:
        types: VTK's type of each cell, shape (n_cells,).
        starts: Where in `flat` the nodes of each cell begin, shape (n_cells,).
        sizes: How many nodes each cell has, shape (n_cells,).
        flat: The nodes of all cells, one cell after another.

    Raises:
        MeshError: There are no tetrahedra, there are other volumes, a cell is not within `flat`,
            its type disagrees with its number of nodes, or it has more than three nodes and is no
            tetrahedron.
    """
    numbers, counts = np.unique(types, return_counts=True)
    expect_tetrahedra(
        dict(zip(numbers.tolist(), counts.tolist(), strict=True)), _CELL_TYPES, _TETRAHEDRON
    )
    outside = np.flatnonzero((starts < 0) | (sizes < 0) | (sizes > len(flat) - starts))
    if outside.size:
        cell = outside[0]
        raise MeshError(
            f"cell {cell} has {sizes[cell]} nodes from entry {starts[cell]} on, but there are "
            f"{len(flat)} entries"
        )
    is_tetrahedron = types == _TETRAHEDRON
    for number in numbers.tolist():
        _check_sizes(number, np.flatnonzero(types == number), sizes)
    tetrahedra: IntArray = flat[starts[is_tetrahedron][:, None] + np.arange(4)]
    return tetrahedra


def _check_sizes(number: int, cells: IntArray, sizes: IntArray) -> None:
    """Check how many nodes the cells of one type have.

    Raises:
        MeshError: They do not have as many as their type, or too many to be ignored.
    """
    cell_type = _CELL_TYPES[number]
    wrong = cells[sizes[cells] != cell_type.n_nodes] if cell_type.n_nodes else cells[:0]
    if wrong.size:
        raise MeshError(
            f"cell {wrong[0]} is one of the {cell_type.name} and has {sizes[wrong[0]]} nodes, not "
            f"{cell_type.n_nodes}"
        )
    if number != _TETRAHEDRON:
        largest = cells[np.argmax(sizes[cells])]
        expect_ignorable(int(sizes[largest]), f"cell {largest}, one of the {cell_type.name},")
