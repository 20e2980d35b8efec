"""`BodyQueries`: what can be asked of a body at any time."""

from abc import ABC, abstractmethod

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import ChunkNodes, chunk_nodes, chunks_of, write_bounds
from tissue.mesh.pieces import label_pieces, piece_of_tetrahedra, pieces_of
from tissue.mesh.surface import boundary_surface
from tissue.types import Chunks, Piece, Snapshot, Surface


class BodyQueries(ABC):
    """Counts, state, surface and pieces of a body that may be cut between two questions."""

    _chunks: ChunkNodes | None = None
    """Nodes of each chunk; None where the mesh has changed since they were found."""

    @property
    @abstractmethod
    def _body(self) -> Body:
        """The body as it is now."""

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self._body.n_nodes

    @property
    def n_tetrahedra(self) -> int:
        """Number of tetrahedra."""
        return self._body.n_tetrahedra

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest corner of the body [m], shape (2, 3)."""
        corners = np.empty((2, 3))
        write_bounds(self._body, corners)
        return corners

    def snapshot(self) -> Snapshot:
        """Return a copy of the whole state."""
        n, body = self.n_nodes, self._body
        return Snapshot(
            body.positions[:n].copy(),
            body.rest[:n].copy(),
            body.velocities[:n].copy(),
            body.masses[:n] - body.added_masses[:n],
            body.tetrahedra[: self.n_tetrahedra].copy(),
            body.fixed[:n].copy(),
        )

    def surface(self) -> Surface:
        """Return the boundary triangles, skin and cut faces apart."""
        return boundary_surface(self._body)

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body: a blade outside of them touches nothing.

        After a cut the body is divided again, which takes some 0.3 us a tetrahedron; else it costs
        one pass over the nodes.
        """
        if self._chunks is None:
            self._chunks = chunk_nodes(self._body)
        return chunks_of(self._body, self._chunks)

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        piece, queue = np.empty((2, self.n_tetrahedra), dtype=np.int64)
        return label_pieces(self._body, piece, queue)

    def pieces(self) -> tuple[Piece, ...]:
        """Return the connected pieces and their mass properties, the largest at rest first."""
        return pieces_of(self.snapshot())

    def piece_of_tetrahedra(self) -> IntArray:
        """Return the index in `pieces` of the piece of each tetrahedron, shape (n_tets,)."""
        return piece_of_tetrahedra(self.snapshot())
