"""Medit files (`.mesh` as text, `.meshb` in binary), as TetWild, CGAL, MMG and GAMMA's tools write.

Labels are the references of the cells.

Source: the GMF library of INRIA (libMeshb), "Gamma Mesh Format".
"""

import re

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, as_floats, as_ints, count_in, shown
from tissue.io.cell_types import CellType, cell_type
from tissue.io.mesh_file import CellBlock, MeshFile, mesh_file

_CELLS: dict[str, tuple[int, CellType]] = {
    "Edges": (5, cell_type("lines", 2)),
    "Triangles": (6, cell_type("triangles", 3)),
    "Quadrilaterals": (7, cell_type("quadrangles", 4)),
    "Tetrahedra": (8, cell_type("tetrahedra", 4)),
    "Prisms": (9, cell_type("prisms", 6)),
    "Hexahedra": (10, cell_type("hexahedra", 8)),
    "EdgesP2": (25, cell_type("lines", 3)),
    "TrianglesP2": (24, cell_type("triangles", 6)),
    "TetrahedraP2": (30, cell_type("tetrahedra", 10)),
    "Pyramids": (49, cell_type("pyramids", 5)),
}
"""Sections of cells: number in binary files, and type."""

_DIMENSION, _VERTICES, _END = 3, 4, 54
"""Numbers of other sections in binary files."""

_NUMBERS_OF = {
    **dict.fromkeys(("Corners", "RequiredVertices", "Ridges", "RequiredEdges"), 1),
    **dict.fromkeys(("RequiredTriangles", "RequiredQuadrilaterals", "RequiredTetrahedra"), 1),
    **dict.fromkeys(("NormalAtVertices", "TangentAtVertices", "TangentAtEdges"), 2),
    **dict.fromkeys(("Normals", "Tangents"), 3),
}
"""Sections that do not matter here, and how many numbers each entry of them has."""

_COMMENT = re.compile(rb"#[^\n]*")
_KEYWORD = re.compile(rb"[A-Za-z]\w*")
_MOST_VERSIONS = 4


def read_medit(data: bytes) -> MeshFile:
    """Read a Medit file, text or binary; the mesh is not checked.

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    if data[:4] in (b"\x01\x00\x00\x00", b"\x00\x00\x00\x01"):
        return _Binary(data).file()
    return _read_text(data)


def _read_text(data: bytes) -> MeshFile:
    reader = ByteReader(_COMMENT.sub(b"", data))  # lines stay where they are
    positions, blocks, remarks = None, [], []
    first, has_end = _keyword(reader), False
    if first != "MeshVersionFormatted":
        reader.fail(f"expected MeshVersionFormatted, found {shown(first)}: not a Medit file", 0)
    _numbers(reader, 1, "version")
    while keyword := _keyword(reader):
        at = reader.at
        if keyword == "End":
            has_end = True
            break
        if keyword == "Dimension":
            (dimension,) = _whole(reader, _numbers(reader, 1, "dimension"), at).tolist()
            _expect_dimension(reader, dimension, at)
            continue
        if keyword == "Vertices":
            if positions is not None:
                reader.fail("expected one section of Vertices, found a second", at)
            positions = _numbers(reader, 4, "numbers (x y z reference)", True).reshape(-1, 4)[:, :3]
        elif keyword in _CELLS:
            kind = _CELLS[keyword][1]
            numbers = _whole(reader, _numbers(reader, kind.n_nodes + 1, "numbers", True), at)
            blocks.append(_block(kind, numbers.reshape(-1, kind.n_nodes + 1)))
        elif keyword in _NUMBERS_OF:
            _numbers(reader, _NUMBERS_OF[keyword], "numbers", True)
        else:
            reader.at = _next_keyword(reader)
            remarks.append(f"the section {shown(keyword)} is left out")
    if positions is None:
        reader.fail("expected a section Vertices, found none; is the file truncated?")
    if not has_end:
        remarks.append("the file ends without the word End")
    return mesh_file("Medit, text", positions, blocks, remarks=remarks)


def _keyword(reader: ByteReader) -> str:
    """Read the next word, which must be one of letters; "" at the end of the file."""
    reader.skip_blanks()
    match = _KEYWORD.match(reader.data, reader.at)
    if match is None:
        if reader.at < len(reader.data):
            word = reader.data[reader.at : reader.at + 50].split()[0]
            reader.fail(f"expected the name of a section, found {shown(word)}")
        return ""
    reader.at = match.end()
    return match[0].decode()


def _next_keyword(reader: ByteReader) -> int:
    """Return where the next word begins that is no number."""
    match = re.compile(rb"(?<![\w.+-])[A-Za-z]").search(reader.data, reader.at)
    return match.start() if match else len(reader.data)


def _numbers(reader: ByteReader, width: int, what: str, is_counted: bool = False) -> FloatArray:
    """Take the numbers up to the next section: of one entry, or of as many as is said before."""
    count, at = 1, reader.at
    if is_counted:
        end = reader.after_words(1, "number of entries")
        count = count_in(reader, reader.data[reader.at : end].decode("latin-1").strip(), "entries")
        reader.at = end
    numbers = reader.floats(_next_keyword(reader), what)
    reader.expect(count * width, len(numbers), what, at)
    return numbers


def _whole(reader: ByteReader, numbers: FloatArray, at: int) -> IntArray:
    """Return numbers as whole ones, or fail at byte `at`."""
    wrong = ~((np.abs(numbers) < 2**53) & (np.floor(numbers) == numbers))
    if wrong.any():
        reader.fail(f"expected whole numbers, found {numbers[wrong][0]:g}", at)
    return numbers.astype(np.int64)


def _expect_dimension(reader: ByteReader, dimension: int, at: int) -> None:
    """Refuse a mesh in the plane."""
    if dimension != 3:
        reader.fail(f"expected dimension 3, found {dimension}", at)


def _block(kind: CellType, rows: IntArray) -> CellBlock:
    """Return cells from rows of nodes, from 1 on, and a reference."""
    labels = rows[:, -1] if kind.fills else None
    return CellBlock(kind, rows[:, :-1] - 1, np.arange(1, len(rows) + 1), labels)


class _Binary:
    """A binary file: sections, each with its number and the place of the next."""

    def __init__(self, data: bytes) -> None:
        self._reader = ByteReader(data)
        self._order = "<" if data[:1] == b"\x01" else ">"
        self._reader.at = 4
        self._version = self._int("i4")
        if not 1 <= self._version <= _MOST_VERSIONS:
            self._reader.fail(
                f"expected version 1 to {_MOST_VERSIONS} of a binary Medit file, found "
                f"{self._version}"
            )
        self._place = "i4" if self._version < 3 else "i8"
        self._whole = "i4" if self._version < _MOST_VERSIONS else "i8"
        self._real = "f4" if self._version == 1 else "f8"

    def file(self) -> MeshFile:
        reader, positions, blocks, remarks = self._reader, None, [], []
        kinds = dict(_CELLS.values())
        while True:
            at = reader.at
            number = self._int("i4")
            if number == _END:
                break
            place = self._int(self._place)
            if not at < place <= len(reader.data):
                reader.fail(f"expected the place of the next section, found {place}", at)
            if number == _DIMENSION:
                _expect_dimension(reader, self._int("i4"), at)
            elif number == _VERTICES:
                positions = as_floats(self._rows([("p", self._real, 3), ("r", self._whole)])["p"])
            elif number in kinds:
                kind = kinds[number]
                rows = self._rows([("n", self._whole, kind.n_nodes + 1)])["n"]
                blocks.append(_block(kind, as_ints(rows)))
            else:
                remarks.append(f"section {number} is left out")
                reader.at = place
            if reader.at != place:
                reader.fail(f"expected the next section at byte {place}, found {reader.at}", at)
        if positions is None:
            reader.fail("expected a section of vertices, found none")
        return mesh_file("Medit, binary", positions, blocks, remarks=remarks)

    def _int(self, dtype: str) -> int:
        return int(as_ints(self._reader.binary(1, self._order + dtype, "bytes of a section"))[0])

    def _rows(self, fields: list[tuple[str, str] | tuple[str, str, int]]) -> np.ndarray:
        count = self._int(self._whole)
        dtype = np.dtype([(f[0], self._order + f[1], *f[2:]) for f in fields])
        raw = self._reader.binary(count * dtype.itemsize, "u1", "bytes of entries")
        return raw.view(dtype)
