"""A tetrahedral mesh: positions, tetrahedra, and their labels."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from tissue.core.array_types import FloatArray, IntArray


class TetrahedralMesh(NamedTuple):
    """A tetrahedral mesh, from a file or a generator."""

    positions: FloatArray
    """Positions of the nodes [m], shape (n_nodes, 3)."""
    tetrahedra: IntArray
    """Node indices, shape (n_tets, 4); signed volumes are positive."""
    labels: IntArray | None = None
    """Label of each tetrahedron, its region or tissue: a whole number from 0 on, shape (n_tets,).
    None: the mesh has no labels."""
    label_names: Mapping[int, str] = MappingProxyType({})
    """Names of labels, of those that have one."""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return how it is pickled and copied: a read-only mapping can be neither."""
        return type(self), (*self[:3], dict(self.label_names))
