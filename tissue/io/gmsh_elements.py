"""Gmsh's types of elements, and nodes by their tags."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader
from tissue.io.cell_types import CellType, cell_types, expect_ignorable, expect_tetrahedra
from tissue.mesh.mesh_arrays import MeshError
from tissue.types import TetrahedralMesh

_TETRAHEDRON = 4

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
    """The elements read so far, by type: tag and nodes of each."""

    def __init__(self) -> None:
        self._rows: dict[int, list[IntArray]] = {}

    def add(self, number: int, tags: IntArray, nodes: IntArray) -> None:
        """Add elements of one type.

        Args:
            number: Gmsh's number of the type.
            tags: Their tags, shape (n_elements,).
            nodes: The tags of their nodes, shape (n_elements, n_nodes).
        """
        if len(nodes):
            self._rows.setdefault(number, []).append(np.column_stack((tags, nodes)))

    def mesh(self, tags: IntArray, positions: FloatArray) -> TetrahedralMesh:
        """Return the tetrahedra between nodes with `tags`, shape (n_nodes,), at `positions`.

        Raises:
            MeshError: There are no tetrahedra, or cells that cannot be ignored next to them; a node
                or one of these cells occurs twice, or no node has a tag that is named.
        """
        rows = {number: np.concatenate(found) for number, found in self._rows.items()}
        counts = {number: len(found) for number, found in rows.items()}
        expect_tetrahedra(counts, _CELL_TYPES, _TETRAHEDRON)
        wanted = rows.pop(_TETRAHEDRON)[:, 1:]
        for number, ignored in sorted(rows.items()):
            cell_type = _CELL_TYPES[number]
            expect_ignorable(cell_type.n_nodes, f"an element, one of the {cell_type.name},")
            _refuse_repeated_records(ignored, cell_type)
        order = np.argsort(tags, kind="stable")
        in_order = tags[order]
        twice = np.flatnonzero(in_order[1:] == in_order[:-1])
        if twice.size:
            raise MeshError(f"node {in_order[twice[0]]} occurs twice")
        at = np.searchsorted(in_order, wanted)
        at[at == len(tags)] = 0
        missing = in_order[at] != wanted if len(tags) else np.ones(wanted.shape, dtype=bool)
        if missing.any():
            raise MeshError(
                f"index out of range: tetrahedron {np.argwhere(missing)[0, 0]} names node "
                f"{wanted[missing][0]}, which is not among the {len(tags)} nodes of the file"
            )
        return TetrahedralMesh(positions, order[at])


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
