"""The parts of a body: labels of its tetrahedra, and the material of each."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.schema import LabelTable
from tissue import TetrahedralMesh

_MOST_NAMED = 20
"""Labels that a message names at most."""


def labelled(mesh: TetrahedralMesh, rows: Sequence[LabelTable]) -> TetrahedralMesh:
    """Return a mesh with the labels and names of these tables.

    A table with a region makes a label of its own, of the tetrahedra whose middles are in it; of
    several regions the last one counts. Others name a label of the mesh, by `label` or by `name`.

    Raises:
        UsageError: a table names no label that the mesh has, or its region holds no tetrahedron.
    """
    if not rows:
        return mesh
    twice = [name for name, n in Counter(row.name for row in rows).items() if n > 1]
    if twice:
        raise UsageError(f"[[label]] '{twice[0]}' occurs twice; each label has a name of its own")
    n = len(mesh.tetrahedra)
    labels = np.zeros(n, np.int64) if mesh.labels is None else mesh.labels.copy()
    names, middles = dict(mesh.label_names), None
    first_own = int(labels.max(initial=0)) + 1
    for i, row in enumerate(rows):
        if row.region is None:
            names[_label_of(mesh, row)] = row.name
            continue
        if middles is None:
            middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
        labels[_in_region(middles, row)] = first_own + i
        names[first_own + i] = row.name
    present, own = set(np.unique(labels).tolist()), {row.name for row in rows}
    for label, name in names.items():
        if label not in present and name in own:
            raise UsageError(f"[[label]] '{name}': regions that come later hold all of it")
    return mesh._replace(labels=labels, label_names=names)


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


def _label_of(mesh: TetrahedralMesh, row: LabelTable) -> int:
    """Return the label of the mesh that a table without a region is about."""
    present = [] if mesh.labels is None else np.unique(mesh.labels).tolist()
    if row.label is not None:
        found = [row.label] if row.label in present else []
    else:
        found = [label for label, name in mesh.label_names.items() if name == row.name]
    if len(found) == 1:
        return found[0]
    names = [f"{label}{_quoted(mesh.label_names.get(label))}" for label in present[:_MOST_NAMED]]
    known = f"it has {', '.join(names)}" if names else "it has none"
    asked = f"'{row.name}'" if row.label is None else f"{row.label}"
    raise UsageError(
        f"[[label]] '{row.name}': the mesh has no label {asked}; {known}. Give `label`, its number "
        "in the file of the mesh, or `region`"
    )


def _in_region(middles: np.ndarray, row: LabelTable) -> np.ndarray:
    """Return which tetrahedra have their middles in the region of a table."""
    from tissue import fixed_nodes

    assert row.region is not None
    try:
        return fixed_nodes(TetrahedralMesh(middles, np.zeros((1, 4), np.int64)), row.region)
    except ValueError:
        raise UsageError(
            f"[[label]] '{row.name}': no tetrahedron has its middle in region '{row.region}'"
        ) from None
