"""Gmsh files (`.msh`): 1.0, 2.0 to 2.2 and 4.1, text and binary.

Versions 1 and 2, with one record for each node and element, are read here. Labels are the physical
groups of the volumes.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, as_floats, as_ints, count_in, shown
from tissue.io.cell_types import uniform_records
from tissue.io.gmsh_4 import read_gmsh_4
from tissue.io.gmsh_elements import Elements, element_type
from tissue.io.gmsh_names import group_names
from tissue.io.mesh_file import MeshFile


def read_gmsh(data: bytes) -> MeshFile:
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


def read_gmsh_1(reader: ByteReader) -> MeshFile:
    """Read what follows the line "$NOD"."""
    tags, positions = _nodes_as_text(reader, rb"\$ENDNOD", "$ENDNOD")
    _enter(reader, rb"\$ELM", "$ELM")
    # A record is tag, type, physical region, elementary region, number of nodes, nodes.
    elements = _elements_as_text(reader, rb"\$ENDELM", "$ENDELM", n_before=5, at_size=4)
    return elements.file("Gmsh 1", tags, positions, {})


def read_gmsh_2(reader: ByteReader, byte_order: str) -> MeshFile:
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
    form = "binary" if byte_order else "text"
    return elements.file(f"Gmsh 2, {form}", tags, positions, group_names(reader))


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
    n_first = 2 if at_size == 4 else 3  # where the groups begin
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
        groups = np.zeros((len(records), 2), dtype=np.int64)
        n_groups = 2 if at_size == 4 else min(n_tags, 2)
        groups[:, :n_groups] = records[:, n_first : n_first + n_groups]
        elements.add(number, records[:, 0], groups, records[:, stride - cell_type.n_nodes :])
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
        groups = np.zeros((n_here, 2), dtype=np.int64)
        groups[:, : min(n_tags, 2)] = records[:, 1 : 1 + min(n_tags, 2)]
        elements.add(number, records[:, 0], groups, records[:, stride - cell_type.n_nodes :])
        n_read += n_here
    _expect_end(reader, "$EndElements")
    return elements


def _expect_end(reader: ByteReader, name: str) -> None:
    """Fail unless the next line is `name`: there is more than was counted."""
    at = reader.at
    line = reader.line_with_text()
    if line != name:
        reader.fail(f"expected {name}, found {shown(line)}: is the number before it right?", at)
