"""The table `[body]`, and the mesh that it describes."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, get_args

import numpy as np

from scalpel_sim.meshing.gallbladder import gallbladder
from scalpel_sim.tables.values import (
    CellCounts,
    CellSizes,
    FileName,
    Finite,
    Kind,
    Positive,
    Region,
    Size,
    TomlTable,
    Whole,
    one_of,
)
from tissue import TetrahedralMesh

BodyShape = Literal["organ", "gallbladder", "block", "lattice", "graded", "cylinder", "mesh"]
_SHAPES: tuple[BodyShape, ...] = get_args(BodyShape)

USUAL_FIXED, USUAL_STRETCH = "left,right", 0.05
"""Sides that are held where a scene says nothing else, and how far they are pulled apart."""

_RINGS = 5
"""Rings of elements of a cylinder, from its axis to its side, where a file gives none."""


KEYS_OF_SHAPE = {
    "organ": Kind(),
    "gallbladder": Kind(),
    "block": Kind(needed=("size", "cells")),
    "lattice": Kind(needed=("size", "cells")),
    "graded": Kind(needed=("along_x", "along_y", "along_z")),
    "cylinder": Kind(needed=("radius", "height"), possible=("rings", "layers")),
    "mesh": Kind(needed=("file",), possible=("scale",)),
}
"""Keys of `[body]` that each shape has."""


class BodyTable(TomlTable, kw_only=True, frozen=True, dict=True):
    """`[body]`: the geometry. Its keys depend on the shape."""

    shape: Annotated[BodyShape, one_of(*_SHAPES)]
    """`"organ"`, a liver lobe of 5,136 tetrahedra; `"gallbladder"`, one on its bed of liver, with
    fat and artery as labels, 4,819 tetrahedra; `"block"`; `"lattice"`, a block with a node in
    each cell too, for what is bent ([materials](materials.md#the-laws)); `"graded"`, a block of
    cells of different sizes; `"cylinder"`; or `"mesh"`, a file."""
    size: Size | None = None
    """Extent of a block or a lattice along x, y and z [m]."""
    cells: CellCounts | None = None
    """Number of its cells along x, y and z."""
    along_x: CellSizes | None = None
    """Sizes of the cells of a graded block along x [m]."""
    along_y: CellSizes | None = None
    """Sizes along y [m]."""
    along_z: CellSizes | None = None
    """Sizes along z [m]."""
    radius: Positive | None = None
    """Radius of a cylinder [m]."""
    height: Positive | None = None
    """Height of a cylinder [m]."""
    rings: Whole | None = None
    """Rings of elements of a cylinder, from its axis to its side; 5 without."""
    layers: Whole | None = None
    """Layers of elements of a cylinder; without, as thick as the rings."""
    file: FileName | None = None
    """File of a mesh: Gmsh, VTK, Medit, TetGen, Abaqus or Nastran."""
    scale: Positive | None = None
    """Metres in one unit of the mesh file: 0.001 for millimetres."""

    def mesh(self) -> TetrahedralMesh:
        """Return the mesh, which is made once.

        Raises:
            MeshError: the file holds no mesh that could be cut.
            ValueError: there can be no such body.
        """
        return self._mesh

    @cached_property
    def _mesh(self) -> TetrahedralMesh:
        return _mesh_of(self)


class HeldBodyTable(BodyTable, kw_only=True, frozen=True, dict=True):
    """`[body]` of a scene: the geometry, and how it is held."""

    fixed: Region = USUAL_FIXED
    """Part that is held: sides (left, right, front, back, bottom, top), the underside (all that
    faces down), a box x0,y0,z0:x1,y1,z1 in m, a sphere sphere:x,y,z,radius in m, or none."""
    stretch: Finite | None = None
    """Fraction by which opposite held sides are pulled apart before the run: a slit opens.
    0.05 where left and right are held and the file gives none, else 0."""

    @property
    def stretched_by(self) -> float:
        """Fraction by which opposite held sides are pulled apart."""
        if self.stretch is not None:
            return self.stretch
        return USUAL_STRETCH if self.fixed == USUAL_FIXED else 0.0


class GivenBody(HeldBodyTable, kw_only=True, frozen=True, dict=True):
    """A body that no file describes: its mesh is made in Python, or is in another process."""

    shape: BodyShape = "mesh"
    source: Callable[[], TetrahedralMesh]
    """Makes the mesh."""

    @cached_property
    def _mesh(self) -> TetrahedralMesh:
        return self.source()


def _mesh_of(body: BodyTable) -> TetrahedralMesh:
    """Return the mesh of a body, whose keys are those of its shape."""
    import tissue  # its shapes load numba

    match body.shape:
        case "organ":
            return tissue.liver_lobe()
        case "gallbladder":
            return gallbladder()
        case "graded":
            return _graded_block(body)
        case "cylinder":
            assert body.radius is not None and body.height is not None
            rings = body.rings or _RINGS
            layers = body.layers or max(1, round(body.height * rings / body.radius))
            return tissue.cylinder((rings, layers), body.radius, body.height)
        case "mesh":
            assert body.file is not None
            return tissue.read_mesh(Path(body.file), scale=body.scale or 1.0)
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
