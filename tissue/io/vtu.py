"""VTK unstructured grids in XML (`.vtu`) with numbers as text, in base 64 or appended.

Labels are cell data, by the names in `label_arrays`.
"""

import base64
import binascii
import json
import lzma
import re
import xml.etree.ElementTree as ET
import zlib
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, as_floats, as_ints, shown
from tissue.io.label_arrays import NAMES_FIELD
from tissue.io.mesh_file import MeshFile, mesh_file
from tissue.io.vtk_cells import cell_blocks, labels_among
from tissue.mesh.mesh_arrays import MeshError

MAX_RATIO = 100
"""Bytes in memory per byte of the file at most. Grids, the meshes that compress best, have 8 with
zlib and 19 with LZMA. A file made to fill the memory has 1000 and more."""

MAX_BYTES = 2**31
"""Bytes in memory at most, as many as the largest file has."""

_NUMBER_BYTES = 8
"""Size of a number once it is read [bytes], whatever it is in the file."""

_APPENDED = re.compile(rb"<AppendedData\b[^>]*>\s*_")

_APPENDED_END = b"</AppendedData"

_DTYPES = {
    "Int8": "i1",
    "Int16": "i2",
    "Int32": "i4",
    "Int64": "i8",
    "UInt8": "u1",
    "UInt16": "u2",
    "UInt32": "u4",
    "UInt64": "u8",
    "Float32": "f4",
    "Float64": "f8",
}
"""VTK's names of types."""

LZMA_MEMORY = 2**28
"""Memory that unpacking may take at most [bytes]; VTK's writers need a tenth of it."""


class Encoding(NamedTuple):
    """Form in which a file writes numbers."""

    byte_order: str
    """Order of bytes, "<" or ">"."""
    header_dtype: str
    """Type of the sizes that stand before the data."""
    compressor: str
    """VTK's name of the compressor, or ""."""
    appended: bytes
    """The bytes after the underscore in `<AppendedData>`."""
    appended_is_raw: bool
    """Whether the appended data is in binary, not in base 64."""


def read_vtu(data: bytes) -> MeshFile:
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
    names = root.find(f"UnstructuredGrid/FieldData/DataArray[@Name='{NAMES_FIELD}']")
    return _Piece(pieces[0], _encoding(root, appended), len(data)).file(names)


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

    def file(self, names: ET.Element | None) -> MeshFile:
        """Return the grid, with names of labels by an array of bytes, if there is one."""
        n_nodes, n_cells = self._count("NumberOfPoints"), self._count("NumberOfCells")
        positions = self._floats("Points/DataArray", 3 * n_nodes).reshape(n_nodes, 3)
        ends = self._ints("Cells/DataArray[@Name='offsets']", n_cells)
        types = self._ints("Cells/DataArray[@Name='types']", n_cells)
        n_entries = int(ends[-1]) if n_cells else 0
        flat = self._ints("Cells/DataArray[@Name='connectivity']", n_entries)
        starts = np.concatenate([[0], ends])[:-1]
        labels, said = self._labels(types)
        blocks = cell_blocks(types, starts, ends - starts, flat, labels)
        label_names = {} if names is None else self._names(names)
        return mesh_file("VTK XML", positions, blocks, label_names=label_names, remarks=said)

    def _names(self, array: ET.Element) -> dict[int, str]:
        """Return names of labels from the bytes of JSON."""
        values = self._numbers(array, self._count_in("NumberOfTuples", array), NAMES_FIELD)
        try:
            if values.dtype != np.uint8:
                raise ValueError(f"numbers of type {values.dtype}")
            given = json.loads(values.tobytes())
            return {int(label): name for label, name in given.items() if isinstance(name, str)}
        except (ValueError, AttributeError, RecursionError) as error:
            raise MeshError(
                f"expected names of labels in the field data {NAMES_FIELD}, as bytes of JSON, "
                f'{{"2": "fat"}}; found what is not ({error})'
            ) from None

    def _labels(self, types: IntArray) -> tuple[IntArray | None, list[str]]:
        """Return the labels among the cell data, and what is to be said of them."""
        arrays = {
            each.get("Name", ""): each
            for each in self._element.findall("CellData/DataArray")
            if each.get("NumberOfComponents", "1").strip() == "1"
        }
        return labels_among(
            types,
            list(arrays),
            lambda name: self._numbers(arrays[name], len(types), f"cell data '{name}'"),
        )

    def _count(self, attribute: str) -> int:
        return self._count_in(attribute, self._element)

    def _count_in(self, attribute: str, element: ET.Element) -> int:
        """Return the number in an attribute of an element: that of numbers in the file."""
        text = element.get(attribute, "")
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
        return self._numbers(self._array(path), count, path)

    def _numbers(self, array: ET.Element, count: int, name: str) -> npt.NDArray[np.generic]:
        """Return the `count` numbers of an array, if there is room for them."""
        self._n_numbers += count
        if not 0 <= count <= self._n_numbers <= self._most:
            raise MeshError(
                f"{name}: {count} numbers, with those before {self._n_numbers}; expected at most "
                f"{self._most} from a file of this size. If it is a mesh, save it uncompressed"
            )
        return decoded(array, self._encoding, count, name)

    def _array(self, path: str) -> ET.Element:
        element = self._element.find(path)
        if element is None:
            raise MeshError(f"expected {path}, found none")
        return element


def decoded(
    element: ET.Element, encoding: Encoding, count: int, name: str
) -> npt.NDArray[np.generic]:
    """Return the `count` numbers of a `<DataArray>`, which messages call `name`.

    Raises:
        MeshError: The array does not hold them.
    """
    dtype = _DTYPES.get(element.get("type", ""))
    if dtype is None:
        raise MeshError(f"{name}: expected a type, found {shown(element.get('type', ''))}")
    form = element.get("format", "ascii")
    try:
        if form == "ascii":
            return _from_text(element, dtype, count)
        if form == "binary":
            stream = _Stream(_in_base64(element.text), is_raw=False)
        elif form == "appended":
            stream = _Stream(_appended(element, encoding), encoding.appended_is_raw)
        else:
            raise MeshError(f"expected format ascii, binary or appended, found {shown(form)}")
        n_bytes = count * np.dtype(dtype).itemsize
        data = (
            _compressed(stream, encoding, n_bytes)
            if encoding.compressor
            else _plain(stream, encoding, n_bytes)
        )
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from None
    return np.frombuffer(data, encoding.byte_order + dtype)


def _from_text(element: ET.Element, dtype: str, count: int) -> npt.NDArray[np.generic]:
    """Return numbers written as text."""
    reader = ByteReader((element.text or "").encode())
    is_float = dtype.startswith("f")
    end = len(reader.data)
    values = reader.floats(end, "numbers") if is_float else reader.ints(end, "whole numbers")
    reader.expect(count, len(values), "numbers", 0)
    return values


def _in_base64(text: str | None) -> bytes:
    """Return the text without blanks."""
    return re.sub(rb"\s+", b"", (text or "").encode())


def _appended(element: ET.Element, encoding: Encoding) -> bytes:
    """Return the appended data from the array's offset on."""
    offset = element.get("offset", "")
    is_number = re.fullmatch(r"\s*[0-9]{1,18}\s*", offset)
    if not is_number or int(offset) > len(encoding.appended):
        raise MeshError(
            f"expected an offset into {len(encoding.appended)} bytes of appended data, found "
            f"{shown(offset)}"
        )
    return encoding.appended[int(offset) :]


class _Stream:
    """Bytes, plain or in base 64, taken from the front."""

    def __init__(self, data: bytes, is_raw: bool) -> None:
        self._data = data
        self._is_raw = is_raw
        self._at = 0

    def take(self, n_bytes: int) -> bytes:
        """Take some bytes; in base 64 a group of characters that stands for them alone."""
        length = n_bytes if self._is_raw else 4 * -(-n_bytes // 3)
        piece = self._data[self._at : self._at + length]
        if len(piece) < length:
            raise MeshError(f"expected {length} bytes of data, found {len(piece)}")
        self._at += length
        if self._is_raw:
            return piece
        try:
            plain = base64.b64decode(piece, validate=True)
        except binascii.Error as error:
            raise MeshError(f"expected base 64, found an error in it ({error})") from None
        if len(plain) < n_bytes:
            raise MeshError(f"expected {n_bytes} bytes in base 64, found {len(plain)}")
        return plain[:n_bytes]

    def take_with_header(self, n_header: int, n_bytes: int) -> bytes:
        """Take a header and then bytes, in base 64 either in one group or in two."""
        is_in_two = self._data[: 4 * -(-n_header // 3)].endswith(b"=")
        if self._is_raw or is_in_two:
            return self.take(n_header) + self.take(n_bytes)
        return self.take(n_header + n_bytes)

    def rewind(self) -> None:
        """Go back to the first byte."""
        self._at = 0


def _plain(stream: _Stream, encoding: Encoding, n_bytes: int) -> bytes:
    """Return bytes that are not compressed: before them stands how many there are."""
    header = np.dtype(encoding.byte_order + encoding.header_dtype)
    found = int(np.frombuffer(stream.take(header.itemsize), header)[0])
    if found != n_bytes:
        raise MeshError(f"expected {n_bytes} bytes of numbers, found {found}")
    stream.rewind()
    return stream.take_with_header(header.itemsize, n_bytes)[header.itemsize :]


def _compressed(stream: _Stream, encoding: Encoding, n_bytes: int) -> bytes:
    """Return bytes compressed in blocks.

    Before them stand the number of blocks, the size of a block, that of the last one (0: it is as
    large as the others), and the size that each has when compressed.
    """
    header = np.dtype(encoding.byte_order + encoding.header_dtype)
    n_blocks, size, last = np.frombuffer(stream.take(3 * header.itemsize), header).tolist()
    stream.rewind()
    sizes = np.frombuffer(stream.take((3 + n_blocks) * header.itemsize), header)[3:].tolist()
    plain_sizes = [size] * n_blocks
    if last and n_blocks:
        plain_sizes[-1] = last
    if sum(plain_sizes) != n_bytes:
        raise MeshError(f"expected {n_bytes} bytes of numbers, found {sum(plain_sizes)}")
    packed = stream.take(sum(sizes))
    blocks, at = [], 0
    for packed_size, plain_size in zip(sizes, plain_sizes, strict=True):
        blocks.append(_unpacked(packed[at : at + packed_size], plain_size, encoding.compressor))
        at += packed_size
    return b"".join(blocks)


def _unpacked(packed: bytes, size: int, compressor: str) -> bytes:
    """Return the `size` bytes of one block; one more is unpacked at most, whatever it holds."""
    unpacker: Any
    try:
        if compressor == "vtkZLibDataCompressor":
            unpacker = zlib.decompressobj()
        elif compressor == "vtkLZMADataCompressor":
            unpacker = lzma.LZMADecompressor(memlimit=LZMA_MEMORY)
        else:
            raise MeshError(
                "expected vtkZLibDataCompressor or vtkLZMADataCompressor, found "
                f"{shown(compressor)}: save it with zlib or uncompressed"
            )
        plain: bytes = unpacker.decompress(packed, size + 1)
    except (zlib.error, lzma.LZMAError, EOFError) as error:
        raise MeshError(f"expected compressed data, found an error in it ({error})") from None
    if len(plain) != size:
        found = f"{len(plain)}" if len(plain) < size else "more"
        raise MeshError(f"expected {size} bytes in a compressed block, found {found}")
    if not unpacker.eof:  # the checksum is at the end
        raise MeshError("expected a whole compressed block, found one without its end")
    return plain
