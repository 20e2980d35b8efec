"""The table `[body]`, or the rows of `[[body]]`, and the mesh that they describe."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, get_args

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.gallbladder import gallbladder
from scalpel_sim.meshing.graded import graded_block, lobe
from scalpel_sim.scene.schema import PresetMaterialTable
from scalpel_sim.tables.problems import check_keys
from scalpel_sim.tables.values import (
    CellCounts,
    CellSizes,
    FileName,
    Finite,
    FourNumbers,
    Kind,
    Name,
    Positive,
    Region,
    Size,
    ThreeNumbers,
    TomlTable,
    TrueOrFalse,
    Whole,
    one_of,
)
from tissue import BoolArray, FloatArray, TetrahedralMesh

BodyShape = Literal[
    "organ", "gallbladder", "block", "lattice", "graded", "lobe", "cylinder", "mesh"
]
_SHAPES: tuple[BodyShape, ...] = get_args(BodyShape)

USUAL_FIXED, USUAL_STRETCH = "left,right", 0.05
"""Sides that are held where a scene says nothing else, and how far they are pulled apart."""

_RINGS = 5
"""Rings of elements of a cylinder, from its axis to its side, where a file gives none."""


KEYS_OF_SHAPE = {
    "organ": Kind(),
    "gallbladder": Kind(possible=("coarse",)),
    "block": Kind(needed=("size", "cells")),
    "lattice": Kind(needed=("size", "cells")),
    "graded": Kind(needed=("along_x", "along_y", "along_z")),
    "lobe": Kind(needed=("along_x", "along_y", "along_z")),
    "cylinder": Kind(needed=("radius", "height"), possible=("rings", "layers")),
    "mesh": Kind(needed=("file",), possible=("scale",)),
}
"""Keys of `[body]` that each shape has."""


class BodyTable(TomlTable, kw_only=True, frozen=True, dict=True):
    """`[body]`: the geometry. Its keys depend on the shape."""

    shape: Annotated[BodyShape, one_of(*_SHAPES)]
    """`"organ"`, a liver lobe of 5,136 tetrahedra; `"gallbladder"`, one on its bed of liver, with
    fat and artery as labels, 4,852 tetrahedra; `"block"`; `"lattice"`, a block with a node in
    each cell too, for what is bent ([materials](materials.md#the-laws)); `"graded"`, a block of
    cells of different sizes; `"lobe"`, such a block rounded to a small lobe; `"cylinder"`;
    or `"mesh"`, a file."""
    size: Size | None = None
    """Extent of a block or a lattice along x, y and z [m]."""
    cells: CellCounts | None = None
    """Number of its cells along x, y and z."""
    along_x: CellSizes | None = None
    """Sizes of the cells of a graded block or a lobe along x [m]."""
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
    coarse: TrueOrFalse | None = None
    """Whether a gallbladder has the coarse mesh of 1,074 tetrahedra: for policies that learn."""
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
    faces down), a box x0,y0,z0:x1,y1,z1 in m, a sphere sphere:x,y,z,radius in m, a label label:NAME
    (or its number), or none."""
    stretch: Finite | None = None
    """Fraction by which opposite held sides are pulled apart before the run: a slit opens.
    0.05 where left and right are held and the file gives none, else 0."""

    @property
    def stretched_by(self) -> float:
        """Fraction by which opposite held sides are pulled apart."""
        if self.stretch is not None:
            return self.stretch
        return USUAL_STRETCH if self.fixed == USUAL_FIXED else 0.0


class OneOfBodiesTable(BodyTable, kw_only=True, frozen=True, dict=True):
    """`[[body]]` of a scene: one of several bodies, where it lies at rest, and how it is held."""

    name: Name
    """Name of the body, and of its label in tables and results."""
    pos: ThreeNumbers = (0.0, 0.0, 0.0)
    """Where the origin of its shape, or of its file, comes [m]."""
    quat: FourNumbers = (1.0, 0.0, 0.0, 0.0)
    """Rotation of the shape about that origin: w, x, y, z."""
    material: PresetMaterialTable | None = None
    """Material: a preset, with figures that replace its own; or figures that replace those of
    `[material]`."""
    fixed: Region = "none"
    """Part of this body that is held, as for one body, with sides of its own."""
    weld: TrueOrFalse = False
    """Whether it is bonded to those above it where faces of both lie node on node."""

    @cached_property
    def _mesh(self) -> TetrahedralMesh:
        from tissue import placed

        return placed(_mesh_of(self), self.pos, self._rotation)

    @property
    def _rotation(self) -> FloatArray | None:
        """Axes of the shape as columns, shape (3, 3); None: it is not turned."""
        if self.quat == (1.0, 0.0, 0.0, 0.0):
            return None
        from scipy.spatial.transform import Rotation  # 0.1 s, and few bodies are turned

        return np.asarray(Rotation.from_quat(self.quat, scalar_first=True).as_matrix())


Bodies = HeldBodyTable | tuple[OneOfBodiesTable, ...]
"""`[body]`, or the rows of `[[body]]`."""


def check_bodies(bodies: Bodies) -> None:
    """Check that the keys of a body are those of its shape, and that names of several differ.

    Raises:
        UsageError: they are not; the message says which.
    """
    if isinstance(bodies, GivenBody):
        return
    if isinstance(bodies, HeldBodyTable):
        check_keys(bodies, "[body]", "shape", KEYS_OF_SHAPE)
        return
    if not bodies:
        raise UsageError("the scene has no body; give [body], or rows of [[body]]")
    for i, body in enumerate(bodies):
        where = f"[[body]] number {i + 1}"
        check_keys(body, where, "shape", KEYS_OF_SHAPE)
        if not any(body.quat):
            raise UsageError(f"{where} quat is [0, 0, 0, 0]; it is a rotation: w, x, y, z")
    names = [body.name for body in bodies]
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise UsageError(f"two of [[body]] are called {twice[0]}; choose another name for one")


def mesh_of_bodies(bodies: Bodies) -> TetrahedralMesh:
    """Return the mesh of one body, or of several, each with labels of its own.

    Raises:
        MeshError: a file holds no mesh that could be cut, or bodies overlap.
        ValueError: there can be no such body.
    """
    if isinstance(bodies, HeldBodyTable):
        return bodies.mesh()
    from tissue import joined

    meshes = {}
    for body in bodies:
        try:
            meshes[body.name] = body.mesh()
        except ValueError as error:
            raise type(error)(f"[[body]] '{body.name}': {error}") from error
    return joined(meshes, weld=[body.name for body in bodies if body.weld])


def nodes_held(bodies: Bodies, mesh: TetrahedralMesh) -> BoolArray:
    """Return which nodes of the mesh of these bodies are held, shape (n_nodes,).

    Raises:
        ValueError: no node is there.
    """
    from tissue import fixed_nodes

    if isinstance(bodies, HeldBodyTable):
        return fixed_nodes(mesh, bodies.fixed)
    masks = [fixed_nodes(mesh, body.fixed, body.name) for body in bodies]
    return np.asarray(np.any(masks, axis=0))


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
            return gallbladder(coarse=bool(body.coarse))
        case "graded" | "lobe":
            assert body.along_x is not None
            assert body.along_y is not None and body.along_z is not None
            sizes = (body.along_x, body.along_y, body.along_z)
            return graded_block(*sizes) if body.shape == "graded" else lobe(*sizes)
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
