"""Layers between two parts of a body, along which it dissects."""

from collections.abc import Sequence

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.values import NotNegative, TomlTable, TwoLabels
from tissue import TetrahedralMesh

_MOST_NAMED = 20
"""Parts that a message names at most."""


class InterfaceTable(TomlTable, kw_only=True, frozen=True):
    """`[[interface]]`: a layer between two parts of the body, along which it dissects."""

    between: TwoLabels
    """Names of the two parts, or bodies. Where they share faces they are bonded by the layer."""
    toughness: NotNegative
    """Fracture toughness of the layer [J/m2]. A cut follows it where it is weaker than the tissue
    and the blade runs nearly along it, nearer than half an element."""


def check_interfaces(rows: Sequence[InterfaceTable]) -> None:
    """Check that each interface is between two parts, and that no two are between the same.

    Raises:
        UsageError: one is not; the message says which.
    """
    for i, row in enumerate(rows):
        first, second = sorted(row.between)
        where = f"[[interface]] number {i + 1}"
        if first == second:
            raise UsageError(f"{where} is between '{first}' and itself; it is where two parts meet")
        if any(sorted(other.between) == [first, second] for other in rows[:i]):
            raise UsageError(f"{where} is the second one between '{first}' and '{second}'")


def expect_parts(mesh: TetrahedralMesh, kind: str, parts: Sequence[Sequence[str]]) -> None:
    """Refuse a row that is about a part that the body does not have.

    Args:
        mesh: The body.
        kind: Name of the array of the rows.
        parts: Names of the parts that each row is about.

    Raises:
        UsageError: one is; the message names the parts.
    """
    present = set() if mesh.labels is None else set(np.unique(mesh.labels).tolist())
    names = [name for label, name in mesh.label_names.items() if label in present]
    for i, asked in enumerate(parts):
        for name in asked:
            if not any(each == name or each.startswith(f"{name}/") for each in names):
                known = ", ".join(names[:_MOST_NAMED]) or "none; [[label]] names one"
                raise UsageError(
                    f"[[{kind}]] number {i + 1}: the body has no part '{name}'. Parts with a "
                    f"name: {known}"
                )
