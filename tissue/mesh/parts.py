"""Parts of a mesh: labels by number, by name, or by the name of the body that has them."""

from collections.abc import Mapping, Sequence

import numpy as np

from tissue.mesh.mesh_arrays import mesh_arrays
from tissue.types import TetrahedralMesh

MOST_NAMED = 20
"""Labels that an error names at most."""

OF_BODY = "/"
"""Sign between the name of a body and that of a label of its own mesh."""


def labels_of_part(present: Sequence[int], names: Mapping[int, str], part: int | str) -> list[int]:
    """Return the labels of a part: a label by its number; or by a name, with those below it.

    Args:
        present: The labels that there are.
        names: Their names, of those that have one.
        part: A label, by number; or a name: of a label, or of a body, whose labels are called as
            it is, or `body/label`.

    Raises:
        ValueError: no tetrahedron has such a label.
    """
    if isinstance(part, str):
        of_body = part + OF_BODY
        numbers = [n for n, name in names.items() if name == part or name.startswith(of_body)]
    else:
        numbers = [int(part)]
    found = [number for number in numbers if number in present]
    if found:
        return found
    known = ", ".join(described_label(names, number) for number in present[:MOST_NAMED])
    raise ValueError(
        f"no tetrahedron has label {part!r}; there is {known}. Labels are those of the mesh: "
        "`labels`, or groups and cell data of its file"
    )


def described_label(names: Mapping[int, str], label: int) -> str:
    """Return a label with its name, if it has one."""
    return f"{label} ('{names[label]}')" if label in names else f"{label}"


def part_of_mesh(mesh: TetrahedralMesh, part: int | str) -> TetrahedralMesh:
    """Return the tetrahedra of a part, with all the nodes of the mesh.

    Args:
        mesh: The mesh.
        part: See `labels_of_part`.

    Raises:
        MeshError: the arrays of the mesh have another shape or hold no numbers.
        ValueError: no tetrahedron is in such a part.
    """
    mesh = mesh_arrays(mesh)
    labels = np.zeros(len(mesh.tetrahedra), np.int64) if mesh.labels is None else mesh.labels
    chosen = labels_of_part(np.unique(labels).tolist(), mesh.label_names, part)
    mine = np.isin(labels, chosen)
    return mesh._replace(tetrahedra=mesh.tetrahedra[mine], labels=labels[mine])
