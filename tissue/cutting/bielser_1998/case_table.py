"""The lookup table of section 4.1: for each cut-edge code, the actions that open the presplit.

Entries for one code of each case are written out in the notation of Figure 7; rotating and
reflecting them gives the others, 37 in all. An edge's node is referenced twice: AB1 by corner A,
AB2 by B. A face's node is referenced three times; as printed, ABC1 belongs to corner B, ABC2 to C,
ABC3 to A. Where a node is not doubled its references are equal, and reference 2 stands for any of
them.
"""

import itertools
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.cutting.bielser_1998.template_1_to_17 import (
    CORNERS,
    FACES,
    FIRST_J,
    N_CODES,
    code_of,
    edge_named,
    face_named,
)

CASES = "ABCDE"

REPRESENTATIVES = {
    "A": """splitEdge(AB) splitEdge(AC) splitEdge(AD)
        splitFace(ABC3) splitFace(ABD3) splitFace(ACD3)
        insertFace(AB1, ABC3, ABD3) insertFace(AC1, ABC3, ACD3)
        insertFace(AD1, ABD3, ACD3) insertFace(ABC3, ABD3, ACD3)
        insertFace(AB2, ABC1, ABD1) insertFace(AC2, ABC2, ACD1)
        insertFace(AD2, ABD2, ACD2) insertFace(ABC2, ABD2, ACD2)""",
    "B": """splitEdge(BC) splitEdge(BD) splitEdge(AC) splitEdge(AD)
        splitFace(ABC2) splitFace(ABD2) splitFace(ACD3) splitFace(BCD3)
        insertFace(BC1, ABC1, BCD3) insertFace(BD1, ABD1, BCD3)
        insertFace(AC1, ABC3, ACD3) insertFace(AD1, ABD3, ACD3)
        insertFace(ABC3, ABD3, ACD3) insertFace(ABC1, ABD1, BCD3)
        insertFace(BC2, ABC2, BCD1) insertFace(BD2, ABD2, BCD2)
        insertFace(AC2, ABC2, ACD1) insertFace(AD2, ABD2, ACD2)
        insertFace(ABC2, ABD2, ACD2) insertFace(ABC2, ABD2, BCD2)""",
    "C": """splitEdge(AB)
        insertFace(AB1, ABC2, ABD2)
        insertFace(AB2, ABC2, ABD2)""",
    "D": """splitEdge(AB) splitEdge(BC) splitFace(ABC1)
        insertFace(BC1, ABC1, BCD2) insertFace(AB2, ABC1, ABD2) insertFace(ABC1, BCD2, ABD2)
        insertFace(BC2, ABC2, BCD2) insertFace(AB1, ABC3, ABD2) insertFace(ABC2, BCD2, ABD2)""",
    "E": """splitEdge(BD) splitEdge(AC) splitEdge(AD)
        splitFace(ABD2) splitFace(ACD3)
        insertFace(BD2, ABD2, BCD2) insertFace(AC2, ABC2, ACD1) insertFace(AD2, ABD2, ACD2)
        insertFace(ABC2, ACD1, BCD2) insertFace(ABD2, ACD2, BCD2)
        insertFace(BD1, ABD1, BCD2) insertFace(AC1, ABC2, ACD3) insertFace(AD1, ABD3, ACD3)
        insertFace(ABC2, ACD3, BCD2) insertFace(ABD3, ACD3, BCD2)""",
}
"""The entry of one code of each case. D is Figure 7, word for word."""


class Action(NamedTuple):
    """An operator and its operands."""

    operator: str
    """Name of the operator: splitEdge, splitFace or insertFace."""
    operands: tuple[str, ...]
    """An edge; a reference to a face's node; or the references at the corners of a cut face."""

    def __str__(self) -> str:
        return f"{self.operator}({', '.join(self.operands)})"


class _Entry(NamedTuple):
    """A line of the lookup table."""

    code: int
    case: str
    """Name of the case, A to E."""
    actions: tuple[Action, ...]


def reference(name: str, corner: str) -> str:
    """Return the reference of `corner` to the node of an edge or a face with that name."""
    place = name.index(corner)
    return f"{name}{place + 1 if len(name) == 2 else (place + 2) % 3 + 1}"


def corner_of(operand: str) -> str:
    """Return the corner that a reference belongs to, such as B for ABC1."""
    name, number = operand[:-1], int(operand[-1])
    return name[number - 1] if len(name) == 2 else name[number % 3]


def _read(text: str) -> list[Action]:
    actions = []
    for word in text.replace(", ", ",").split():
        operator, _, operands = word.rstrip(")").partition("(")
        actions.append(Action(operator, tuple(operands.split(","))))
    return actions


def _turned(action: Action, split_faces: set[str], onto: dict[str, str]) -> Action:
    operands = []
    for operand in action.operands:
        if action.operator == "splitEdge":
            operands.append("".join(sorted(onto[corner] for corner in operand)))
            continue
        name = "".join(sorted(onto[corner] for corner in operand[:-1]))
        if len(name) == 3 and operand[:-1] not in split_faces:
            operands.append(f"{name}2")
        else:
            operands.append(reference(name, onto[corner_of(operand)]))
    return Action(action.operator, tuple(operands))


def _table() -> dict[int, _Entry]:
    table: dict[int, _Entry] = {}
    for case, text in REPRESENTATIVES.items():
        actions = _read(text)
        split_faces = {a.operands[0][:-1] for a in actions if a.operator == "splitFace"}
        for turned in itertools.permutations(CORNERS):  # rotations and reflections
            onto = dict(zip(CORNERS, turned, strict=True))
            entry = tuple(_turned(action, split_faces, onto) for action in actions)
            code = code_of(*(a.operands[0] for a in entry if a.operator == "splitEdge"))
            table.setdefault(code, _Entry(code, case, entry))
    return table


TABLE = _table()
"""The 37 entries, by their code."""


class Lookup(NamedTuple):
    """The lookup table as arrays over all 64 codes, for kernels."""

    case: IntArray
    """Index in CASES, or -1 for a code that is not in the table; shape (64,)."""
    opened: IntArray
    """Triangles of the presplit that each code opens: bit i for triangle i; shape (64,)."""
    detached: IntArray
    """Corner that gets a node of its own in each face, or -1; shape (64, 4)."""
    of_centre: IntArray
    """Corner whose reference to each face's node the centre shares; shape (64, 4)."""


def lookup() -> Lookup:
    """Return the lookup table as arrays."""
    case = np.full(N_CODES, -1)
    opened = np.zeros(N_CODES, dtype=np.int64)
    detached = np.full((N_CODES, 4), -1)
    of_centre = np.full((N_CODES, 4), -1)
    for code, entry in TABLE.items():
        case[code] = CASES.index(entry.case)
        for action in entry.actions:
            if action.operator == "splitFace":
                face = face_named(action.operands[0][:-1])
                detached[code, face] = CORNERS.index(corner_of(action.operands[0]))
            elif action.operator == "insertFace":
                opened[code] |= 1 << triangle_of(action)
        for face, corners in enumerate(FACES):
            with_centre = [v for v in corners if not opened[code] >> (FIRST_J + v) & 1]
            of_centre[code, face] = with_centre[0]
    return Lookup(case, opened, detached, of_centre)


def triangle_of(action: Action) -> int:
    """Return which of the presplit's ten triangles an insertFace covers on one side."""
    edges = [operand[:-1] for operand in action.operands if len(operand) == 3]
    if edges:
        return edge_named(edges[0])
    common = set.intersection(*(set(operand[:-1]) for operand in action.operands))
    return FIRST_J + CORNERS.index(common.pop())


LOOKUP = lookup()
