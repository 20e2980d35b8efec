"""Gmsh's types of elements, and the elements of a file with the groups that they are in."""

from collections.abc import Mapping

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader
from tissue.io.cell_types import CellType, cell_types
from tissue.io.mesh_file import CellBlock, MeshFile, mesh_file
from tissue.mesh.mesh_arrays import MeshError

_CELL_TYPES = cell_types(
    {
        "points": {15: 1},
        "lines": {1: 2, 8: 3, 26: 4, 27: 5, 28: 6},
        "triangles": {2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21},
        "quadrangles": {3: 4, 10: 9, 16: 8},
        "tetrahedra": {4: 4, 11: 10, 29: 20, 30: 35, 31: 56},
        "hexahedra": {5: 8, 12: 27, 17: 20, 92: 64, 93: 125},
        "prisms": {6: 6, 13: 18, 18: 15},
        "pyramids": {7: 5, 14: 14, 19: 13},
    }
)


class Elements:
    """The elements read so far, by type: tag, groups and nodes of each."""

    def __init__(self) -> None:
        self._rows: dict[int, list[IntArray]] = {}

    def add(self, number: int, tags: IntArray, groups: IntArray, nodes: IntArray) -> None:
        """Add elements of one type.

        Args:
            number: Gmsh's number of the type.
            tags: Their tags, shape (n_elements,).
            groups: The physical group and the part of the geometry that they are in, 0 for none,
                shape (n_elements, 2).
            nodes: The tags of their nodes, shape (n_elements, n_nodes).
        """
        if len(nodes):
            self._rows.setdefault(number, []).append(np.column_stack((tags, groups, nodes)))

    def file(
        self,
        file_format: str,
        tags: IntArray,
        positions: FloatArray,
        group_names: Mapping[int, str],
        remarks: tuple[str, ...] = (),
    ) -> MeshFile:
        """Return the mesh of the elements.

        Labels are the physical groups. Where no volume is in one, and the geometry has several
        volumes, they are the numbers of these.

        Args:
            file_format: Name of the format.
            tags: The tags of the nodes, shape (n_nodes,).
            positions: Their positions, shape (n_nodes, 3).
            group_names: Names of the physical groups of volumes.
            remarks: What is to be said of the file.

        Raises:
            MeshError: see `mesh_file`; or an element occurs twice that is no volume.
        """
        rows = {number: np.concatenate(found) for number, found in self._rows.items()}
        fills = {number for number in rows if _CELL_TYPES[number].fills}
        for number in sorted(rows.keys() - fills):
            _refuse_repeated_records(rows[number], _CELL_TYPES[number])
        groups = [np.abs(rows[number][:, 1:3]) for number in fills]
        column = _column_of_labels(np.concatenate(groups)) if groups else None
        blocks = [
            CellBlock(
                _CELL_TYPES[number],
                found[:, 3:],
                found[:, 0],
                np.abs(found[:, column]) if column is not None and number in fills else None,
            )
            for number, found in sorted(rows.items())
        ]
        names = group_names if column == 1 else {}
        return mesh_file(
            file_format, positions, blocks, tags=tags, label_names=names, remarks=remarks
        )


def _column_of_labels(groups: IntArray) -> int | None:
    """Return which column of the rows is that of the labels, None for none."""
    if groups[:, 0].any():
        return 1
    return 2 if len(np.unique(groups[:, 1])) > 1 else None


def _refuse_repeated_records(rows: IntArray, cell_type: CellType) -> None:
    """Refuse elements of which two have the same tag and nodes: one is in the place of another."""
    in_order = rows[np.lexsort(rows.T)]
    twice = np.flatnonzero((in_order[1:] == in_order[:-1]).all(axis=1))
    if twice.size:
        raise MeshError(
            f"element {in_order[twice[0], 0]}, one of the {cell_type.name}, occurs twice: another "
            "is missing in its place"
        )


def element_type(reader: ByteReader, number: int, at: int | None = None) -> CellType:
    """Return the type of element with Gmsh's number `number`, or fail at byte `at`."""
    if number not in _CELL_TYPES:
        reader.fail(f"expected a type of element that Gmsh knows, found {number}", at)
    return _CELL_TYPES[number]
