"""Gmsh files (`.msh`): 1.0, 2.0 to 2.2 and 4.1, text and binary.

Versions 1 and 2 have one record for each node and element; version 4.1 has them in blocks, one for
each entity of the geometry.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, as_floats, as_ints, count_in, shown
from tissue.io.cell_types import uniform_records
from tissue.io.gmsh_elements import Elements, element_type
from tissue.types import TetrahedralMesh

LARGEST_EXACT = 2**53
"""Whole numbers up to this are exact in double precision, in which text is read."""


def read_gmsh(data: bytes) -> TetrahedralMesh:
    """Read Gmsh 1.0, 2.0 to 2.2 and 4.1, text and binary; the mesh is not checked.

    Source: the Gmsh reference manual, "Gmsh file formats".

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    reader = ByteReader(data)
    first = reader.line_with_text()
    if first == "$NOD":
        return read_gmsh_1(reader)
    if first != "$MeshFormat":
        reader.fail(f"expected $MeshFormat or $NOD, found {shown(first)}: not a Gmsh file", 0)

    at = reader.at
    words = reader.line().split()
    if len(words) != 3 or words[1] not in ("0", "1"):
        reader.fail(f"expected version, file type (0 or 1), data size; found {words}", at)
    version, file_type, data_size = words
    if version not in ("2", "2.0", "2.1", "2.2", "4.1"):
        reader.fail(
            f"expected version 2.0 to 2.2 or 4.1, found {shown(version)}: save it as 4.1", at
        )
    if data_size != "8":
        reader.fail(f"expected data size 8, found {shown(data_size)}", at)
    byte_order = _byte_order(reader) if file_type == "1" else ""
    read = read_gmsh_4 if version == "4.1" else read_gmsh_2
    return read(reader, byte_order)


def _byte_order(reader: ByteReader) -> str:
    """Return "<" or ">": binary files hold the number 1 after the header."""
    at = reader.at
    one = bytes(reader.binary(4, "u1", "bytes that hold the number 1"))
    orders = {b"\x01\x00\x00\x00": "<", b"\x00\x00\x00\x01": ">"}
    if one not in orders:
        reader.fail(f"expected the number 1 in four bytes, found {one.hex(' ')}", at)
    return orders[one]


def read_gmsh_1(reader: ByteReader) -> TetrahedralMesh:
    """Read what follows the line "$NOD"."""
    tags, positions = _nodes_as_text(reader, rb"\$ENDNOD", "$ENDNOD")
    _enter(reader, rb"\$ELM", "$ELM")
    # A record is tag, type, physical region, elementary region, number of nodes, nodes.
    elements = _elements_as_text(reader, rb"\$ENDELM", "$ENDELM", n_before=5, at_size=4)
    return elements.mesh(tags, positions)


def read_gmsh_2(reader: ByteReader, byte_order: str) -> TetrahedralMesh:
    """Read what follows the header; `byte_order` is "<" or ">" in a binary file, else ""."""
    if b"$ParametricNodes" in reader.data:
        reader.fail(
            "expected $Nodes, found $ParametricNodes: save it without parametric coordinates"
        )
    _enter(reader, rb"\$Nodes", "$Nodes")
    if byte_order:
        tags, positions = _nodes_in_binary(reader, byte_order)
    else:
        tags, positions = _nodes_as_text(reader, rb"\$EndNodes", "$EndNodes")
    _enter(reader, rb"\$Elements", "$Elements")
    if byte_order:
        elements = _elements_in_binary(reader, byte_order)
    else:
        # A record is tag, type, number of further tags, those tags, nodes.
        elements = _elements_as_text(reader, rb"\$EndElements", "$EndElements", 3, at_size=2)
    return elements.mesh(tags, positions)


def _enter(reader: ByteReader, pattern: bytes, name: str) -> None:
    """Go to the line after the one that says `name`."""
    reader.at = reader.find(rb"(?m)^[ \t]*" + pattern + rb"[ \t]*\r?\n", name).end()


def _nodes_as_text(
    reader: ByteReader, pattern: bytes, end_name: str
) -> tuple[IntArray, FloatArray]:
    """Return tags, shape (n_nodes,), and positions, shape (n_nodes, 3)."""
    at = reader.at
    n_nodes = count_in(reader, reader.line_with_text(), "nodes", at)
    end = reader.find(pattern, end_name).start()
    numbers = reader.floats(end, "numbers (tag x y z for each node)")
    reader.expect(4 * n_nodes, len(numbers), "numbers (tag x y z for each node)", at)
    table = numbers.reshape(n_nodes, 4)
    with np.errstate(invalid="ignore"):
        tags = table[:, 0].astype(np.int64)
    wrong = np.flatnonzero(tags != table[:, 0])
    if wrong.size:
        reader.fail(f"expected a whole number as a node's tag, found {table[wrong[0], 0]:g}", at)
    return tags, table[:, 1:]


def _elements_as_text(
    reader: ByteReader, pattern: bytes, end_name: str, n_before: int, at_size: int
) -> Elements:
    """Read elements as records of whole numbers.

    Args:
        reader: At the line that says how many elements there are.
        pattern: Regular expression of the line that ends them.
        end_name: Name of that line in messages.
        n_before: How many numbers a record has before its part of variable length.
        at_size: Index in the record of the length of that part: the number of nodes (version 1),
            or of tags before the nodes (version 2).
    """
    at = reader.at
    n_elements = count_in(reader, reader.line_with_text(), "elements", at)
    end = reader.find(pattern, end_name).start()
    on_lines = reader.words_on_lines(end)
    flat = reader.ints(end, "whole numbers")
    reader.expect(n_elements, len(on_lines), "elements, one on each line", at)
    elements = Elements()
    start, n_read = 0, 0
    while n_read < n_elements:
        here = f"element {n_read + 1} of {n_elements}"
        if start + n_before > len(flat):
            reader.fail(f"expected {n_elements} elements, found {n_read}", at)
        number, size = int(flat[start + 1]), int(flat[start + at_size])
        cell_type = element_type(reader, number, at)
        n_tags = size if at_size == 2 else 0
        if n_tags < 0 or (at_size == 4 and size != cell_type.n_nodes):
            reader.fail(f"{here} ({cell_type.name}): its number of tags or nodes is {size}", at)
        stride = n_before + n_tags + cell_type.n_nodes
        records = uniform_records(flat, start, stride, [1, at_size], n_elements - n_read)
        if not len(records):
            reader.fail(f"expected {n_elements} elements, found {n_read} and a part of one", at)
        wrong = np.flatnonzero(on_lines[n_read : n_read + len(records)] != stride)
        if wrong.size:
            k = n_read + int(wrong[0])
            reader.fail(
                f"element {k + 1} of {n_elements} ({cell_type.name}): expected {stride} numbers on "
                f"its line, found {on_lines[k]}",
                at,
            )
        elements.add(number, records[:, 0], records[:, stride - cell_type.n_nodes :])
        start, n_read = start + records.size, n_read + len(records)
    if start != len(flat):
        reader.fail(f"expected {n_elements} elements, found {len(flat) - start} numbers more", at)
    return elements


def _nodes_in_binary(reader: ByteReader, byte_order: str) -> tuple[IntArray, FloatArray]:
    """Return tags, shape (n_nodes,), and positions, shape (n_nodes, 3)."""
    at = reader.at
    n_nodes = count_in(reader, reader.line(), "nodes", at)
    n_bytes = 4 + 3 * 8
    raw = reader.binary(n_nodes * n_bytes, "u1", "bytes of nodes").reshape(n_nodes, n_bytes)
    tags = np.ascontiguousarray(raw[:, :4]).view(byte_order + "i4")[:, 0]
    positions = np.ascontiguousarray(raw[:, 4:]).view(byte_order + "f8")
    _expect_end(reader, "$EndNodes")
    return as_ints(tags), as_floats(positions)


def _elements_in_binary(reader: ByteReader, byte_order: str) -> Elements:
    """Read elements in groups of one type, each with a header of three numbers."""
    at = reader.at
    n_elements = count_in(reader, reader.line(), "elements", at)
    elements = Elements()
    n_read = 0
    while n_read < n_elements:
        header = reader.binary(3, byte_order + "i4", "numbers before a group of elements")
        number, n_here, n_tags = (int(entry) for entry in header)
        cell_type = element_type(reader, number)
        if not 0 < n_here <= n_elements - n_read or n_tags < 0:
            reader.fail(
                f"expected at most {n_elements - n_read} elements more, found a group of {n_here} "
                f"with {n_tags} tags each"
            )
        stride = 1 + n_tags + cell_type.n_nodes
        flat = reader.binary(n_here * stride, byte_order + "i4", f"numbers of {cell_type.name}")
        records = as_ints(flat).reshape(n_here, stride)
        elements.add(number, records[:, 0], records[:, stride - cell_type.n_nodes :])
        n_read += n_here
    _expect_end(reader, "$EndElements")
    return elements


def _expect_end(reader: ByteReader, name: str) -> None:
    """Fail unless the next line is `name`: there is more than was counted."""
    at = reader.at
    line = reader.line_with_text()
    if line != name:
        reader.fail(f"expected {name}, found {shown(line)}: is the number before it right?", at)


def read_gmsh_4(reader: ByteReader, byte_order: str) -> TetrahedralMesh:
    """Read what follows the header; `byte_order` is "<" or ">" in a binary file, else ""."""
    tags, positions = _nodes(_section(reader, "Nodes", byte_order))
    elements = _elements(_section(reader, "Elements", byte_order))
    return elements.mesh(tags, positions)


class _Text:
    """The numbers of a section that is written as text, taken in their order."""

    def __init__(self, reader: ByteReader, name: str) -> None:
        self.reader = reader
        self._start = reader.at
        end = reader.find(rb"\$End" + name.encode(), f"$End{name}").start()
        self._numbers = reader.floats(end, "numbers")
        self._at = 0

    def floats(self, count: int, what: str) -> FloatArray:
        left = len(self._numbers) - self._at
        if count > left:
            self.reader.fail(f"expected {count} {what}, found {left} to the end", self._start)
        self._at += count
        return self._numbers[self._at - count : self._at]

    def sizes(self, count: int, what: str) -> IntArray:
        numbers = self.floats(count, what)
        whole = np.abs(numbers) <= LARGEST_EXACT  # false for NaN
        whole &= np.floor(numbers) == numbers
        if not whole.all():
            wrong = numbers[~whole][0]
            self.reader.fail(f"expected whole {what}, found {wrong:g}", self._start)
        return numbers.astype(np.int64)

    ints = sizes

    def end(self) -> None:
        left = len(self._numbers) - self._at
        if left:
            self.reader.fail(f"expected the end of the section, found {left} more", self._start)


class _Binary:
    """The same of a section that is written in binary: C's `int`, `size_t` and `double`."""

    def __init__(self, reader: ByteReader, name: str, byte_order: str) -> None:
        self.reader = reader
        self._name = name
        self._byte_order = byte_order

    def ints(self, count: int, what: str) -> IntArray:
        return as_ints(self.reader.binary(count, self._byte_order + "i4", what))

    def sizes(self, count: int, what: str) -> IntArray:
        return as_ints(self.reader.binary(count, self._byte_order + "u8", what))

    def floats(self, count: int, what: str) -> FloatArray:
        return as_floats(self.reader.binary(count, self._byte_order + "f8", what))

    def end(self) -> None:
        at = self.reader.at
        line = self.reader.line_with_text()
        if line != f"$End{self._name}":
            self.reader.fail(f"expected $End{self._name} after what was counted", at)


_Section = _Text | _Binary


def _section(reader: ByteReader, name: str, byte_order: str) -> _Section:
    """Return the numbers of a section."""
    reader.at = reader.find(rb"(?m)^[ \t]*\$%b[ \t]*\r?\n" % name.encode(), f"${name}").end()
    return _Binary(reader, name, byte_order) if byte_order else _Text(reader, name)


def _nodes(section: _Section) -> tuple[IntArray, FloatArray]:
    """Return tags, shape (n_nodes,), and positions, shape (n_nodes, 3)."""
    n_blocks, n_nodes, _, _ = section.sizes(4, "numbers before the nodes").tolist()
    tags, positions = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    for _ in range(n_blocks):
        dimension, _, is_parametric = section.ints(3, "numbers before a block of nodes").tolist()
        (n_here,) = _counts(section, 1, "nodes in a block")
        if is_parametric not in (0, 1) or not 0 <= dimension <= 3:
            section.reader.fail(
                "expected a block of nodes of dimension 0 to 3, parametric 0 or 1; found "
                f"{dimension} and {is_parametric}"
            )
        width = 3 + is_parametric * dimension  # parameters u, v, w may follow x, y, z
        tags.append(section.sizes(n_here, "tags of nodes"))
        coordinates = section.floats(n_here * width, "coordinates").reshape(n_here, width)
        positions.append(coordinates[:, :3])
    section.end()
    found = sum(len(block) for block in tags)
    if found != n_nodes:
        section.reader.fail(f"expected {n_nodes} nodes, found {found}")
    return np.concatenate(tags), np.concatenate(positions)


def _elements(section: _Section) -> Elements:
    """Read the blocks of elements."""
    n_blocks, n_elements, _, _ = section.sizes(4, "numbers before the elements").tolist()
    elements = Elements()
    found = 0
    for _ in range(n_blocks):
        dimension, _, number = section.ints(3, "numbers before a block of elements").tolist()
        (n_here,) = _counts(section, 1, "elements in a block")
        cell_type = element_type(section.reader, number)
        if dimension != cell_type.dimension:
            section.reader.fail(
                f"expected {cell_type.name} in a block of dimension {cell_type.dimension}, found "
                f"one of dimension {dimension}"
            )
        width = 1 + cell_type.n_nodes
        records = section.sizes(n_here * width, f"numbers of {cell_type.name}").reshape(
            n_here, width
        )
        elements.add(number, records[:, 0], records[:, 1:])
        found += n_here
    section.end()
    if found != n_elements:
        section.reader.fail(f"expected {n_elements} elements, found {found}")
    return elements


def _counts(section: _Section, count: int, what: str) -> list[int]:
    """Take `count` numbers of things, which cannot be negative."""
    counts: list[int] = section.sizes(count, what).tolist()
    if min(counts) < 0:
        section.reader.fail(f"expected the number of {what}, found {min(counts)}")
    return counts
