"""The arrays of a mesh as the engine takes them, whatever types they come in."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import IntArray
from tissue.types import TetrahedralMesh

LARGEST_LABEL = 2**31 - 1
"""Largest label: that of the formats that write them in 32 bits."""


class MeshError(ValueError):
    """A mesh, or the file that should hold one, cannot be used. The message says why."""


def mesh_arrays(mesh: TetrahedralMesh) -> TetrahedralMesh:
    """Return a mesh as contiguous arrays of doubles and of 64-bit integers; those that are, as is.

    Any type of whole and of real numbers is converted, in any byte order.

    Raises:
        MeshError: there are no tetrahedra, or the arrays have another shape or hold no numbers; a
            label is negative, or its name is no text.
    """
    positions = np.asarray(mesh.positions)
    tetrahedra = tetrahedron_array(mesh.tetrahedra)
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.dtype.kind not in "fiu":
        raise MeshError(
            f"positions are {positions.dtype} of shape {positions.shape}; "
            "they must be numbers of shape (n_nodes, 3)"
        )
    return TetrahedralMesh(
        np.ascontiguousarray(positions, dtype=np.float64),
        tetrahedra,
        None if mesh.labels is None else _label_array(mesh.labels, len(tetrahedra)),
        _names(mesh.label_names),
    )


def _label_array(labels: npt.ArrayLike, n_tetrahedra: int) -> IntArray:
    """Return labels as a contiguous array of 64-bit integers, or refuse them."""
    array = np.asarray(labels)
    if array.shape != (n_tetrahedra,) or array.dtype.kind not in "iu":
        raise MeshError(
            f"labels are {array.dtype} of shape {array.shape}; they must be whole numbers, one for "
            f"each of the {n_tetrahedra} tetrahedra"
        )
    wrong = np.flatnonzero((array < 0) | (array > LARGEST_LABEL))
    if wrong.size:
        raise MeshError(
            f"tetrahedron {wrong[0]} has the label {array[wrong[0]]}; labels are whole numbers "
            f"from 0 to {LARGEST_LABEL}"
        )
    return np.ascontiguousarray(array, dtype=np.int64)


def _names(names: Mapping[int, str]) -> Mapping[int, str]:
    """Return a read-only copy of names of labels, or refuse them."""
    for label, name in names.items():
        is_label = isinstance(label, (int, np.integer)) and 0 <= label <= LARGEST_LABEL
        if not is_label or not isinstance(name, str):
            raise MeshError(
                f"label_names has {name!r} for {label!r}; it must have a text for a whole number "
                f"from 0 to {LARGEST_LABEL}"
            )
    return MappingProxyType({int(label): name for label, name in names.items()})


def tetrahedron_array(tetrahedra: npt.ArrayLike) -> IntArray:
    """Return tetrahedra as a contiguous array of 64-bit integers, shape (n_tets, 4).

    Raises:
        MeshError: there are none, or they have another shape or are no whole numbers.
    """
    array = np.asarray(tetrahedra)
    if array.size == 0:
        raise MeshError("there are no tetrahedra")
    if array.ndim != 2 or array.shape[1] != 4 or array.dtype.kind not in "iu":
        raise MeshError(
            f"tetrahedra are {array.dtype} of shape {array.shape}; "
            "they must be whole numbers of shape (n_tets, 4)"
        )
    return np.ascontiguousarray(array, dtype=np.int64)
