"""Gmsh 4.1: nodes and elements in blocks, one for each entity of the geometry."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, as_floats, as_ints
from tissue.io.gmsh_elements import Elements, element_type
from tissue.io.gmsh_names import group_names
from tissue.io.mesh_file import MeshFile

LARGEST_EXACT = 2**53
"""Whole numbers up to this are exact in double precision, in which text is read."""

_PLACE = {0: 3}
"""Numbers that say where an entity is: those of a point, else the corners of a box, 6."""


def read_gmsh_4(reader: ByteReader, byte_order: str) -> MeshFile:
    """Read what follows the header; `byte_order` is "<" or ">" in a binary file, else ""."""
    names, groups, remarks = group_names(reader), {}, []
    if b"$PartitionedEntities" in reader.data:
        remarks.append("the mesh is in partitions: its physical groups are left out")
    elif b"$Entities" in reader.data:
        groups = _groups_of_volumes(_section(reader, "Entities", byte_order), remarks)
    tags, positions = _nodes(_section(reader, "Nodes", byte_order))
    elements = _elements(_section(reader, "Elements", byte_order), groups)
    form = "binary" if byte_order else "text"
    return elements.file(f"Gmsh 4.1, {form}", tags, positions, names, tuple(remarks))


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


def _groups_of_volumes(section: _Section, remarks: list[str]) -> dict[int, int]:
    """Return the physical group of each volume of the geometry that is in one.

    A number of what bounds an entity, and of groups, can be negative, for its direction.
    """
    n_of = _counts(section, 4, "points, curves, surfaces and volumes")
    found = {}
    for dimension, n_entities in enumerate(n_of):
        for _ in range(n_entities):
            (tag,) = section.ints(1, "tag of an entity").tolist()
            section.floats(_PLACE.get(dimension, 6), "coordinates of an entity")
            (n_groups,) = _counts(section, 1, "groups of an entity")
            groups = section.ints(n_groups, "groups of an entity").tolist()
            if dimension > 0:
                (n_bounds,) = _counts(section, 1, "bounds of an entity")
                section.ints(n_bounds, "bounds of an entity")
            if dimension == 3 and groups:
                found[tag] = abs(groups[0])
                if len(groups) > 1:
                    remarks.append(
                        f"volume {tag} is in the physical groups {groups}: the first is its label"
                    )
    section.end()
    return found


def _elements(section: _Section, groups: dict[int, int]) -> Elements:
    """Read the blocks of elements; `groups` has the physical group of each volume."""
    n_blocks, n_elements, _, _ = section.sizes(4, "numbers before the elements").tolist()
    elements = Elements()
    found = 0
    for _ in range(n_blocks):
        dimension, entity, number = section.ints(3, "numbers before a block of elements").tolist()
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
        group = groups.get(entity, 0) if dimension == 3 else 0
        in_groups = np.full((n_here, 2), (group, entity))
        elements.add(number, records[:, 0], in_groups, records[:, 1:])
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
