"""Gmsh's kinds of elements, and nodes by their tags."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.cells import Kind, expect_tetrahedra
from tissue.io.source import Source
from tissue.mesh.validation import MeshError
from tissue.types import TetrahedralMesh

_TETRAHEDRON = 4

_KINDS = {
    1: Kind("lines", 1, 2),
    2: Kind("triangles", 2, 3),
    3: Kind("quadrangles", 2, 4),
    4: Kind("tetrahedra", 3, 4),
    5: Kind("hexahedra", 3, 8),
    6: Kind("prisms", 3, 6),
    7: Kind("pyramids", 3, 5),
    8: Kind("lines with 3 nodes", 1, 3),
    9: Kind("triangles with 6 nodes", 2, 6),
    10: Kind("quadrangles with 9 nodes", 2, 9),
    11: Kind("tetrahedra with 10 nodes", 3, 10),
    12: Kind("hexahedra with 27 nodes", 3, 27),
    13: Kind("prisms with 18 nodes", 3, 18),
    14: Kind("pyramids with 14 nodes", 3, 14),
    15: Kind("points", 0, 1),
    16: Kind("quadrangles with 8 nodes", 2, 8),
    17: Kind("hexahedra with 20 nodes", 3, 20),
    18: Kind("prisms with 15 nodes", 3, 15),
    19: Kind("pyramids with 13 nodes", 3, 13),
    20: Kind("triangles with 9 nodes", 2, 9),
    21: Kind("triangles with 10 nodes", 2, 10),
    22: Kind("triangles with 12 nodes", 2, 12),
    23: Kind("triangles with 15 nodes", 2, 15),
    24: Kind("triangles with 15 nodes", 2, 15),
    25: Kind("triangles with 21 nodes", 2, 21),
    26: Kind("lines with 4 nodes", 1, 4),
    27: Kind("lines with 5 nodes", 1, 5),
    28: Kind("lines with 6 nodes", 1, 6),
    29: Kind("tetrahedra with 20 nodes", 3, 20),
    30: Kind("tetrahedra with 35 nodes", 3, 35),
    31: Kind("tetrahedra with 56 nodes", 3, 56),
    92: Kind("hexahedra with 64 nodes", 3, 64),
    93: Kind("hexahedra with 125 nodes", 3, 125),
}


class Elements:
    """The elements read so far: how many of each kind, and the nodes of the tetrahedra."""

    def __init__(self) -> None:
        self._counts: dict[int, int] = {}
        self._tetrahedra: list[IntArray] = []

    def add(self, number: int, node_tags: IntArray) -> None:
        """Take elements of one kind, with the tags of their nodes, shape (n_elements, n_nodes)."""
        if len(node_tags):
            self._counts[number] = self._counts.get(number, 0) + len(node_tags)
        if number == _TETRAHEDRON:
            self._tetrahedra.append(node_tags)

    def mesh(self, tags: IntArray, positions: FloatArray) -> TetrahedralMesh:
        """Return the tetrahedra between nodes with `tags`, shape (n_nodes,), at `positions`.

        Raises:
            MeshError: There are no tetrahedra, a tag is there twice, or none has it.
        """
        expect_tetrahedra(self._counts, _KINDS, _TETRAHEDRON)
        wanted = np.concatenate(self._tetrahedra)
        order = np.argsort(tags, kind="stable")
        in_order = tags[order]
        twice = np.flatnonzero(in_order[1:] == in_order[:-1])
        if twice.size:
            raise MeshError(f"node {in_order[twice[0]]} is there twice")
        at = np.searchsorted(in_order, wanted)
        at[at == len(tags)] = 0
        missing = in_order[at] != wanted if len(tags) else np.ones(wanted.shape, dtype=bool)
        if missing.any():
            raise MeshError(
                f"index out of range: tetrahedron {np.argwhere(missing)[0, 0]} names node "
                f"{wanted[missing][0]}, which is not among the {len(tags)} nodes of the file"
            )
        return TetrahedralMesh(positions, order[at])


def kind_of(source: Source, number: int, at: int | None = None) -> Kind:
    """Return a kind of element by its number, or fail."""
    if number not in _KINDS:
        source.fail(f"expected a type of element that Gmsh knows, found {number}", at)
    return _KINDS[number]
