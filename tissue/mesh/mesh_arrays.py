"""The arrays of a mesh as the engine takes them, whatever types they come in."""

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import IntArray
from tissue.types import TetrahedralMesh


class MeshError(ValueError):
    """A mesh, or the file that should hold one, cannot be used. The message says why."""


def mesh_arrays(mesh: TetrahedralMesh) -> TetrahedralMesh:
    """Return a mesh as contiguous arrays of doubles and of 64-bit integers; those that are, as is.

    Any type of whole and of real numbers is converted, in any byte order.

    Raises:
        MeshError: there are no tetrahedra, or the arrays have another shape or hold no numbers.
    """
    positions = np.asarray(mesh.positions)
    tetrahedra = tetrahedron_array(mesh.tetrahedra)
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.dtype.kind not in "fiu":
        raise MeshError(
            f"positions are {positions.dtype} of shape {positions.shape}; "
            "they must be numbers of shape (n_nodes, 3)"
        )
    return TetrahedralMesh(np.ascontiguousarray(positions, dtype=np.float64), tetrahedra)


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
