"""TetGen's files: nodes in `.node`, tetrahedra in `.ele` of the same name.

Labels are the last attribute of the tetrahedra, in which TetGen writes the region (switch -A).

Source: H. Si, "TetGen, user's manual", section 5, "File formats".
"""

import re

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, count_in
from tissue.io.cell_types import cell_type
from tissue.io.label_arrays import as_labels
from tissue.io.mesh_file import CellBlock, MeshFile, mesh_file
from tissue.mesh.mesh_arrays import MeshError

_COMMENT = re.compile(rb"#[^\n]*")
_NODES_OF = (4, 10)
"""Nodes that a tetrahedron can have."""


def read_tetgen(nodes: bytes, elements: bytes) -> MeshFile:
    """Read the content of a `.node` and of an `.ele` file; the mesh is not checked.

    Raises:
        MeshError: The bytes are not such files, or they hold no tetrahedra.
    """
    try:
        tags, positions = _nodes(ByteReader(_COMMENT.sub(b"", nodes)))
    except MeshError as error:
        raise MeshError(f"nodes (.node): {error}") from None
    try:
        block, remarks = _elements(ByteReader(_COMMENT.sub(b"", elements)), tags[:1])
    except MeshError as error:
        raise MeshError(f"tetrahedra (.ele): {error}") from None
    return mesh_file("TetGen", positions, [block], tags=tags, remarks=remarks)


def _nodes(reader: ByteReader) -> tuple[IntArray, FloatArray]:
    """Return tags and positions."""
    n_nodes, dimension, n_attributes, n_markers = _header(reader, 4, "nodes", [0, 3, 0, 0])
    if dimension != 3:
        reader.fail(f"expected 3 dimensions, found {dimension}", 0)
    table = _table(reader, n_nodes, 4 + n_attributes + n_markers, "nodes")
    return _numbered(reader, table, "node"), table[:, 1:4]


def _elements(reader: ByteReader, first: IntArray) -> tuple[CellBlock, list[str]]:
    """Return the tetrahedra, of which the first has the number `first`, and what is to be said."""
    n_tets, size, n_attributes = _header(reader, 3, "tetrahedra", [0, 4, 0])
    if size not in _NODES_OF:
        reader.fail(f"expected tetrahedra of 4 or 10 nodes, found {size}", 0)
    table = _table(reader, n_tets, 1 + size + n_attributes, "tetrahedra")
    ids = _numbered(reader, table, "tetrahedron")
    nodes = table[:, 1 : 1 + size]
    if not (np.floor(nodes) == nodes).all() or (np.abs(nodes) >= 2**53).any():
        reader.fail("expected whole numbers of nodes")
    labels, remarks = None, []
    if n_attributes:
        labels = as_labels(table[:, -1])
        if labels is None:
            remarks.append("the attributes are no labels, which are whole numbers: left out")
        elif n_attributes > 1:
            remarks.append(f"labels are the last of {n_attributes} attributes")
    if n_tets and first.size and ids[0] != first[0]:
        reader.fail(f"expected numbers from {first[0]} on, as those of the nodes, found {ids[0]}")
    return CellBlock(cell_type("tetrahedra", size), nodes.astype(np.int64), ids, labels), remarks


def _header(reader: ByteReader, n: int, what: str, usual: list[int]) -> list[int]:
    """Return the counts of the first line; those that are left out are the usual ones."""
    at = reader.at
    words = reader.line_with_text().split()
    if not 1 <= len(words) <= n:
        reader.fail(f"expected {n} numbers before the {what}, found {len(words)}", at)
    return [count_in(reader, word, what, at) for word in words] + usual[len(words) :]


def _table(reader: ByteReader, n_rows: int, width: int, what: str) -> FloatArray:
    """Return all numbers, one line for each row."""
    at = reader.at
    on_lines = reader.words_on_lines(len(reader.data))
    reader.expect(n_rows, len(on_lines), f"{what}, one on each line", at)
    wrong = np.flatnonzero(on_lines != width)
    if wrong.size:
        reader.fail(
            f"expected {width} numbers on the line of each of the {what}, found "
            f"{on_lines[wrong[0]]} on that of number {wrong[0]} of them",
            at,
        )
    return reader.floats(len(reader.data), "numbers").reshape(n_rows, width)


def _numbered(reader: ByteReader, table: FloatArray, what: str) -> IntArray:
    """Return the numbers of rows, which count from 0 or 1."""
    if not len(table):
        return np.zeros(0, dtype=np.int64)
    first = table[0, 0]
    if first not in (0.0, 1.0):
        reader.fail(f"expected the first {what} to have the number 0 or 1, found {first:g}")
    numbers = int(first) + np.arange(len(table))
    wrong = np.flatnonzero(table[:, 0] != numbers)
    if wrong.size:
        reader.fail(
            f"expected the number {numbers[wrong[0]]} of a {what}, found {table[wrong[0], 0]:g}"
        )
    return numbers
