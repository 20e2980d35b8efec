"""The state of a body as a VTK unstructured grid (`.vtu`), for ParaView, meshio and `read_mesh`."""

import base64
import json
import os
import struct
import sys
from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import IntArray
from tissue.io.label_arrays import NAMES_FIELD
from tissue.io.whole_file import whole_file
from tissue.mesh.mesh_arrays import mesh_arrays
from tissue.mesh.pieces import piece_of_tetrahedra
from tissue.types import Deformation, Snapshot, TetrahedralMesh

VTK_TETRA = 10
"""VTK's number for a tetrahedron with four nodes."""

_Arrays = list[tuple[str, npt.NDArray[np.generic], str]]
"""Data of nodes or tetrahedra: a name, the values, and the type in the file."""

_TYPE_NAMES = {"f4": "Float32", "f8": "Float64", "i8": "Int64", "u1": "UInt8"}


def write_vtu(
    path: str | os.PathLike[str],
    snapshot: Snapshot,
    deformation: Deformation | None = None,
    labels: IntArray | None = None,
    label_names: Mapping[int, str] = MappingProxyType({}),
) -> None:
    """Write `snapshot` to `path`.

    The points are the current positions [m]; the point data are `rest_position` [m],
    `velocity` [m/s], `mass` [kg] and `fixed` (0 or 1); the cell data are `piece`, the connected
    piece that a tetrahedron is in, 0 for the largest. Numbers keep all their bits. The file
    appears under its name only when it is complete, so an interrupted write leaves the old one.

    Args:
        path: The file.
        snapshot: The body.
        deformation: Its stress and strain, which are cell data then, in single precision: `stress`
            [Pa] and `strain`, nine components row by row, and `von_mises` [Pa]. None: none is.
        labels: The label of each tetrahedron, shape (n_tets,), which is the cell data `label` then,
            as `read_mesh` takes it. None: those of the body, if any is not 0.
        label_names: Names of labels, which are the field data `label_names` then.

    Raises:
        MeshError: Positions or tetrahedra have another shape or hold no numbers; labels are no
            whole numbers from 0 on, one for each tetrahedron.
        ValueError: Stress and strain are of other tetrahedra.
        OSError: The file cannot be written.
    """
    if labels is None and snapshot.labels.any():
        labels = snapshot.labels
    mesh = mesh_arrays(
        TetrahedralMesh(snapshot.positions, snapshot.tetrahedra, labels, label_names)
    )
    snapshot = snapshot._replace(positions=mesh.positions, tetrahedra=mesh.tetrahedra)
    n_given = len(mesh.tetrahedra) if deformation is None else len(deformation.stress)
    if n_given != len(mesh.tetrahedra):
        raise ValueError(
            f"the stress is that of {n_given} tetrahedra, and the body has {len(mesh.tetrahedra)}"
        )
    points: _Arrays = [
        ("rest_position", snapshot.rest_positions, "f8"),
        ("velocity", snapshot.velocities, "f8"),
        ("mass", snapshot.masses, "f8"),
        ("fixed", snapshot.fixed, "u1"),
    ]
    cells: _Arrays = [("piece", piece_of_tetrahedra(snapshot), "i8"), *_labels(mesh)]
    if deformation is not None:
        cells.append(("stress", deformation.stress.reshape(-1, 9), "f4"))
        cells.append(("strain", deformation.strain.reshape(-1, 9), "f4"))
        cells.append(("von_mises", deformation.von_mises(), "f4"))
    _write(path, mesh, points, cells)


def write_mesh(path: str | os.PathLike[str], mesh: TetrahedralMesh) -> None:
    """Write a mesh to `path`, as `read_mesh` takes it.

    Labels are the cell data `label`, and their names the field data `label_names`. Numbers keep all
    their bits. The file appears under its name only when it is complete.

    Args:
        path: The file.
        mesh: The mesh.

    Raises:
        MeshError: Positions, tetrahedra or labels have another shape or hold no such numbers.
        OSError: The file cannot be written.
    """
    mesh = mesh_arrays(mesh)
    _write(path, mesh, [], _labels(mesh))


def _labels(mesh: TetrahedralMesh) -> _Arrays:
    """Return the labels of a mesh as cell data."""
    return [] if mesh.labels is None else [("label", mesh.labels, "i8")]


def _write(
    path: str | os.PathLike[str], mesh: TetrahedralMesh, points: _Arrays, cells: _Arrays
) -> None:
    """Write a mesh with the data of its nodes and of its tetrahedra."""
    with whole_file(path) as unfinished, unfinished.open("wb") as file:
        for line in _lines(mesh, points, cells):
            file.write(line.encode("ascii") + b"\n")


def _lines(mesh: TetrahedralMesh, points: _Arrays, cells: _Arrays) -> Iterator[str]:
    """Yield the lines of the file."""
    n_tets = len(mesh.tetrahedra)
    byte_order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    yield '<?xml version="1.0"?>'
    yield (
        f'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="{byte_order}" '
        'header_type="UInt64">'
    )
    yield "<UnstructuredGrid>"
    if mesh.labels is not None and mesh.label_names:
        yield "<FieldData>"
        yield from _data_array(NAMES_FIELD, _as_bytes(mesh.label_names), "u1", is_field=True)
        yield "</FieldData>"
    yield f'<Piece NumberOfPoints="{len(mesh.positions)}" NumberOfCells="{n_tets}">'
    yield "<Points>"
    yield from _data_array("Points", mesh.positions, "f8")
    yield "</Points>"
    yield "<Cells>"
    yield from _data_array("connectivity", mesh.tetrahedra.ravel(), "i8")
    yield from _data_array("offsets", 4 * np.arange(1, n_tets + 1), "i8")
    yield from _data_array("types", np.full(n_tets, VTK_TETRA), "u1")
    yield "</Cells>"
    for section, arrays in (("PointData", points), ("CellData", cells)):
        yield f"<{section}>"
        for name, values, dtype in arrays:
            yield from _data_array(name, values, dtype)
        yield f"</{section}>"
    yield "</Piece>"
    yield "</UnstructuredGrid>"
    yield "</VTKFile>"


def _as_bytes(names: Mapping[int, str]) -> npt.NDArray[np.uint8]:
    """Return names as the bytes of JSON: not each program that reads the format reads strings."""
    text = json.dumps({str(label): name for label, name in sorted(names.items())})
    return np.frombuffer(text.encode("ascii"), np.uint8)


def _data_array(
    name: str, values: npt.NDArray[np.generic], dtype: str, *, is_field: bool = False
) -> Iterator[str]:
    """Yield one array: its size in bytes, then its bytes, in base 64."""
    data = np.ascontiguousarray(values, dtype=dtype)
    components = f' NumberOfComponents="{data.shape[1]}"' if data.ndim == 2 else ""
    if is_field:
        components = f' NumberOfTuples="{len(data)}"'
    yield f'<DataArray type="{_TYPE_NAMES[dtype]}" Name="{name}"{components} format="binary">'
    yield base64.b64encode(struct.pack("=Q", data.nbytes) + data.tobytes()).decode("ascii")
    yield "</DataArray>"
