"""Where the body is: the box around it, and boxes around its parts."""

import math
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import SameTypes, inlined, kernel
from tissue.core.vec3 import Vec3, dot, store, vec3
from tissue.geometry.aabb import Aabb, box_between, empty_box, with_point
from tissue.mesh.body import Body
from tissue.types import Chunks

TETRAHEDRA_EACH = 64
"""Tetrahedra in a chunk, about. Fewer make tighter boxes, and more of them to search: with 64 the
organ has 85, 15 mm wide."""
MOST_CHUNKS = 512
"""Chunks at most, since a client searches all of their boxes a thousand times a second. A large
body has larger chunks."""


class _Bounds(NamedTuple):
    """A box around nodes, and whether all their positions are finite."""

    box: Aabb
    is_finite: bool


@kernel
def write_bounds(body: Body, corners: FloatArray) -> bool:
    """Write the corners of the box around all nodes [m], shape (2, 3).

    Returns whether all positions are finite; if not, the motion became unstable.
    """
    bounds = _Bounds(empty_box(), True)
    x = body.positions
    for node in range(body.n_nodes):
        bounds = _with(bounds, vec3(x, node))
    store(corners, 0, bounds.box.low)
    store(corners, 1, bounds.box.high)
    return bounds.is_finite


@kernel
def widen_bounds(body: Body, nodes: IntArray, n: int, corners: FloatArray) -> bool:
    """Widen the box around the body, of which the first `n` of `nodes` moved; see `write_bounds`.

    The box may be larger than the body: nodes that moved inwards do not shrink it.
    """
    bounds = _Bounds(box_between(corners), True)
    for i in range(n):
        bounds = _with(bounds, vec3(body.positions, nodes[i]))
    store(corners, 0, bounds.box.low)
    store(corners, 1, bounds.box.high)
    return bounds.is_finite


@inlined
def _with(bounds: _Bounds, p: Vec3) -> _Bounds:
    # A comparison with nan is false: min and max would overlook it.
    is_finite = bounds.is_finite and math.isfinite(p.x + p.y + p.z)
    return _Bounds(with_point(bounds.box, p), is_finite)


class ChunkNodes(NamedTuple):
    """The nodes of the tetrahedra of each chunk. A node may be in several chunks."""

    nodes: IntArray
    """Nodes of all chunks, one chunk after another, shape (n,)."""
    first: IntArray
    """Where the nodes of each chunk begin in `nodes`, and the end, shape (n_chunks + 1,)."""


def chunk_nodes(body: Body) -> ChunkNodes:
    """Return the chunks of the body: one for each cell of a lattice over the body at rest.

    Cells are as near to cubes as whole numbers of them allow. The tetrahedra whose first node is in
    a cell are a chunk.
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
    return Chunks(boxes, _ENCLOSE.call(body, chunks, boxes))


@kernel
def enclose(body: Body, chunks: ChunkNodes, boxes: FloatArray) -> float:
    """Write the lowest and highest corner of each chunk; return the largest speed [m/s]."""
    x = body.positions
    for chunk in range(len(boxes)):
        first = chunks.first[chunk]
        # The axes in one pass: each comparison waits for the one before on its axis alone.
        low = high = vec3(x, chunks.nodes[first])
        for i in range(first + 1, chunks.first[chunk + 1]):
            p = vec3(x, chunks.nodes[i])
            low = Vec3(min(low.x, p.x), min(low.y, p.y), min(low.z, p.z))
            high = Vec3(max(high.x, p.x), max(high.y, p.y), max(high.z, p.z))
        store(boxes[chunk], 0, low)
        store(boxes[chunk], 1, high)
    return largest_speed(body)


_ENCLOSE = SameTypes(enclose)


@kernel
def largest_speed(body: Body) -> float:
    """Return the speed of the fastest node [m/s]."""
    largest, v = 0.0, body.velocities
    for node in range(body.n_nodes):
        speed = vec3(v, node)
        largest = max(largest, dot(speed, speed))
    return math.sqrt(largest)
