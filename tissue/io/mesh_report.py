"""Contents of the file of a mesh, and quality of its tetrahedra."""

import math
import os
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.io.mesh_io import read_mesh_file
from tissue.mesh.mesh_arrays import MeshError
from tissue.mesh.pieces import components
from tissue.mesh.validation import examined, quality, signed_volumes
from tissue.types import TetrahedralMesh

USUAL_EXTENTS = (2e-3, 1.0)
"""Extents between which a body for surgery is [m]: a biopsy, and a trunk."""

_UNITS = (1.0, 1e-3, 1e-6)
"""Metres in the units that files have, in the order in which they are guessed: m, mm, um."""

_SIDES = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])


class LabelShare(NamedTuple):
    """The tetrahedra of one label."""

    label: int
    """The label."""
    name: str | None
    """Its name; None where it has none."""
    n_tetrahedra: int
    """Number of tetrahedra."""
    volume: float
    """Their volume [m3]."""


class MeshShape(NamedTuple):
    """Size and quality of a mesh that can be cut."""

    n_nodes: int
    """Number of nodes that are used."""
    n_tetrahedra: int
    """Number of tetrahedra."""
    volume: float
    """Volume [m3]."""
    n_pieces: int
    """Number of pieces that share no face."""
    labels: tuple[LabelShare, ...]
    """Its labels, in order; none where it has none."""
    quality_min: float
    """Least quality of a tetrahedron, 1 for a regular one and 0 for a flat one."""
    quality_median: float
    """Median of the qualities."""
    altitude: float
    """Smallest altitude of a tetrahedron [m]."""


class MeshReport(NamedTuple):
    """Contents of the file of a mesh."""

    format: str
    """Format of the file."""
    n_nodes: int
    """Number of nodes in the file."""
    cells: dict[str, int]
    """Number of cells of each type in the file."""
    scale: float
    """Metres in one unit of the file."""
    scale_is_guessed: bool
    """Whether that is a guess, by the extent of the body."""
    box: FloatArray
    """Lowest and highest corner of the body [m], shape (2, 3)."""
    remarks: tuple[str, ...]
    """Remarks: choices, repairs and doubts."""
    fault: str | None
    """Why the mesh is refused; None where it is not."""
    shape: MeshShape | None
    """Size and quality; None where the mesh is refused."""


def report_on_mesh(path: str | os.PathLike[str], scale: float | None = None) -> MeshReport:
    """Return what is in the file of a mesh, whether `read_mesh` takes it, and how good it is.

    Args:
        path: The file.
        scale: Metres in one unit of the file; None: guessed, by the extent of the body.

    Raises:
        MeshError: There is no such file, or no mesh is found in it.
        ValueError: The scale is not a positive number.
    """
    if scale is not None and not (math.isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale is {scale}; it must be finite and positive, 0.001 for millimetres")
    found = read_mesh_file(path)
    mesh = found.mesh
    nodes = np.unique(mesh.tetrahedra)
    used = mesh.positions[nodes[(nodes >= 0) & (nodes < len(mesh.positions))]]
    with np.errstate(over="ignore", invalid="ignore"):
        box = np.array([used.min(axis=0), used.max(axis=0)]) if len(used) else np.zeros((2, 3))
        extent = float((box[1] - box[0]).max())
        metres = (likely_unit(extent) or _UNITS[0]) if scale is None else scale
        box *= metres
    remarks, fault, shape = found.remarks, None, None
    try:
        result = examined(mesh._replace(positions=mesh.positions * metres))
    except MeshError as error:
        fault = str(error)
    else:
        remarks, shape = (*remarks, *result.warnings), _shape(result.mesh)
    return MeshReport(
        *(found.format, len(mesh.positions), dict(found.cells), metres, scale is None, box),
        *(remarks, fault, shape),
    )


def likely_unit(extent: float) -> float | None:
    """Return the unit [m] of a file that does not name one, by what is in it.

    Args:
        extent: Largest side of the box around the body, in that unit.

    Returns:
        The first of metres, millimetres and micrometres in which the body is of a size for surgery;
        None where it is in none of them.
    """
    low, high = USUAL_EXTENTS
    return next((unit for unit in _UNITS if low <= unit * extent <= high), None)


def _shape(mesh: TetrahedralMesh) -> MeshShape:
    """Measure a mesh that is sound."""
    volumes = signed_volumes(mesh.positions, mesh.tetrahedra)
    qualities = quality(mesh.positions, mesh.tetrahedra)
    edges = mesh.tetrahedra[:, [0, 1, 1, 2, 2, 3]].reshape(-1, 2)
    a, b, c = (mesh.positions[mesh.tetrahedra[:, _SIDES[:, k]]] for k in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=2)
    return MeshShape(
        n_nodes=len(mesh.positions),
        n_tetrahedra=len(mesh.tetrahedra),
        volume=float(volumes.sum()),
        n_pieces=components(len(mesh.positions), edges)[0],
        labels=_shares(mesh, volumes),
        quality_min=float(qualities.min()),
        quality_median=float(np.median(qualities)),
        altitude=float((3.0 * volumes / areas.max(axis=1)).min()),
    )


def _shares(mesh: TetrahedralMesh, volumes: FloatArray) -> tuple[LabelShare, ...]:
    """Return count and volume of each label."""
    if mesh.labels is None:
        return ()
    found, index = np.unique(mesh.labels, return_inverse=True)
    counts, sums = np.bincount(index), np.bincount(index, volumes)
    return tuple(
        LabelShare(label, mesh.label_names.get(label), int(n), float(volume))
        for label, n, volume in zip(found.tolist(), counts, sums, strict=True)
    )
