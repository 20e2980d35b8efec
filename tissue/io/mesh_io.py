"""Meshes from files, and bodies to files."""

import logging
import math
import os
import re
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.abaqus import read_abaqus
from tissue.io.byte_reader import shown
from tissue.io.gmsh import read_gmsh
from tissue.io.medit import read_medit
from tissue.io.mesh_file import MeshFile
from tissue.io.nastran import read_nastran
from tissue.io.tetgen import read_tetgen
from tissue.io.vtk_legacy import read_vtk
from tissue.io.vtu import read_vtu
from tissue.io.vtu_writer import write_mesh, write_vtu
from tissue.mesh.mesh_arrays import MeshError, mesh_arrays
from tissue.mesh.validation import checked
from tissue.types import TetrahedralMesh

__all__ = ["MeshError", "mesh_from_arrays", "read_mesh", "write_mesh", "write_vtu"]

_logger = logging.getLogger("tissue")

_READERS: dict[str, Callable[[bytes], MeshFile]] = {
    ".msh": read_gmsh,
    ".vtk": read_vtk,
    ".vtu": read_vtu,
    ".mesh": read_medit,
    ".meshb": read_medit,
    ".inp": read_abaqus,
    ".bdf": read_nastran,
    ".nas": read_nastran,
}
"""Reader of the files with each suffix, where their first bytes do not show what they are."""

_TETGEN = {".node": ".ele", ".ele": ".node"}
"""Suffixes of TetGen's two files, and that of the other."""

_BEGINNINGS: tuple[tuple[re.Pattern[bytes], Callable[[bytes], MeshFile]], ...] = (
    (re.compile(rb"\s*\$(?:MeshFormat|NOD)\b"), read_gmsh),
    (re.compile(rb"(?i)# vtk datafile"), read_vtk),
    (re.compile(rb"\s*(?:<\?xml[^>]*>\s*(?:<!--.*?-->\s*)*)?<VTKFile\b", re.DOTALL), read_vtu),
    (re.compile(rb"(?:\s*#[^\n]*\n)*\s*MeshVersionFormatted\b"), read_medit),
    (re.compile(rb"(?i)(?:\s*\*\*[^\n]*\n)*\s*\*(?:HEADING|NODE|PART|PREPRINT)\b"), read_abaqus),
    (re.compile(rb"(?i)(?:\s*\$[^\n]*\n)*\s*(?:SOL |CEND|BEGIN +BULK|GRID[*, ])"), read_nastran),
)
"""Beginning of the files of each format: what counts, whatever their suffix says."""

SUFFIXES = (*_READERS, *_TETGEN)
"""Suffixes of the files that are read."""

SURFACE_SUFFIXES = (".stl", ".obj", ".ply", ".off", ".vtp", ".gltf", ".glb", ".3mf")
"""Suffixes of files that hold surfaces only."""

RENUMBER_FROM = 100_000
"""Tetrahedra from which another order pays. Smaller bodies stay in the cache in any order; at
600,000 a step of a body in random order, as mesh generators write it, takes 1.7 times as long."""

MAX_FILE_BYTES = 2**31 - 1
"""Size of the largest file [bytes]: the parser of XML counts in 32 bits. A larger one holds tens of
millions of tetrahedra, too many to cut at an interactive rate."""


def read_mesh(path: str | os.PathLike[str], scale: float = 1.0) -> TetrahedralMesh:
    """Read a tetrahedral mesh, and check it.

    Reads Gmsh 1.0, 2.0 to 2.2 and 4.1 (`.msh`), VTK legacy (`.vtk`), VTK XML (`.vtu`), Medit
    (`.mesh`, `.meshb`), TetGen (`.node` or `.ele`, the other beside it), Abaqus (`.inp`) and
    Nastran (`.bdf`, `.nas`) files, as text and binary. What a file is shows by its content; where
    that does not show it, by its suffix. Labels of tetrahedra, and their names, are read:
    physical groups, cell data, references, attributes, element sets, properties.

    Pyramids, wedges and hexahedra are divided into tetrahedra, and those of second order are
    straightened; points, lines, triangles and sides of cells are ignored. What is made of a file
    is said by the logger "tissue". From `RENUMBER_FROM` tetrahedra on, nodes and tetrahedra are put
    in an order that the caches like (`tissue.io.mesh_io`); the numbers are then not those of the
    file.

    Args:
        path: The file.
        scale: What the file's unit of length is in metres: 0.001 for millimetres.

    Raises:
        MeshError: There is no such file, no mesh is found in it, or the mesh is broken; see
            `tissue.mesh.validation.checked`, which also says what is repaired.
        ValueError: The scale is not a positive number.
    """
    _expect_scale(scale)
    found = read_mesh_file(path)
    for remark in found.remarks:
        _logger.warning("%s: %s", path, remark)
    mesh = found.mesh
    mesh = checked(mesh._replace(positions=mesh.positions * scale), str(path)).mesh
    if len(mesh.tetrahedra) < RENUMBER_FROM:
        return mesh
    return renumbered(mesh)[0]


def read_mesh_file(path: str | os.PathLike[str]) -> MeshFile:
    """Return what is in the file of a mesh, which is not checked.

    Raises:
        MeshError: There is no such file, or no mesh is found in it.
    """
    place = Path(path)
    suffix = place.suffix.lower()
    if suffix in SURFACE_SUFFIXES:
        raise MeshError(
            f"{path}: {suffix} files hold only a surface, no tetrahedra. Fill it with tetrahedra "
            f"first: scalpel-sim mesh {path}"
        )
    data = _contents(place)
    begins = [reader for beginning, reader in _BEGINNINGS if beginning.match(data[:4096])]
    try:
        if begins:
            return begins[0](data)
        if suffix in _TETGEN:
            other = _contents(place.with_suffix(_TETGEN[suffix]))
            return read_tetgen(data, other) if suffix == ".node" else read_tetgen(other, data)
        if suffix in _READERS:
            return _READERS[suffix](data)
    except MeshError as error:
        raise MeshError(f"{path}: {_other_content(data) or error}") from None
    raise MeshError(
        f"{path}: expected a file ending in {', '.join(SUFFIXES)}, found '{suffix}'. "
        f"`meshio convert {place.name} {place.stem}.vtu` converts many others"
    )


def mesh_from_arrays(
    positions: FloatArray,
    tetrahedra: IntArray,
    labels: IntArray | None = None,
    *,
    label_names: Mapping[int, str] = MappingProxyType({}),
    scale: float = 1.0,
) -> TetrahedralMesh:
    """Return the mesh of arrays, checked and repaired as `read_mesh` does with that of a file.

    Gmsh, TetWild, PyVista and meshio give such arrays in Python. Nodes that no tetrahedron uses
    are dropped, and nodes are split where tetrahedra meet that share no face; tetrahedra stay in
    their order. Repairs are warnings of the logger "tissue".

    Args:
        positions: Positions of the nodes in units of `scale`, shape (n_nodes, 3).
        tetrahedra: Node indices from 0 on, shape (n_tets, 4); they may wind either way.
        labels: Label of each tetrahedron, a whole number from 0 on, shape (n_tets,).
        label_names: Names of labels.
        scale: What the unit of length is in metres: 0.001 for millimetres.

    Raises:
        MeshError: the mesh is broken; see `tissue.mesh.validation.checked`.
        ValueError: the scale is not a positive number.
    """
    _expect_scale(scale)
    mesh = mesh_arrays(TetrahedralMesh(positions, tetrahedra, labels, label_names))
    return checked(mesh._replace(positions=mesh.positions * scale)).mesh


def _expect_scale(scale: float) -> None:
    """Refuse a scale that is no positive number."""
    if not math.isfinite(scale) or scale <= 0.0:
        raise ValueError(f"scale is {scale}; it must be finite and positive, 0.001 for millimetres")


def _contents(path: Path) -> bytes:
    """Return the bytes of a file, or raise an error that says why there are none."""
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise MeshError(f"{path}: expected a file, found a directory")
        if not stat.S_ISREG(status.st_mode):
            raise MeshError(f"{path}: expected a file, found a device or a pipe")
        if status.st_size > MAX_FILE_BYTES:
            raise MeshError(
                f"{path}: expected at most {MAX_FILE_BYTES} bytes, found {status.st_size}"
            )
        data = path.read_bytes()
    except FileNotFoundError:
        raise MeshError(f"{path}: no such file") from None
    except OSError as error:
        raise MeshError(f"{path}: cannot be read: {error.strerror}") from None
    if not data.strip():
        raise MeshError(f"{path}: expected a mesh, found an empty file")
    return data


def stand_in(data: bytes) -> str:
    """Return what a file is that stands for the one that was meant, by its first bytes, or ""."""
    start = data[:200].lstrip().lower()
    if start.startswith((b"<!doctype html", b"<html")):
        return f"expected a mesh, found a web page: {shown(data.strip())}"
    if start.startswith(b"version https://git-lfs"):
        return "expected a mesh, found a Git LFS pointer: fetch the file itself with `git lfs pull`"
    return ""


def _other_content(data: bytes) -> str:
    """Return what a file is instead of a mesh, where its first bytes show that, else ""."""
    if data.lstrip()[:4].lower().startswith((b"\x1f\x8b", b"pk\x03\x04")):
        return "expected a mesh, found a compressed file: unpack it first"
    return stand_in(data)


def renumbered(mesh: TetrahedralMesh) -> tuple[TetrahedralMesh, IntArray]:
    """Return the mesh in the order of reverse Cuthill and McKee, and the new number of each node.

    Node `i` of `mesh` is node `place[i]` of the mesh returned. Tetrahedra are in the order of their
    lowest nodes.
    """
    n = len(mesh.positions)
    pairs = mesh.tetrahedra[:, [0, 0, 0, 1, 1, 2, 1, 2, 3, 2, 3, 3]]
    ends = pairs.reshape(-1, 2, 6)
    a, b = ends[:, 0].ravel(), ends[:, 1].ravel()
    edges = csr_array((np.ones(2 * len(a), np.int8), (np.r_[a, b], np.r_[b, a])), shape=(n, n))
    order = np.asarray(reverse_cuthill_mckee(edges, symmetric_mode=True), dtype=np.int64)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    tetrahedra = place[mesh.tetrahedra]
    by_lowest = np.argsort(tetrahedra.min(axis=1), kind="stable")
    labels = None if mesh.labels is None else mesh.labels[by_lowest]
    moved = mesh._replace(
        positions=mesh.positions[order], tetrahedra=tetrahedra[by_lowest], labels=labels
    )
    return moved, place
