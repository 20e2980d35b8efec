"""The table `[body]`: the geometry of a body."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from scalpel_sim.tables.kinds import KeysOfKind
from scalpel_sim.tables.values import CellCounts, Positive, Size, Text, TomlTable, Whole, one_of
from tissue import TetrahedralMesh

BodyShape = Literal["organ", "block", "lattice", "graded", "cylinder", "mesh"]

_Sizes = Annotated[
    list[Positive], Meta(min_length=1, max_length=1000, description="sizes of cells in m, above 0")
]

_RINGS = 5
"""Rings of elements of a cylinder, from its axis to its side, where nothing is said of it."""

KEYS_OF_SHAPE = {
    "organ": KeysOfKind(),
    "block": KeysOfKind(("size", "cells")),
    "lattice": KeysOfKind(("size", "cells")),
    "graded": KeysOfKind(("along_x", "along_y", "along_z")),
    "cylinder": KeysOfKind(("radius", "height"), ("rings", "layers")),
    "mesh": KeysOfKind(("file",), ("scale",)),
}
"""Keys of `[body]` that each shape has."""


class BodyTable(TomlTable, kw_only=True, frozen=True):
    """`[body]`: the geometry. Which keys there are depends on the shape."""

    shape: Annotated[BodyShape, one_of("organ", "block", "lattice", "graded", "cylinder", "mesh")]
    size: Size | None = None
    cells: CellCounts | None = None
    along_x: _Sizes | None = None
    along_y: _Sizes | None = None
    along_z: _Sizes | None = None
    radius: Positive | None = None
    height: Positive | None = None
    rings: Whole | None = None
    layers: Whole | None = None
    file: Text | None = None
    scale: Positive | None = None


@dataclass(frozen=True)
class BodySource:
    """Makes the mesh of a `[body]`, once."""

    table: BodyTable
    folder: Path = Path()
    """Where a file is whose path is relative."""

    def __call__(self) -> TetrahedralMesh:
        """Return the mesh.

        Raises:
            MeshError: the file holds no mesh that could be cut.
            ValueError: there can be no such body.
        """
        return self._mesh

    @cached_property
    def _mesh(self) -> TetrahedralMesh:
        return mesh_of(self.table, self.folder)


def mesh_of(body: BodyTable, folder: Path) -> TetrahedralMesh:
    """Return the mesh of a body.

    Args:
        body: Its table, whose keys are those of its shape.
        folder: Where a file is whose path is relative.

    Raises:
        MeshError: the file holds no mesh that could be cut.
        ValueError: there can be no such body.
    """
    import tissue  # its shapes load numba

    match body.shape:
        case "organ":
            return tissue.liver_lobe()
        case "graded":
            return _graded_block(body)
        case "cylinder":
            assert body.radius is not None and body.height is not None
            rings = body.rings or _RINGS
            layers = body.layers or max(1, round(body.height * rings / body.radius))
            return tissue.cylinder((rings, layers), body.radius, body.height)
        case "mesh":
            assert body.file is not None
            return tissue.read_mesh(folder / body.file, scale=body.scale or 1.0)
    assert body.cells is not None and body.size is not None
    make = tissue.block if body.shape == "block" else tissue.lattice_block
    return make(body.cells, body.size)


def _graded_block(body: BodyTable) -> TetrahedralMesh:
    """Return a block whose layers of cells are of given sizes, with a corner at the origin."""
    from tissue import block

    assert body.along_x is not None and body.along_y is not None and body.along_z is not None
    sizes = (body.along_x, body.along_y, body.along_z)
    counts = [len(each) for each in sizes]
    mesh = block(counts, [float(n) for n in counts])
    places = [
        np.interp(
            mesh.positions[:, axis], np.arange(len(each) + 1), np.append(0.0, np.cumsum(each))
        )
        for axis, each in enumerate(sizes)
    ]
    return TetrahedralMesh(np.stack(places, axis=1), mesh.tetrahedra)
