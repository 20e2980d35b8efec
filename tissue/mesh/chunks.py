"""Boxes around parts of the body: they say where tissue is more closely than one box around all."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.mesh.body import Body
from tissue.types import Chunks

TETRAHEDRA_EACH = 64
"""Tetrahedra in a chunk, about. Fewer make closer boxes, and more of them to look through: with 64
the organ has 85, 15 mm wide."""
MOST_CHUNKS = 512
"""A large body has larger chunks: who asks looks through all of their boxes a thousand times a
second."""


class ChunkNodes(NamedTuple):
    """The nodes of the tetrahedra of each chunk. A node may be in several, for a tetrahedron is
    wholly in one."""

    nodes: IntArray
    """Of all chunks, one after the other, shape (n,)."""
    first: IntArray
    """Where those of each chunk begin, and the end, shape (n_chunks + 1,)."""


def chunk_nodes(body: Body) -> ChunkNodes:
    """Divide the body by a lattice over it at rest, of cells as near to cubes as numbers allow.

    The tetrahedra whose first node is in a cell are a chunk.
    """
    tetrahedra = body.tetrahedra[: body.n_tetrahedra]
    n_nodes = body.n_nodes
    rest = body.rest[:n_nodes]
    low, extent = rest.min(axis=0), np.ptp(rest, axis=0)
    n = min(max(len(tetrahedra) // TETRAHEDRA_EACH, 1), MOST_CHUNKS)
    counts = np.maximum(np.rint(extent / np.cbrt(extent.prod() / n)).astype(np.int64), 1)
    at = (rest[tetrahedra[:, 0]] - low) * (counts / extent)
    cells = np.ravel_multi_index(
        tuple(np.minimum(at.astype(np.int64), counts - 1).T), tuple(counts)
    )
    each = np.unique(cells[:, None] * n_nodes + tetrahedra)
    _, first = np.unique(each // n_nodes, return_index=True)
    return ChunkNodes(each % n_nodes, np.append(first, len(each)))


def chunks_of(body: Body, chunks: ChunkNodes) -> Chunks:
    """Return the boxes of the chunks now, and the speed of the fastest node."""
    boxes = np.empty((len(chunks.first) - 1, 2, 3))
    return Chunks(boxes, enclose(body, chunks, boxes))


@kernel
def enclose(body: Body, chunks: ChunkNodes, boxes: FloatArray) -> float:
    """Write the lowest and highest corner of each chunk; return the largest speed [m/s]."""
    x, v = body.positions, body.velocities
    for chunk in range(len(boxes)):
        first = chunks.first[chunk]
        for axis in range(3):
            low = high = x[chunks.nodes[first], axis]
            for i in range(first + 1, chunks.first[chunk + 1]):
                here = x[chunks.nodes[i], axis]
                low, high = min(low, here), max(high, here)
            boxes[chunk, 0, axis], boxes[chunk, 1, axis] = low, high
    largest = 0.0
    for node in range(body.n_nodes):
        largest = max(largest, v[node, 0] ** 2 + v[node, 1] ** 2 + v[node, 2] ** 2)
    return np.sqrt(largest)
