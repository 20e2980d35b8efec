"""Abaqus input files (`.inp`): nodes, solid elements and their sets.

Labels are the element sets that sections name, or all of the file where none does; they count from
1 in the order of the file, and 0 is for elements in no set.

Source: the Abaqus keywords reference guide.
"""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, shown
from tissue.io.cell_types import CellType, cell_type
from tissue.io.mesh_file import CellBlock, MeshFile, mesh_file
from tissue.mesh.mesh_arrays import MeshError

_KEYWORD = re.compile(rb"(?m)^[ \t]*\*(?!\*)[^\n]*")
_UNPRINTABLE = re.compile(r"[^ -~]")
_COMMENT = re.compile(rb"(?m)^[ \t]*\*\*[^\n]*$")
_SOLID = re.compile(r"(?:C|DC|AC|EC|FC|QC)3D([0-9]+)[A-Z]*")

_SHAPES = {
    **dict.fromkeys((4, 10), "tetrahedra"),
    **dict.fromkeys((5, 13), "pyramids"),
    **dict.fromkeys((6, 15), "wedges"),
    **dict.fromkeys((8, 20), "hexahedra"),
}
"""Shapes of solid elements by their number of nodes."""

_GENERATORS = ("NGEN", "NCOPY", "NFILL", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")
"""Keywords that make nodes and elements, or move them."""

_NO_GEOMETRY = re.compile(
    r"AMPLITUDE|ASSEMBLY|BOUNDARY|CLOAD|CONDUCTIVITY|CONTACT.*|COUPLING|DAMPING|DENSITY|DEPVAR"
    r"|DISTRIBUTING|DLOAD|DSLOAD|DYNAMIC|ELASTIC|EL (PRINT|FILE)|(ELEMENT |NODE )?OUTPUT|EQUATION"
    r"|EXPANSION|FRICTION|HEADING|HYPERELASTIC|INITIAL CONDITIONS|KINEMATIC|MATERIAL|MPC|NSET"
    r"|NODE (PRINT|FILE)|ORIENTATION|PLASTIC|PREPRINT|RESTART|.* SECTION|SPECIFIC HEAT|STATIC"
    r"|STEP|SURFACE.*|TIE|TIME POINTS|USER MATERIAL|VISCOELASTIC"
)
"""Keywords with lines of data that say nothing about the mesh."""


_Members = IntArray | range
"""Numbers of elements that are in a set."""


class _Section(NamedTuple):
    """A keyword with its options and the lines below it."""

    keyword: str
    options: dict[str, str]
    data: bytes
    line: int

    def reader(self) -> ByteReader:
        """Return a reader of the numbers, without the commas between them."""
        return ByteReader(_COMMENT.sub(b"", self.data).replace(b",", b" ").rstrip() + b"\n")

    @property
    def here(self) -> str:
        """Where it is, for messages."""
        return f"*{self.keyword} of line {self.line}"


def read_abaqus(data: bytes) -> MeshFile:
    """Read an Abaqus input file; the mesh is not checked.

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    model = _Model()
    for section in _sections(data):
        try:
            model.take(section)
        except MeshError as error:
            raise MeshError(f"{section.here}: {error}") from None
    return model.file()


def _sections(data: bytes) -> Iterator[_Section]:
    """Yield the keywords of a file in their order."""
    matches = list(_KEYWORD.finditer(data))
    if not matches:
        raise MeshError("expected keywords such as *NODE, found none: not an Abaqus file")
    line, counted = 1, 0
    for match, following in zip(matches, [*matches[1:], None], strict=True):
        line += data.count(b"\n", counted, match.start())
        counted = match.start()
        end = len(data) if following is None else following.start()
        text, start = match[0], match.end()
        while text.rstrip().endswith(b","):  # the keyword goes on in the next line
            stop = data.find(b"\n", start + 1)
            stop = end if stop < 0 else min(stop, end)
            if stop <= start:
                break
            text, start = text.rstrip() + data[start:stop], stop
        plain = _UNPRINTABLE.sub("?", text.decode("latin-1").strip())
        first, *words = (word.strip() for word in plain.split(","))
        options = {}
        for word in words:
            key, _, value = word.partition("=")
            options[key.strip().upper()] = value.strip().strip('"')
        yield _Section(" ".join(first[1:].upper().split()), options, data[start:end], line)


class _Model:
    """Parts that have been read so far."""

    def __init__(self) -> None:
        self._nodes: list[tuple[IntArray, FloatArray]] = []
        self._blocks: list[CellBlock] = []
        self._sets: dict[str, list[_Members]] = {}
        self._spelt: dict[str, str] = {}
        self._of_sections: list[str] = []
        self._n_parts = 0
        self._remarks: list[str] = []

    def take(self, section: _Section) -> None:
        """Read a keyword with its lines."""
        keyword, has_data = section.keyword, bool(_COMMENT.sub(b"", section.data).strip())
        if keyword == "NODE":
            self._take_nodes(section)
        elif keyword == "ELEMENT":
            self._take_elements(section)
        elif keyword == "ELSET" and "INTERNAL" not in section.options:
            self._take_set(section)
        elif keyword == "SOLID SECTION":
            self._of_sections.append(section.options.get("ELSET", "").upper())
        elif keyword == "INCLUDE":
            raise MeshError("a part of the model is in another file: put it into this one")
        elif keyword in _GENERATORS:
            raise MeshError("nodes or elements are made or moved by it: write the model out flat")
        elif keyword == "INSTANCE" and has_data:
            self._remarks.append("the place that *INSTANCE gives the part is left out")
        elif keyword == "PART":
            self._n_parts += 1
        elif has_data and keyword != "ELSET" and not _NO_GEOMETRY.fullmatch(keyword):
            self._remarks.append(f"{section.here} is not known: its lines are left out")

    def _take_nodes(self, section: _Section) -> None:
        reader = section.reader()
        on_lines = reader.words_on_lines(len(reader.data))
        wrong = np.flatnonzero(on_lines != 4)
        if wrong.size:
            reader.fail(
                f"expected a number and x, y, z for each node, found {on_lines[wrong[0]]} numbers "
                f"for the node {wrong[0] + 1} of them"
            )
        table = reader.floats(len(reader.data), "numbers").reshape(-1, 4)
        self._nodes.append((_whole(reader, table[:, 0]), table[:, 1:]))

    def _take_elements(self, section: _Section) -> None:
        reader, name = section.reader(), section.options.get("TYPE", "").upper()
        solid = _SOLID.fullmatch(name)
        on_lines = reader.words_on_lines(len(reader.data))
        flat = reader.ints(len(reader.data), "whole numbers")
        if solid is None:
            blocks = _of_lines(name, flat, on_lines)
        else:
            size = int(solid[1])
            if size not in _SHAPES:
                reader.fail(f"expected solid elements of 4 to 20 nodes, found TYPE={name}", 0)
            records = _records(reader, flat, on_lines, size + 1)
            blocks = [CellBlock(cell_type(_SHAPES[size], size), records[:, 1:], records[:, 0])]
        self._blocks += blocks
        if "ELSET" in section.options:
            self._add(section.options["ELSET"], [each.ids for each in blocks])

    def _take_set(self, section: _Section) -> None:
        reader, name = section.reader(), section.options.get("ELSET", "")
        members: list[_Members] = []
        if "GENERATE" in section.options:
            for line in reader.data.decode("latin-1").splitlines():
                if line.strip():
                    members.append(_generated(reader, line))
        else:
            words = reader.data.decode("latin-1").split()
            numbers = [word for word in words if word.isdecimal()]
            members.append(np.array([min(int(word), 2**62) for word in numbers], dtype=np.int64))
            for word in words:
                if not word.isdecimal():
                    if word.upper() not in self._sets:
                        self._remarks.append(f"{section.here} names {shown(word)}, which is no set")
                    members += self._sets.get(word.upper(), [])
        self._add(name, members)

    def _add(self, name: str, members: Sequence[_Members]) -> None:
        key = name.upper()
        self._spelt.setdefault(key, name)
        self._sets.setdefault(key, []).extend(members)

    def file(self) -> MeshFile:
        """Return the mesh of all that was read."""
        if not self._nodes:
            raise MeshError("expected *NODE, found none: not an Abaqus file with a mesh")
        tags = np.concatenate([tags for tags, _ in self._nodes])
        positions = np.concatenate([positions for _, positions in self._nodes])
        if self._n_parts > 1 and len(np.unique(tags)) < len(tags):
            raise MeshError(
                f"{self._n_parts} parts that number their nodes alike: write the model out flat, "
                "or one part"
            )
        ids = np.sort(np.concatenate([np.zeros(0, np.int64), *(b.ids for b in self._blocks)]))
        twice = np.flatnonzero(ids[1:] == ids[:-1])
        if twice.size:
            raise MeshError(f"element {ids[twice[0]]} occurs twice")
        names, blocks = self._labelled()
        return mesh_file(
            *("Abaqus", positions, blocks),
            tags=tags,
            label_names=names,
            remarks=self._remarks,
        )

    def _labelled(self) -> tuple[dict[int, str], list[CellBlock]]:
        """Return names of labels, and the elements with labels of the sets that they are in.

        Where an element is in several sets the smallest counts: others are of wider use.
        """
        keys = [key for key in self._of_sections if key in self._sets] or list(self._sets)
        volumes = [b for b in self._blocks if b.cell_type.fills]
        ids = np.concatenate([np.zeros(0, np.int64), *(b.ids for b in volumes)])
        inside = {key: _are_inside(ids, self._sets[key]) for key in keys}
        keys = [key for key in inside if inside[key].any()]
        number = {key: i for i, key in enumerate(keys, start=1)}
        labels, n_sets = np.zeros(len(ids), dtype=np.int64), np.zeros(len(ids), dtype=np.int64)
        for key in sorted(keys, key=lambda k: -int(inside[k].sum())):
            labels[inside[key]] = number[key]
            n_sets += inside[key]
        if (n_sets > 1).any():
            self._remarks.append(
                f"{int((n_sets > 1).sum())} elements are in several sets: the smallest is the label"
            )
        parts = iter(np.split(labels, np.cumsum([len(b.ids) for b in volumes])[:-1]))
        blocks = [b._replace(labels=next(parts)) if b.cell_type.fills else b for b in self._blocks]
        return {i: self._spelt[key] for key, i in number.items()}, blocks if keys else self._blocks


def _of_lines(name: str, flat: IntArray, on_lines: IntArray) -> list[CellBlock]:
    """Return elements of a type that is left out: one on each line."""
    starts, blocks = np.cumsum(on_lines) - on_lines, []
    for size in np.unique(on_lines).tolist():
        records = flat[starts[on_lines == size][:, None] + np.arange(size)]
        kind = CellType(f"elements of type {shown(name)}", 2, size - 1)
        blocks.append(CellBlock(kind, records[:, 1:], records[:, 0]))
    return blocks


def _records(reader: ByteReader, flat: IntArray, on_lines: IntArray, width: int) -> IntArray:
    """Return the records of elements, each of which begins a line and may go on in more."""
    ends = np.cumsum(on_lines)
    records_end = width * np.arange(1, 1 + len(flat) // width)
    if len(flat) % width or not np.isin(records_end, ends).all():
        reader.fail(f"expected {width} numbers for each element, found others", 0)
    if width - 1 in (4, 5, 6) and (on_lines != width).any():
        wrong = np.flatnonzero(on_lines != width)[0]
        reader.fail(f"expected {width} numbers on a line, found {on_lines[wrong]}", 0)
    return flat.reshape(-1, width)


def _generated(reader: ByteReader, line: str) -> range:
    """Return the elements from a first to a last one, by a step."""
    words = line.split()
    if not (2 <= len(words) <= 3 and all(word.isdecimal() for word in words)):
        reader.fail(f"expected first, last and step of a set, found {shown(line)}")
    first, last, step = (*map(int, words), 1)[:3]
    if step < 1:
        reader.fail(f"expected first, last and step of a set, found {shown(line)}")
    return range(first, last + 1, step)


def _are_inside(ids: IntArray, members: Sequence[_Members]) -> BoolArray:
    """Return whether each element is a member of a set, shape (n_elements,)."""
    inside = np.zeros(len(ids), dtype=bool)
    for each in members:
        if isinstance(each, range):
            last = min(each.stop, 2**62)
            inside |= (ids >= each.start) & (ids < last) & ((ids - each.start) % each.step == 0)
        else:
            inside |= np.isin(ids, each)
    return inside


def _whole(reader: ByteReader, numbers: FloatArray) -> IntArray:
    """Return numbers as whole ones."""
    wrong = ~((np.abs(numbers) < 2**53) & (np.floor(numbers) == numbers))
    if wrong.any():
        reader.fail(f"expected whole numbers, found {numbers[wrong][0]:g}", 0)
    return numbers.astype(np.int64)
