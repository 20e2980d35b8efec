"""Boxes around parts of the body: they say where tissue is more closely than one box around all."""

from typing import NamedTuple

import numpy as np

from tissue.body import NODES, TETRAHEDRA, Body
from tissue.jit import kernel
from tissue.types import Chunks, FloatArray, IntArray

TETRAHEDRA_EACH = 64
"""Tetrahedra in a chunk, about. Fewer make closer boxes, and more of them to look through: with 64
the organ has 80, 15 mm wide."""
MOST_CHUNKS = 512
"""A large body has larger chunks: its boxes are for a collision library, which takes a microsecond
for each that has moved."""


class ChunkCells(NamedTuple):
    """A lattice over the body at rest. The tetrahedra whose first node is in a cell are a chunk.

    So a chunk needs no record of its members, and the parts of a tetrahedron that is cut stay in
    the chunk, or go to the next.
    """

    origin: FloatArray
    """Lowest corner [m], shape (3,)."""
    per_metre: FloatArray
    """Cells per length [1/m], shape (3,)."""
    counts: IntArray
    """Cells along each axis, shape (3,)."""


def chunk_cells(body: Body) -> ChunkCells:
    """Return cells as near to cubes as whole numbers allow."""
    rest = body.rest[: body.counts[NODES]]
    low, extent = rest.min(axis=0), np.ptp(rest, axis=0)
    n = min(max(int(body.counts[TETRAHEDRA]) // TETRAHEDRA_EACH, 1), MOST_CHUNKS)
    side = np.cbrt(extent.prod() / n)
    counts = np.maximum(np.rint(extent / side).astype(np.int64), 1)
    return ChunkCells(low, counts / extent, counts)


def chunks_of(body: Body, cells: ChunkCells) -> Chunks:
    """Return the boxes of the chunks that have a tetrahedron, and the speed of the fastest node."""
    n = int(cells.counts.prod())
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    fastest = enclose(body, cells, low, high)
    used = low[:, 0] <= high[:, 0]
    return Chunks(np.stack([low[used], high[used]], axis=1), fastest)


@kernel
def enclose(body: Body, cells: ChunkCells, low: FloatArray, high: FloatArray) -> float:
    """Widen the box of each chunk to hold its tetrahedra; return the largest speed [m/s].

    Args:
        body: The body.
        cells: Which chunk a tetrahedron is in.
        low: Lowest corners [m], infinite at first, shape (n_chunks, 3).
        high: Highest corners.
    """
    x, v, rest, counts = body.positions, body.velocities, body.rest, cells.counts
    for t in range(body.counts[TETRAHEDRA]):
        chunk = 0
        for axis in range(3):
            at = rest[body.tetrahedra[t, 0], axis] - cells.origin[axis]
            cell = int(at * cells.per_metre[axis])
            chunk = chunk * counts[axis] + min(max(cell, 0), counts[axis] - 1)
        for k in range(4):
            node = body.tetrahedra[t, k]
            for axis in range(3):
                low[chunk, axis] = min(low[chunk, axis], x[node, axis])
                high[chunk, axis] = max(high[chunk, axis], x[node, axis])
    largest = 0.0
    for node in range(body.counts[NODES]):
        largest = max(largest, v[node, 0] ** 2 + v[node, 1] ** 2 + v[node, 2] ** 2)
    return np.sqrt(largest)
