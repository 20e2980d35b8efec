"""Cells of many kinds, and whether the tetrahedra among them are all that one needs."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.mesh.validation import MeshError


class CellType(NamedTuple):
    """A kind of cell."""

    name: str
    """In the plural."""
    dimension: int
    n_nodes: int
    """0: varies."""


def expect_tetrahedra(
    counts: Mapping[int, int], kinds: Mapping[int, CellType], tetrahedron: int
) -> None:
    """Make sure that there are tetrahedra; points, lines and triangles beside them are ignored.

    Args:
        counts: How many cells there are of each kind.
        kinds: The format's numbers of kinds.
        tetrahedron: The number of the tetrahedron with four nodes.

    Raises:
        MeshError: There are none, or there are other volumes, which would leave holes.
    """
    named = {
        number: kinds.get(number, CellType(f"cells of type {number}", 3, 0)) for number in counts
    }
    found = ", ".join(f"{counts[number]} {named[number].name}" for number in sorted(counts))
    volumes = [n for n in counts if named[n].dimension == 3 and n != tetrahedron]
    if volumes:
        raise MeshError(
            f"expected tetrahedra with four nodes only, found {found}: mesh the body with "
            "tetrahedra of first order"
        )
    if tetrahedron in counts:
        return
    if any(named[n].dimension == 2 for n in counts):
        raise MeshError(
            f"only a surface, no tetrahedra: found {found}. Fill it with tetrahedra first, with "
            "Gmsh or fTetWild for example"
        )
    raise MeshError(f"there are no tetrahedra; found {found or 'no cells'}")


def uniform_records(
    flat: IntArray, start: int, stride: int, columns: list[int], most: int
) -> IntArray:
    """Return the records from `start` on that agree with the first in `columns`.

    Files list cells one by one, each with its kind and size; nearly always the next is like this.

    Args:
        flat: The records one after another.
        start: Where the first begins.
        stride: Its length.
        columns: The entries of a record that say its kind and size.
        most: Take no more records than this.

    Returns:
        Shape (n_records, stride), or empty where `flat` ends within the first.
    """
    n_left = min(most, (len(flat) - start) // stride)
    if n_left == 0:
        return flat[:0].reshape(0, 1)
    records = flat[start : start + n_left * stride].reshape(n_left, stride)
    n_alike, n_tried = 0, 64
    while n_alike < n_left:  # in pieces that grow, so that many short runs cost little
        piece = records[n_alike : n_alike + n_tried]
        alike = (piece[:, columns] == records[0, columns]).all(axis=1)
        if not alike.all():
            return records[: n_alike + int(np.argmin(alike))]
        n_alike, n_tried = n_alike + len(piece), 4 * n_tried
    return records
