"""Nastran bulk data (`.bdf`, `.nas`): grid points and solid elements in free, small, large fields.

Labels are the numbers of the properties (PSOLID) that the elements name.

Source: the MSC Nastran quick reference guide, "Bulk data entries".
"""

import re
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple, NoReturn

import numpy as np

from tissue.io.byte_reader import shown
from tissue.io.cell_types import CellType, cell_type
from tissue.io.mesh_file import CellBlock, MeshFile, mesh_file
from tissue.mesh.mesh_arrays import MeshError

_SOLIDS = {
    "CTETRA": ("tetrahedra", 4, 10),
    "CPYRAM": ("pyramids", 5, 13),
    "CPYRA": ("pyramids", 5, 13),
    "CPENTA": ("wedges", 6, 15),
    "CHEXA": ("hexahedra", 8, 20),
}
"""Shape of solid elements, number of corners, and of nodes at most."""

_SIDES = {"CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 6, "CQUAD4": 4, "CQUADR": 4, "CQUAD8": 8}
"""Number of nodes of shells at most."""

_NO_SOLIDS = re.compile(
    r"(?:C(?:BAR|BEAM|ROD|ONROD|BUSH|ELAS[1-4]|DAMP[1-4]|TUBE|GAP|ONM[12]|MASS[1-4]|ORD\w*)"
    r"|(?:P|MAT|SPC|MPC|LOAD|FORCE|MOMENT|RBE|SET|EIG|TEMP|GRAV|SUPORT|TABLE|NL|TSTEP|DLOAD|RLOAD"
    r"|TLOAD|ASET|BC|DMIG|FREQ|RFORCE|ACCEL|DAREA|BEGIN|SOL|CEND|TITLE|SUBCASE|ECHO|DISP|STRESS)\w*)"
)
"""Cards without a volume."""

_EXPONENT = re.compile(r"([0-9.])([+-][0-9]+)$")
_FIELDS_OF_LARGE = 4
_FIELDS_OF_SMALL = 8
_LARGEST_ID = 2**31 - 1


class _Card(NamedTuple):
    """An entry of bulk data: its name, its fields, and the line it begins on."""

    name: str
    fields: list[str]
    line: int

    def fail(self, message: str) -> NoReturn:
        """Raise an error that names the card."""
        raise MeshError(f"line {self.line}: {self.name}: {message}")

    def whole(self, k: int, what: str) -> int:
        """Return a field that is a positive whole number."""
        text = self.fields[k] if k < len(self.fields) else ""
        if not (text.isdecimal() and 0 < int(text) <= _LARGEST_ID):
            self.fail(f"expected {what}, found {shown(text)}")
        return int(text)

    def real(self, k: int) -> float:
        """Return a field that is a number, 0 where it is blank, whose exponent may have no E."""
        text = self.fields[k] if k < len(self.fields) else ""
        try:
            return float(_EXPONENT.sub(r"\1e\2", text.upper().replace("D", "E")) or 0.0)
        except ValueError:
            self.fail(f"expected a coordinate, found {shown(text)}")


def read_nastran(data: bytes) -> MeshFile:
    """Read Nastran bulk data; the mesh is not checked.

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    nodes: dict[int, tuple[float, float, float]] = {}
    rows: dict[CellType, list[list[int]]] = {}
    left_out: Counter[str] = Counter()
    has_end = False
    for card in _cards(data):
        if card.name == "GRID":
            _add_node(card, nodes)
        elif card.name in _SOLIDS:
            kind, row = _solid(card)
            rows.setdefault(kind, []).append(row)
        elif card.name in _SIDES:
            kind, row = _shell(card)
            rows.setdefault(kind, []).append(row)
        elif card.name in ("INCLUDE", "GRDSET"):
            card.fail("it is not read: put all nodes and elements into this file, each in full")
        elif card.name == "ENDDATA":
            has_end = True
            break
        elif not _NO_SOLIDS.fullmatch(card.name):
            left_out[card.name] += 1
    if not nodes:
        raise MeshError("expected GRID entries, found none: not a Nastran file with a mesh")
    remarks = [f"{n} entries {shown(name)} are not known: left out" for name, n in left_out.items()]
    if not has_end:
        remarks.append("the file ends without ENDDATA")
    blocks = [_block(kind, np.array(found)) for kind, found in rows.items()]
    _expect_unique(blocks)
    return mesh_file(
        "Nastran",
        np.array(list(nodes.values())),
        blocks,
        tags=np.array(list(nodes)),
        remarks=remarks,
    )


def _cards(data: bytes) -> Iterator[_Card]:
    """Yield the entries of the bulk data, with their continuations."""
    lines = data.decode("latin-1").splitlines()
    begin = next((i for i, s in enumerate(lines) if s.upper().split()[:2] == ["BEGIN", "BULK"]), -1)
    card: _Card | None = None
    for number, line in enumerate(lines[begin + 1 :], start=begin + 2):
        text = line.split("$")[0].rstrip()
        if not text:
            continue
        name, fields = _fields(text)
        if card is not None and (not name or name[0] in "+*"):
            card.fields.extend(fields)
            continue
        if card is not None:
            yield card
        card = _Card(name.rstrip("*_").upper(), fields, number)  # meshio writes CTETRA_
    if card is not None:
        yield card


def _fields(text: str) -> tuple[str, list[str]]:
    """Return the first field of a line, and as many fields of data as a line has."""
    if "," in text:
        name, *fields = (word.strip() for word in text.split(","))
        n = _FIELDS_OF_LARGE if "*" in name else _FIELDS_OF_SMALL
    else:
        text = text.expandtabs(8)
        name, rest = text[:8].strip(), text[8:]
        n, width = (_FIELDS_OF_LARGE, 16) if "*" in name else (_FIELDS_OF_SMALL, 8)
        fields = [rest[k * width : (k + 1) * width].strip() for k in range(n)]
    return name, (fields + [""] * n)[:n]


def _add_node(card: _Card, nodes: dict[int, tuple[float, float, float]]) -> None:
    """Add a grid point."""
    node = card.whole(0, "the number of a node")
    if card.fields[1] not in ("", "0"):
        card.fail(
            f"coordinates in the system {shown(card.fields[1])}: save them in the basic system"
        )
    if any(card.fields[_FIELDS_OF_SMALL:]):
        card.fail(f"expected at most {_FIELDS_OF_SMALL} fields, found more")
    if node in nodes:
        card.fail(f"node {node} occurs twice")
    nodes[node] = (card.real(2), card.real(3), card.real(4))


def _solid(card: _Card) -> tuple[CellType, list[int]]:
    """Return type, and number, property and nodes of a solid element."""
    shape, n_corners, most = _SOLIDS[card.name]
    label = card.whole(1, "the number of a property") if card.fields[1] else 0
    n_nodes = most if any(card.fields[2 + n_corners :]) else n_corners
    if any(card.fields[2 + n_nodes :]):
        card.fail(f"expected {n_corners} or {most} nodes, found more")
    nodes = [card.whole(2 + k, f"a node, {n_nodes} in all,") for k in range(n_nodes)]
    return cell_type(shape, n_nodes), [card.whole(0, "the number of an element"), label, *nodes]


def _shell(card: _Card) -> tuple[CellType, list[int]]:
    """Return type, and number, property and nodes of a shell, which is left out."""
    n, most = 0, _SIDES[card.name]
    while n < most and 2 + n < len(card.fields) and card.fields[2 + n]:
        n += 1
    nodes = [card.whole(2 + k, "a node") for k in range(n)]
    kind = CellType(f"{card.name} of {n} nodes", 2, n)
    return kind, [card.whole(0, "the number of an element"), 0, *nodes]


def _block(kind: CellType, rows: np.ndarray) -> CellBlock:
    """Return elements from rows of number, property and nodes."""
    return CellBlock(kind, rows[:, 2:], rows[:, 0], rows[:, 1] if kind.fills else None)


def _expect_unique(blocks: list[CellBlock]) -> None:
    """Refuse a file in which two elements have one number."""
    ids = np.sort(np.concatenate([np.zeros(0, np.int64), *(each.ids for each in blocks)]))
    twice = np.flatnonzero(ids[1:] == ids[:-1])
    if twice.size:
        raise MeshError(f"element {ids[twice[0]]} occurs twice")
