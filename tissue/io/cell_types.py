"""Types of cells by their shapes, and a clear error where a file has none that fill a volume."""

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
    shape: str = ""
    """Name of the shape; "" where it is none that is known by its corners."""

    @property
    def n_corners(self) -> int:
        """Number of corners, which are the first nodes; 0 where it is not known."""
        return _SHAPES[self.shape][1] if self.shape else 0

    @property
    def fills(self) -> bool:
        """Whether such a cell is a tetrahedron or can be divided into some."""
        return self.dimension == 3 and bool(self.shape)


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
    "voxels": (3, 8),
}
"""Shapes of cells: dimension, and number of corners."""


def cell_type(shape: str, n_nodes: int) -> CellType:
    """Return the type of cells of a shape with that many nodes."""
    dimension, n_corners = _SHAPES[shape]
    name = shape if n_nodes == n_corners else f"{shape} with {n_nodes} nodes"
    return CellType(name, dimension, n_nodes, shape)


def cell_types(numbers: Mapping[str, Mapping[int, int]]) -> dict[int, CellType]:
    """Return the types of cells by a format's numbers of them.

    Args:
        numbers: For each shape the number of each type, and how many nodes that has.
    """
    return {
        number: cell_type(shape, n_nodes)
        for shape, types in numbers.items()
        for number, n_nodes in types.items()
    }


def expect_volumes(counts: Mapping[CellType, int]) -> None:
    """Raise an error unless there are cells that fill a volume, and all volumes do.

    Args:
        counts: Number of cells of each type.

    Raises:
        MeshError: There are none, or others that cannot be divided, which would leave holes.
    """
    types = [each for each, n in counts.items() if n]
    found = ", ".join(f"{counts[each]} {each.name}" for each in types)
    if any(each.dimension == 3 and not each.fills for each in types):
        raise MeshError(
            f"expected tetrahedra, pyramids, wedges and hexahedra, found {found}: mesh the body "
            "with tetrahedra"
        )
    if any(each.fills for each in types):
        return
    if any(each.dimension == 2 for each in types):
        raise MeshError(
            f"only a surface, no tetrahedra: found {found}. Save it as STL, and fill it by "
            "`scalpel-sim mesh`"
        )
    raise MeshError(f"there are no tetrahedra; found {found or 'no cells'}")


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
