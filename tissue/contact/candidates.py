"""Broad phase: the pairs of node and triangle, and of edge and edge, that may come to touch.

The pairs are found with a margin and used until a node has moved by half of it. Only faces of cuts
and skin near another piece are looked at (see `faces`): the cost is that of their neighbourhood.
"""

import math

import numpy as np

from tissue.arrays import Arrays
from tissue.body import NODES, Body, grown
from tissue.contact.faces import N_FACES, Faces, may_touch, measure_pieces
from tissue.contact.grid import (
    Grid,
    bucket_of,
    cell_of,
    cell_size,
    fill_grid,
    holds,
    new_grid,
    overlap,
)
from tissue.jit import kernel
from tissue.surface import OUTWARD
from tissue.types import FloatArray, IntArray
from tissue.vec3 import add, cross, dot, store, sub, vec3

N_NODES, N_TRIANGLES, N_EDGES, N_POINT_TRIANGLE, N_EDGE_EDGE = 0, 1, 2, 3, 4
"""Places in `Candidates.counts`."""

FARTHEST = 1.0
"""A node that moves farther in one Runge-Kutta step [m] belongs to a body that has exploded, of
which nothing is asked; its cells could not be counted."""

SAME_WAY = 0.5
"""Cosine between the normals of two edges above which they cannot face each other. Contact needs
a direction within a right angle of one normal and of the other's opposite."""


class Candidates(Arrays):
    """What may touch, and the pairs."""

    node: IntArray
    """Nodes of the triangles, shape (node capacity,)."""
    stamp: IntArray
    """The search that saw each node last, shape (node capacity,)."""
    search: IntArray
    """Number of the current search, shape (1,)."""
    reference: FloatArray
    """Where each node was at the search [m], shape (node capacity, 3)."""
    normal: FloatArray
    """Outward, weighted by area [m2], at the search; shape (node capacity, 3)."""
    triangle: IntArray
    """Nodes, counter-clockwise seen from outside; shape (capacity, 3)."""
    behind: IntArray
    """The tetrahedron behind each triangle, shape (capacity,)."""
    edge: IntArray
    """Nodes, shape (2 * capacity, 2)."""
    low: FloatArray
    """Lowest corner of the box of each triangle, later edge [m]; shape (2 * capacity, 3)."""
    high: FloatArray
    """Highest corner, the same."""
    grid: Grid
    point_triangle: IntArray
    """Node and triangle, shape (8 * capacity, 2)."""
    edge_edge: IntArray
    """Edge and edge, shape (8 * capacity, 2)."""
    counts: IntArray
    """How many of each, shape (5,)."""
    outward: IntArray
    """`surface.OUTWARD`."""


def new_candidates(n_nodes: int, capacity: int) -> Candidates:
    """Return no candidates, with room for that many nodes of the body, and triangles."""
    return Candidates(
        node=np.zeros(n_nodes, np.int64),
        stamp=np.zeros(n_nodes, np.int64),
        search=np.zeros(1, np.int64),
        reference=np.zeros((n_nodes, 3)),
        normal=np.zeros((n_nodes, 3)),
        triangle=np.zeros((capacity, 3), np.int64),
        behind=np.zeros(capacity, np.int64),
        edge=np.zeros((2 * capacity, 2), np.int64),
        low=np.zeros((2 * capacity, 3)),
        high=np.zeros((2 * capacity, 3)),
        grid=new_grid(1 << (8 * capacity - 1).bit_length(), 16 * capacity),
        point_triangle=np.zeros((8 * capacity, 2), np.int64),
        edge_edge=np.zeros((8 * capacity, 2), np.int64),
        counts=np.zeros(5, np.int64),
        outward=OUTWARD,
    )


def grown_candidates(candidates: Candidates, n_nodes: int) -> Candidates:
    """Return the candidates with room for that many nodes of the body."""
    of_nodes = ("node", "stamp", "reference", "normal")
    return candidates.replaced(
        **{name: grown(getattr(candidates, name), n_nodes) for name in of_nodes}
    )


@kernel
def have_moved(candidates: Candidates, body: Body, margin: float) -> bool:
    """Whether a node has moved by more than half the margin since the search."""
    most = 0.25 * margin * margin
    for i in range(candidates.counts[N_NODES]):
        node = candidates.node[i]
        d = sub(vec3(body.positions, node), vec3(candidates.reference, node))
        if not dot(d, d) <= most:
            return True
    return False


@kernel
def find_candidates(
    candidates: Candidates, faces: Faces, body: Body, start: FloatArray, margin: float
) -> bool:
    """Find the pairs anew; return False if there is no room.

    Args:
        candidates: Written.
        faces: The faces that may touch.
        body: For the nodes and where they are.
        start: Where they were before the Runge-Kutta step that is looked at [m].
        margin: [m].
    """
    move = _largest_move(body, start)
    if not move <= FARTHEST:
        clear(candidates)
        return True
    reach = margin + 2.0 * move
    if not _gather_triangles(candidates, faces, body, reach):
        return False
    return _pair_points(candidates, body, reach) and _pair_edges(candidates, body, reach)


@kernel
def clear(candidates: Candidates) -> None:
    """Forget all."""
    for i in range(len(candidates.counts)):
        candidates.counts[i] = 0


@kernel
def _gather_triangles(candidates: Candidates, faces: Faces, body: Body, reach: float) -> bool:
    """Write the faces that may touch, with their nodes."""
    clear(candidates)
    counts = candidates.counts
    candidates.search[0] += 1
    measure_pieces(faces, body)
    for i in range(faces.counts[N_FACES]):
        face = faces.face[i]
        if not may_touch(faces, body, face, reach):
            continue
        row = counts[N_TRIANGLES]
        if row == len(candidates.triangle):
            return False
        counts[N_TRIANGLES] += 1
        candidates.behind[row] = face // 4
        for k in range(3):
            candidates.triangle[row, k] = _face_node(candidates, body, face, k)
        _note_nodes(candidates, body, row)
    return True


@kernel
def _face_node(candidates: Candidates, body: Body, face: int, k: int) -> int:
    return body.tetrahedra[face // 4, candidates.outward[face % 4, k]]


@kernel
def _note_nodes(candidates: Candidates, body: Body, row: int) -> None:
    """Note the nodes of a triangle, and add its area vector to their normals."""
    a = vec3(body.positions, candidates.triangle[row, 0])
    b = vec3(body.positions, candidates.triangle[row, 1])
    c = vec3(body.positions, candidates.triangle[row, 2])
    area = cross(sub(b, a), sub(c, a))
    for k in range(3):
        node = candidates.triangle[row, k]
        if candidates.stamp[node] != candidates.search[0]:
            candidates.stamp[node] = candidates.search[0]
            candidates.node[candidates.counts[N_NODES]] = node
            candidates.counts[N_NODES] += 1
            store(candidates.reference, node, vec3(body.positions, node))
            store(candidates.normal, node, area)
        else:
            store(candidates.normal, node, add(vec3(candidates.normal, node), area))


@kernel
def _largest_move(body: Body, start: FloatArray) -> float:
    """How far a node has moved since `start`, at most [m]; NaN where it is not finite."""
    most = 0.0
    for node in range(body.counts[NODES]):
        d = sub(vec3(body.positions, node), vec3(start, node))
        square = dot(d, d)
        if not square <= most:
            most = square
    return math.sqrt(most)


@kernel
def _box(candidates: Candidates, body: Body, nodes: IntArray, row: int, reach: float) -> None:
    """Write the box of some nodes, larger by `reach` on each side."""
    for x in range(3):
        candidates.low[row, x] = np.inf
        candidates.high[row, x] = -np.inf
        for k in range(nodes.shape[1]):
            at = body.positions[nodes[row, k], x]
            candidates.low[row, x] = min(candidates.low[row, x], at - reach)
            candidates.high[row, x] = max(candidates.high[row, x], at + reach)


@kernel
def _pair_points(candidates: Candidates, body: Body, reach: float) -> bool:
    """Find the nodes in the boxes of triangles of which they are no corner."""
    counts, grid, triangle = candidates.counts, candidates.grid, candidates.triangle
    low, high = candidates.low, candidates.high
    n = counts[N_TRIANGLES]
    for row in range(n):
        _box(candidates, body, triangle, row, reach)
    size = cell_size(low, high, n)
    if not fill_grid(grid, low, high, n, size):
        return False
    for i in range(counts[N_NODES]):
        node = candidates.node[i]
        p = vec3(body.positions, node)
        bucket = bucket_of(grid, cell_of(p.x, size), cell_of(p.y, size), cell_of(p.z, size))
        for at in range(grid.first[bucket], grid.first[bucket + 1]):
            row = grid.item[at]
            if (
                not holds(low, high, row, p)
                or triangle[row, 0] == node
                or triangle[row, 1] == node
                or triangle[row, 2] == node
            ):
                continue
            if counts[N_POINT_TRIANGLE] == len(candidates.point_triangle):
                return False
            candidates.point_triangle[counts[N_POINT_TRIANGLE], 0] = node
            candidates.point_triangle[counts[N_POINT_TRIANGLE], 1] = row
            counts[N_POINT_TRIANGLE] += 1
    return True


@kernel
def _pair_edges(candidates: Candidates, body: Body, reach: float) -> bool:
    """Find the edges whose boxes overlap, which share no node and may face each other."""
    counts, grid, edge = candidates.counts, candidates.grid, candidates.edge
    low, high = candidates.low, candidates.high
    for row in range(counts[N_TRIANGLES]):
        for k in range(3):
            a = candidates.triangle[row, k]
            b = candidates.triangle[row, (k + 1) % 3]
            if a < b:  # the triangle on the other side has it as ba
                if counts[N_EDGES] == len(edge):
                    return False
                edge[counts[N_EDGES], 0] = a
                edge[counts[N_EDGES], 1] = b
                counts[N_EDGES] += 1
    n = counts[N_EDGES]
    for row in range(n):
        _box(candidates, body, edge, row, 0.5 * reach)
    size = cell_size(low, high, n)
    if not fill_grid(grid, low, high, n, size):
        return False
    for row in range(n):
        for i in range(cell_of(low[row, 0], size), cell_of(high[row, 0], size) + 1):
            for j in range(cell_of(low[row, 1], size), cell_of(high[row, 1], size) + 1):
                for k in range(cell_of(low[row, 2], size), cell_of(high[row, 2], size) + 1):
                    bucket = bucket_of(grid, i, j, k)
                    for at in range(grid.first[bucket], grid.first[bucket + 1]):
                        other = grid.item[at]
                        if (
                            other <= row
                            or not overlap(low, high, row, other)
                            # Boxes that share several cells meet in the lowest of them only.
                            or cell_of(max(low[row, 0], low[other, 0]), size) != i
                            or cell_of(max(low[row, 1], low[other, 1]), size) != j
                            or cell_of(max(low[row, 2], low[other, 2]), size) != k
                            or not _may_face(candidates, row, other)
                        ):
                            continue
                        if counts[N_EDGE_EDGE] == len(candidates.edge_edge):
                            return False
                        candidates.edge_edge[counts[N_EDGE_EDGE], 0] = row
                        candidates.edge_edge[counts[N_EDGE_EDGE], 1] = other
                        counts[N_EDGE_EDGE] += 1
    return True


@kernel
def _may_face(candidates: Candidates, row: int, other: int) -> bool:
    """Whether two edges share no node, and do not face the same way."""
    a, b = candidates.edge[row, 0], candidates.edge[row, 1]
    c, d = candidates.edge[other, 0], candidates.edge[other, 1]
    if a in (c, d) or b in (c, d):
        return False
    n = add(vec3(candidates.normal, a), vec3(candidates.normal, b))
    m = add(vec3(candidates.normal, c), vec3(candidates.normal, d))
    same = dot(n, m)
    return same <= 0.0 or same * same <= SAME_WAY * SAME_WAY * dot(n, n) * dot(m, m)
