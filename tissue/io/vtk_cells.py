"""VTK's types of cells, and the cells of a grid with the labels among its arrays."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import IntArray
from tissue.io.cell_types import CellType, cell_types
from tissue.io.label_arrays import as_labels, label_array, left_out
from tissue.io.mesh_file import CellBlock
from tissue.mesh.mesh_arrays import MeshError

_CELL_TYPES = {
    **cell_types(
        {
            "points": {1: 1},
            "lines": {3: 2, 21: 3},
            "triangles": {5: 3, 22: 6, 34: 7},
            "quadrangles": {9: 4, 23: 8, 28: 9},
            "tetrahedra": {10: 4, 24: 10},
            "voxels": {11: 8},
            "hexahedra": {12: 8, 25: 20, 29: 27},
            "wedges": {13: 6, 26: 15, 32: 18},
            "pyramids": {14: 5, 27: 13},
        }
    ),
    0: CellType("empty cells", 0, 0),
    2: CellType("groups of points", 0, 0),
    4: CellType("polylines", 1, 0),
    6: CellType("triangle strips", 2, 0),
    7: CellType("polygons", 2, 0),
    8: CellType("pixels", 2, 4),
    42: CellType("polyhedra", 3, 0),
    **{
        first + k: CellType(f"{kind} {shape}", dimension, 0)
        for first, kind in ((68, "Lagrange"), (75, "Bezier"))
        for k, (shape, dimension) in enumerate(
            (("curves", 1), ("triangles", 2), ("quadrangles", 2), ("tetrahedra", 3))
        )
    },
}


def cell_blocks(
    types: IntArray, starts: IntArray, sizes: IntArray, flat: IntArray, labels: IntArray | None
) -> list[CellBlock]:
    """Return the cells of a grid by type, and by size where that varies.

    Args:
        types: VTK's type of each cell, shape (n_cells,).
        starts: Where in `flat` the nodes of each cell begin, shape (n_cells,).
        sizes: How many nodes each cell has, shape (n_cells,).
        flat: The nodes of all cells, one cell after another.
        labels: The label of each cell, shape (n_cells,); None: there are none.

    Raises:
        MeshError: A cell is not within `flat`, or its type disagrees with its number of nodes.
    """
    outside = np.flatnonzero((starts < 0) | (sizes < 0) | (sizes > len(flat) - starts))
    if outside.size:
        cell = outside[0]
        raise MeshError(
            f"cell {cell} has {sizes[cell]} nodes from entry {starts[cell]} on, but there are "
            f"{len(flat)} entries"
        )
    blocks = []
    for number in np.unique(types).tolist():
        cells = np.flatnonzero(types == number)
        kind = _type_of(number)
        _check_sizes(kind, cells, sizes)
        for size in np.unique(sizes[cells]).tolist():
            alike = cells[sizes[cells] == size]
            nodes = flat[starts[alike][:, None] + np.arange(size)]
            of_cells = None if labels is None else labels[alike]
            blocks.append(CellBlock(kind, nodes, alike, of_cells))
    return blocks


def _type_of(number: int) -> CellType:
    """Return what a type of VTK is; one that is not known may hold a volume."""
    return _CELL_TYPES.get(number, CellType(f"cells of type {number}", 3, 0))


def _check_sizes(cell_type: CellType, cells: IntArray, sizes: IntArray) -> None:
    """Refuse cells of one type that do not have as many nodes as it."""
    wrong = cells[sizes[cells] != cell_type.n_nodes] if cell_type.n_nodes else cells[:0]
    if wrong.size:
        raise MeshError(
            f"cell {wrong[0]} is one of the {cell_type.name} and has {sizes[wrong[0]]} nodes, not "
            f"{cell_type.n_nodes}"
        )


def labels_among(
    types: IntArray, names: Sequence[str], values_of: Callable[[str], npt.NDArray[np.generic]]
) -> tuple[IntArray | None, list[str]]:
    """Return the labels of cells, if they are among arrays, and what is to be said of them.

    What an array has of lines and faces makes it no less of labels; theirs are 0 in the result.

    Args:
        types: VTK's type of each cell, shape (n_cells,).
        names: Names of the arrays of numbers, one for each cell.
        values_of: Returns the numbers of an array.
    """
    name = label_array(names)
    if name is None:
        return None, []
    solid = [n for n in np.unique(types).tolist() if _type_of(n).dimension == 3]
    of_solids = np.isin(types, solid)
    found = as_labels(values_of(name)[of_solids])
    if found is None:
        return None, [
            f"the cell data '{name}' are no labels, which are whole numbers from 0 on: left out"
        ]
    labels = np.zeros(len(types), dtype=np.int64)
    labels[of_solids] = found
    said = left_out(names, name)
    return labels, [] if said is None else [said]
