"""The parts of a body: labels of its tetrahedra, and the material of each."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.body import OneOfBodiesTable
from scalpel_sim.scene.schema import LabelTable
from tissue import TetrahedralMesh

_MOST_NAMED = 20
"""Labels that a message names at most."""


def labelled(
    mesh: TetrahedralMesh, rows: Sequence[LabelTable], bodies: Sequence[OneOfBodiesTable] = ()
) -> TetrahedralMesh:
    """Return a mesh with the labels and names of these tables.

    A table with a region makes a label of its own, of the tetrahedra whose middles are in it; of
    several regions the last one counts. Others name a label of the mesh, by `label` or by `name`.

    Args:
        mesh: The mesh.
        rows: The tables.
        bodies: The bodies of which it is made, where it is made of several.

    Raises:
        UsageError: a table names no label that the mesh has, or its region holds no tetrahedron.
    """
    if not rows:
        return mesh
    twice = [name for name, n in Counter(full_name(row) for row in rows).items() if n > 1]
    if twice:
        raise UsageError(f"[[label]] '{twice[0]}' occurs twice; each label has a name of its own")
    n = len(mesh.tetrahedra)
    labels = np.zeros(n, np.int64) if mesh.labels is None else mesh.labels.copy()
    names, middles = dict(mesh.label_names), None
    first_own = int(labels.max(initial=0)) + 1
    for i, row in enumerate(rows):
        if row.region is None:
            names[_label_of(mesh, row, bodies)] = full_name(row)
            continue
        if middles is None:
            middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
        labels[_in_region(mesh, middles, row)] = first_own + i
        names[first_own + i] = full_name(row)
    present, own = set(np.unique(labels).tolist()), {full_name(row) for row in rows}
    for label, name in names.items():
        if label not in present and name in own:
            raise UsageError(f"[[label]] '{name}': regions that come later hold all of it")
    return mesh._replace(labels=labels, label_names=names)


def full_name(row: LabelTable) -> str:
    """Return the name of a label, after that of its body where there are several."""
    return row.name if row.body is None else f"{row.body}/{row.name}"


def unused_labels(mesh: TetrahedralMesh, rows: Sequence[LabelTable]) -> str | None:
    """Return what to say of labels of a mesh that no table is about; None where there are none."""
    if mesh.labels is None or rows:
        return None
    labels, counts = np.unique(mesh.labels, return_counts=True)
    if len(labels) == 1:
        return None
    named = [
        f"{label}{_quoted(mesh.label_names.get(label))} of {n:,} tetrahedra"
        for label, n in zip(labels.tolist(), counts.tolist(), strict=True)
    ]
    first = labels.tolist()[-1]
    return (
        f"the mesh has labels, and the body is of one material: {', '.join(named[:_MOST_NAMED])}. "
        f"--label {first}=MATERIAL, or [[label]] of a scene, gives one its own"
    )


def _quoted(name: str | None) -> str:
    return "" if name is None else f" '{name}'"


def _label_of(mesh: TetrahedralMesh, row: LabelTable, bodies: Sequence[OneOfBodiesTable]) -> int:
    """Return the label of the mesh that a table without a region is about."""
    present = [] if mesh.labels is None else np.unique(mesh.labels).tolist()
    if row.label is None:
        found = [label for label, name in mesh.label_names.items() if name == full_name(row)]
    elif row.body is None:
        found = [row.label] if row.label in present else []
    else:
        found = _label_in_file(mesh, row, bodies)
    if len(found) == 1:
        return found[0]
    names = [f"{label}{_quoted(mesh.label_names.get(label))}" for label in present[:_MOST_NAMED]]
    known = f"it has {', '.join(names)}" if names else "it has none"
    asked = f"'{row.name}'" if row.label is None else f"{row.label}"
    raise UsageError(
        f"[[label]] '{row.name}': the mesh has no label {asked}; {known}. Give `label`, its number "
        "in the file of the mesh, or `region`"
    )


def _label_in_file(
    mesh: TetrahedralMesh, row: LabelTable, bodies: Sequence[OneOfBodiesTable]
) -> list[int]:
    """Return the label that a label of the file of one of several bodies is in the whole mesh."""
    (own,) = (body.mesh() for body in bodies if body.name == row.body)
    given = [0] if own.labels is None else np.unique(own.labels).tolist()
    numbers = _of_body(mesh, row)
    return [number for number, each in zip(numbers, given, strict=True) if each == row.label]


def _of_body(mesh: TetrahedralMesh, row: LabelTable) -> list[int]:
    """Return the labels of the body that a table is about, in order."""
    return sorted(
        label
        for label, name in mesh.label_names.items()
        if name == row.body or name.startswith(f"{row.body}/")
    )


def _in_region(mesh: TetrahedralMesh, middles: np.ndarray, row: LabelTable) -> np.ndarray:
    """Return which tetrahedra have their middles in the region of a table."""
    from tissue import fixed_nodes

    assert row.region is not None
    try:
        found = fixed_nodes(TetrahedralMesh(middles, np.zeros((1, 4), np.int64)), row.region)
    except ValueError:
        found = np.zeros(len(middles), np.bool_)
    if row.body is not None:
        assert mesh.labels is not None
        found &= np.isin(mesh.labels, _of_body(mesh, row))
    if not found.any():
        of_body = "" if row.body is None else f" of body '{row.body}'"
        raise UsageError(
            f"[[label]] '{row.name}': no tetrahedron{of_body} has its middle in region "
            f"'{row.region}'"
        )
    return found
