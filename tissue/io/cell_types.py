"""Types of cells, and a clear error where a mesh is not made of tetrahedra with four nodes."""

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
            f"{cell} has {n_nodes} nodes: beside tetrahedra there may be points, lines and "
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
    n_alike, n_tried = 0, 64
    while n_alike < n_left:  # in pieces that grow, so that many short runs cost little
        piece = records[n_alike : n_alike + n_tried]
        alike = (piece[:, columns] == records[0, columns]).all(axis=1)
        if not alike.all():
            return records[: n_alike + int(np.argmin(alike))]
        n_alike, n_tried = n_alike + len(piece), 4 * n_tried
    return records
