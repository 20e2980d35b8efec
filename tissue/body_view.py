"""Views of a body: copies of its state, its pieces, the boxes around it, quantities at its skin."""

from typing import get_args

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.elasticity.internal_forces import Elastic
from tissue.fields.node_fields import largest_principal_strains, von_mises_stresses
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import ChunkNodes, chunk_nodes, chunks_of, write_bounds
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.pieces import label_pieces
from tissue.mesh.surface import boundary_nodes
from tissue.types import Chunks, Snapshot, SurfaceQuantity


def bounds_of_body(body: Body) -> FloatArray:
    """Return the lowest and highest corner of a body [m], shape (2, 3)."""
    corners = np.empty((2, 3))
    write_bounds(body, corners)
    return corners


def snapshot_of(body: Body) -> Snapshot:
    """Return a copy of the whole state of a body."""
    n = body.n_nodes
    return Snapshot(
        body.positions[:n].copy(),
        body.rest[:n].copy(),
        body.velocities[:n].copy(),
        body.masses[:n] - body.added_masses[:n],
        body.added_masses[:n].copy(),
        body.tetrahedra[: body.n_tetrahedra].copy(),
        body.fixed[:n].copy(),
    )


def n_pieces_of(body: Body) -> int:
    """Return the number of connected pieces of a body."""
    piece, queue = np.empty((2, body.n_tetrahedra), dtype=np.int64)
    return label_pieces(body, piece, queue)


class BodyChunks:
    """The parts of a body around which boxes are drawn, until its mesh changes."""

    def __init__(self) -> None:
        self._nodes: ChunkNodes | None = None

    def boxes(self, body: Body) -> Chunks:
        """Return boxes that together hold the body."""
        if self._nodes is None:
            self._nodes = chunk_nodes(body)
        return chunks_of(body, self._nodes)

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Divide the body again when its boxes are needed next."""
        del changed
        self._nodes = None

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: there are no rows of nodes."""


def surface_values_of(body: Body, elastic: Elastic, quantity: SurfaceQuantity) -> FloatArray:
    """Return a quantity at each vertex of the skin, shape (n_vertices,); see `Tissue`.

    Args:
        body: The body.
        elastic: Arrays from which the stress follows.
        quantity: Name of the quantity.

    Raises:
        ValueError: there is no such quantity.
    """
    n, nodes = body.n_nodes, boundary_nodes(body)
    if quantity == "displacement":
        offsets = body.positions[nodes] - body.rest[nodes]
        return np.asarray(np.linalg.norm(offsets, axis=1), float)
    values, sums = np.empty(n), np.zeros((n, 7))
    if quantity == "strain":
        largest_principal_strains(body, sums, values)
    elif quantity == "stress":
        # What the last step left is for the bound before the next one.
        left = elastic.solid.gradient, elastic.solid.stiffness_taken
        kept = [array.copy() for array in left]
        von_mises_stresses(elastic, body, sums, values)
        for array, values_before in zip(left, kept, strict=True):
            array[:] = values_before
    else:
        raise ValueError(
            f"there is no quantity {quantity!r}. Known: {', '.join(get_args(SurfaceQuantity))}"
        )
    return values[nodes]
