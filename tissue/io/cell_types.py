"""Types of cells, those of VTK, and a clear error where a mesh has none of four nodes."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.mesh.mesh_arrays import MeshError


class CellType(NamedTuple):
    """A type of cell."""

    name: str
    """Name in messages, in the plural."""
    dimension: int
    """Dimension: 0 for points to 3 for volumes."""
    n_nodes: int
    """Number of nodes; 0 where it varies."""


_SHAPES = {
    "points": (0, 1),
    "lines": (1, 2),
    "triangles": (2, 3),
    "quadrangles": (2, 4),
    "tetrahedra": (3, 4),
    "pyramids": (3, 5),
    "prisms": (3, 6),
    "wedges": (3, 6),
    "hexahedra": (3, 8),
}
"""Shapes of cells: dimension, and number of corners."""


def cell_types(numbers: Mapping[str, Mapping[int, int]]) -> dict[int, CellType]:
    """Return the types of cells by a format's numbers of them.

    Args:
        numbers: For each shape the number of each type, and how many nodes that has.
    """
    made = {}
    for shape, types in numbers.items():
        dimension, n_corners = _SHAPES[shape]
        for number, n in types.items():
            name = shape if n == n_corners else f"{shape} with {n} nodes"
            made[number] = CellType(name, dimension, n)
    return made


def expect_tetrahedra(
    counts: Mapping[int, int], cell_types: Mapping[int, CellType], tetrahedron: int
) -> None:
    """Raise an error unless there are tetrahedra and no other volumes.

    Args:
        counts: Number of cells of each type, by the format's number of the type.
        cell_types: The types of cells by the format's numbers.
        tetrahedron: The format's number of the tetrahedron with four nodes.

    Raises:
        MeshError: There are none, or there are other volumes, which would leave holes.
    """
    named = {
        number: cell_types.get(number, CellType(f"cells of type {number}", 3, 0))
        for number in counts
    }
    found = ", ".join(f"{counts[number]} {named[number].name}" for number in sorted(counts))
    volumes = [n for n in counts if named[n].dimension == 3 and n != tetrahedron]
    if volumes:
        raise MeshError(
            f"expected tetrahedra with four nodes only, found {found}: mesh the body with "
            "tetrahedra of first order"
        )
    if tetrahedron in counts:
        return
    if any(named[n].dimension == 2 for n in counts):
        raise MeshError(
            f"only a surface, no tetrahedra: found {found}. Fill it with tetrahedra first, with "
            "Gmsh or fTetWild for example"
        )
    raise MeshError(f"there are no tetrahedra; found {found or 'no cells'}")


def expect_ignorable(n_nodes: int, cell: str) -> None:
    """Raise an error unless a cell that is no tetrahedron is a point, a line or a triangle.

    A tetrahedron whose type is wrong has four nodes. It would be lost without a word.

    Args:
        n_nodes: How many nodes it has.
        cell: What it is called in messages.

    Raises:
        MeshError: It has more than three nodes.
    """
    if n_nodes > 3:
        raise MeshError(
            f"{cell} has {n_nodes} nodes: besides tetrahedra there may be points, lines and "
            "triangles only. If it is a tetrahedron its type is wrong; if not, leave it out"
        )


def uniform_records(
    flat: IntArray, start: int, stride: int, columns: list[int], most: int
) -> IntArray:
    """Return the records from `start` on that agree with the first one in `columns`.

    Files list cells one by one, each with its type and size, and mostly many of the same in a row.

    Args:
        flat: The records, one after another.
        start: Where the first one begins.
        stride: The length of a record.
        columns: The entries of a record that hold its type and size.
        most: Number of records to return at most.

    Returns:
        Shape (n_records, stride), or empty where `flat` ends within the first.
    """
    n_left = min(most, (len(flat) - start) // stride)
    if n_left == 0:
        return flat[:0].reshape(0, 1)
    records = flat[start : start + n_left * stride].reshape(n_left, stride)
    n_equal, n_tried = 0, 64
    while n_equal < n_left:  # in pieces that grow, so that many short runs cost little
        piece = records[n_equal : n_equal + n_tried]
        equal = (piece[:, columns] == records[0, columns]).all(axis=1)
        if not equal.all():
            return records[: n_equal + int(np.argmin(equal))]
        n_equal, n_tried = n_equal + len(piece), 4 * n_tried
    return records


_TETRAHEDRON = 10

_CELL_TYPES = {
    **cell_types(
        {
            "points": {1: 1},
            "lines": {3: 2, 21: 3},
            "triangles": {5: 3, 22: 6, 34: 7},
            "quadrangles": {9: 4, 23: 8, 28: 9},
            "tetrahedra": {10: 4, 24: 10},
            "hexahedra": {12: 8, 25: 20},
            "wedges": {13: 6},
            "pyramids": {14: 5},
        }
    ),
    0: CellType("empty cells", 0, 0),
    2: CellType("groups of points", 0, 0),
    4: CellType("polylines", 1, 0),
    6: CellType("triangle strips", 2, 0),
    7: CellType("polygons", 2, 0),
    8: CellType("pixels", 2, 4),
    11: CellType("voxels", 3, 8),
    42: CellType("polyhedra", 3, 0),
    **{
        first + k: CellType(f"{kind} {shape}", dimension, 0)
        for first, kind in ((68, "Lagrange"), (75, "Bezier"))
        for k, (shape, dimension) in enumerate(
            (("curves", 1), ("triangles", 2), ("quadrangles", 2), ("tetrahedra", 3))
        )
    },
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
