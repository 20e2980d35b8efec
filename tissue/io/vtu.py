"""VTK unstructured grids in XML (`.vtu`): the elements, and where their numbers are."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import as_floats, as_ints, shown
from tissue.io.vtk_cells import tetrahedra_of
from tissue.io.vtu_data import Encoding, decoded
from tissue.mesh.mesh_arrays import MeshError
from tissue.types import TetrahedralMesh

MAX_RATIO = 100
"""Bytes in memory per byte of the file at most. Grids, the meshes that compress best, have 8 with
zlib and 19 with LZMA. A file made to fill the memory has 1000 and more."""

MAX_BYTES = 2**31
"""Bytes in memory at most, as many as the largest file has."""

_NUMBER_BYTES = 8
"""Size of a number once it is read [bytes], whatever it is in the file."""

_APPENDED = re.compile(rb"<AppendedData\b[^>]*>\s*_")
_APPENDED_END = b"</AppendedData"


def read_vtu(data: bytes) -> TetrahedralMesh:
    """Read a `.vtu` file; the mesh is not checked.

    Source: "VTK XML file formats" in the VTK documentation.

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    xml, appended = _apart(data)
    root = _parsed(xml)
    del xml
    kind = root.get("type", "")
    if root.tag != "VTKFile" or kind != "UnstructuredGrid":
        only = "only a surface, no tetrahedra: " if kind == "PolyData" else ""
        raise MeshError(
            f"{only}expected VTKFile of type UnstructuredGrid, found {shown(root.tag)} of type "
            f"{shown(kind)}"
        )
    pieces = root.findall("UnstructuredGrid/Piece")
    if len(pieces) != 1:
        raise MeshError(f"expected one <Piece>, found {len(pieces)}: merge them into one grid")
    return _Piece(pieces[0], _encoding(root, appended), len(data)).mesh()


def _apart(data: bytes) -> tuple[bytes, bytes]:
    """Return the XML, and the appended data, which may be any bytes and is no valid XML."""
    start = _APPENDED.search(data)
    if start is None:
        return data, b""
    end = data.rfind(_APPENDED_END)
    if end < start.end():
        raise MeshError("expected </AppendedData>, found the end of the file; is it truncated?")
    return data[: start.end()] + data[end:], data[start.end() : end]


def _parsed(xml: bytes) -> ET.Element:
    """Return the root of the document."""
    if b"<!DOCTYPE" in xml or b"<!ENTITY" in xml:
        raise MeshError("expected VTK's XML, found a document type declaration")
    try:
        return ET.fromstring(xml.decode("utf-8"))  # in another encoding it could hide one
    except (ET.ParseError, LookupError, ValueError) as error:
        raise MeshError(f"expected VTK's XML, found what is not XML ({error})") from None


def _encoding(root: ET.Element, appended: bytes) -> Encoding:
    """Return how the file writes numbers."""
    orders = {"LittleEndian": "<", "BigEndian": ">"}
    byte_order = root.get("byte_order", "LittleEndian")
    header_types = {"UInt32": "u4", "UInt64": "u8"}
    header_type = root.get("header_type", "UInt32")
    if byte_order not in orders or header_type not in header_types:
        raise MeshError(
            "expected byte_order LittleEndian or BigEndian and header_type UInt32 or UInt64, found "
            f"{shown(byte_order)} and {shown(header_type)}"
        )
    element = root.find("AppendedData")
    is_raw = element is not None and element.get("encoding", "base64") == "raw"
    return Encoding(
        orders[byte_order], header_types[header_type], root.get("compressor", ""), appended, is_raw
    )


class _Piece:
    """The part of the file that holds the grid."""

    def __init__(self, element: ET.Element, encoding: Encoding, n_bytes: int) -> None:
        self._element = element
        self._encoding = encoding
        self._most = min(MAX_RATIO * n_bytes, MAX_BYTES) // _NUMBER_BYTES
        self._n_numbers = 0

    def mesh(self) -> TetrahedralMesh:
        n_nodes, n_cells = self._count("NumberOfPoints"), self._count("NumberOfCells")
        positions = self._floats("Points/DataArray", 3 * n_nodes).reshape(n_nodes, 3)
        ends = self._ints("Cells/DataArray[@Name='offsets']", n_cells)
        types = self._ints("Cells/DataArray[@Name='types']", n_cells)
        n_entries = int(ends[-1]) if n_cells else 0
        flat = self._ints("Cells/DataArray[@Name='connectivity']", n_entries)
        starts = np.concatenate([[0], ends])[:-1]
        return TetrahedralMesh(positions, tetrahedra_of(types, starts, ends - starts, flat))

    def _count(self, attribute: str) -> int:
        text = self._element.get(attribute, "")
        count = int(text) if re.fullmatch(r"\s*[0-9]{1,18}\s*", text) else -1
        if not 0 <= count <= self._most:
            raise MeshError(
                f"expected a {attribute} that a file of this size can hold, found {shown(text)}"
            )
        return count

    def _floats(self, path: str, count: int) -> FloatArray:
        return as_floats(self._decoded(path, count))

    def _ints(self, path: str, count: int) -> IntArray:
        values = self._decoded(path, count)
        if values.dtype.kind not in "iu":
            raise MeshError(f"expected whole numbers in {path}, found {values.dtype}")
        return as_ints(values)

    def _decoded(self, path: str, count: int) -> npt.NDArray[np.generic]:
        """Return the `count` numbers of an array, if there is room for them."""
        self._n_numbers += count
        if not 0 <= count <= self._n_numbers <= self._most:
            raise MeshError(
                f"{path}: {count} numbers, with those before {self._n_numbers}; expected at most "
                f"{self._most} from a file of this size. If it is a mesh, save it uncompressed"
            )
        return decoded(self._array(path), self._encoding, count, path)

    def _array(self, path: str) -> ET.Element:
        element = self._element.find(path)
        if element is None:
            raise MeshError(f"expected {path}, found none")
        return element
