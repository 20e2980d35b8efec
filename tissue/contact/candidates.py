"""`Candidates`: the pairs of node and triangle, and of edge and edge, that may come to touch.

Only faces of cuts and skin near another piece are active (see `piece_boxes`). Each node has a
reference position; pairs are found with a margin around those positions, and hold until one of
their nodes has left its own by half the margin, or the mesh around it has changed.

Faces go by their places in `Faces`, edges by 3 * place + k.
"""

import numpy as np

from tissue.contact.pairs import Pairs, clear_pairs, new_pairs
from tissue.contact.spatial_hash import Grid, Search, clear_grid, new_grid, new_search
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.mesh.body import grown


class Candidates(Arrays):
    """Active faces, their nodes and edges, and the pairs.

    An edge belongs to the face that has it from its lower node to its higher. Of cuts, only ridges
    are paired.
    """

    n_nodes: IntCell
    """Number of nodes of active faces."""
    n_dirty: IntCell
    """Number of dirty faces: those that are to be paired again."""
    n_updates: IntCell
    """Number of updates so far."""
    path_since_check: FloatCell
    """Path of any node at most since skin was last tested for being near another piece [m]."""
    node: IntArray
    """Nodes of active faces, in no particular order; shape (node capacity,)."""
    place: IntArray
    """Where in `node` each node is, or -1; shape (node capacity,)."""
    n_around: IntArray
    """Number of active faces around each node, shape (node capacity,)."""
    n_cut_around: IntArray
    """Number of active faces of cuts around each node, shape (node capacity,)."""
    node_generation: IntArray
    """How often each node was paired again, shape (node capacity,)."""
    marked: IntArray
    """Update in which each node was last to be paired again, shape (node capacity,)."""
    reference: FloatArray
    """Where each node was when it was paired [m], shape (node capacity, 3)."""
    triangle: IntArray
    """Nodes of each face, counter-clockwise seen from outside; shape (capacity, 3)."""
    is_active: IntArray
    """1 if a face is paired, else 0; shape (capacity,)."""
    should_be_active: IntArray
    """1 if a face is of a cut, or skin near another piece, else 0; shape (capacity,)."""
    seen_generation: IntArray
    """Generation in `Faces` of each face when it was last paired, or -1; shape (capacity,)."""
    is_of_cut: IntArray
    """1 if a face was of a cut when it was last paired, else 0; shape (capacity,)."""
    generation: IntArray
    """How often each face was paired again, shape (capacity,)."""
    has_edge: IntArray
    """1 if an edge belongs to its face and is of skin or a ridge, else 0; shape (3 * capacity,)."""
    listed: IntArray
    """Update in which each face was last dirty, shape (capacity,)."""
    dirty: IntArray
    """Scratch: faces that are to be paired again, shape (capacity,)."""
    triangle_low: FloatArray
    """Lowest corner of the box around each triangle, with its rim [m]; shape (capacity, 3)."""
    triangle_high: FloatArray
    """Highest corner of the box around each triangle, with its rim [m]; shape (capacity, 3)."""
    edge_low: FloatArray
    """Lowest corner of the box around each edge [m], shape (3 * capacity, 3)."""
    edge_high: FloatArray
    """Highest corner of the box around each edge [m], shape (3 * capacity, 3)."""
    points: Grid
    """Nodes of active faces by their references."""
    triangles: Grid
    """Active faces by their boxes."""
    edges: Grid
    """Edges that are to be paired by their boxes."""
    search: Search
    """Scratch of searches in the grids."""
    point_triangle: Pairs
    """Pairs of a node and a triangle."""
    edge_edge: Pairs
    """Pairs of edges."""


def new_candidates(n_nodes: int, capacity: int, size: float) -> Candidates:
    """Return no candidates.

    Args:
        n_nodes: Nodes of the body that there is room for.
        capacity: Faces that there is room for.
        size: Edge of a cell of the grids [m]: about the size of an element.
    """
    buckets = 1 << (4 * capacity - 1).bit_length()
    of_nodes = ("node", "n_around", "n_cut_around", "node_generation", "marked")
    of_faces = ("is_active", "should_be_active", "is_of_cut", "generation", "listed", "dirty")
    return Candidates(
        n_nodes=0,
        n_dirty=0,
        n_updates=0,
        path_since_check=np.inf,
        **{name: np.zeros(n_nodes, np.int64) for name in of_nodes},
        place=np.full(n_nodes, -1, np.int64),
        reference=np.zeros((n_nodes, 3)),
        **{name: np.zeros(capacity, np.int64) for name in of_faces},
        seen_generation=np.full(capacity, -1, np.int64),
        has_edge=np.zeros(3 * capacity, np.int64),
        triangle=np.zeros((capacity, 3), np.int64),
        triangle_low=np.zeros((capacity, 3)),
        triangle_high=np.zeros((capacity, 3)),
        edge_low=np.zeros((3 * capacity, 3)),
        edge_high=np.zeros((3 * capacity, 3)),
        points=new_grid(buckets, 4 * capacity, size),
        triangles=new_grid(buckets, 32 * capacity, size),
        edges=new_grid(buckets, 32 * capacity, size),
        search=new_search(max(n_nodes, 3 * capacity)),
        point_triangle=new_pairs(16 * capacity),
        edge_edge=new_pairs(32 * capacity),
    )


def grown_candidates(candidates: Candidates, n_nodes: int) -> Candidates:
    """Return the candidates with room for `n_nodes` of the body."""
    of_nodes = ("node", "n_around", "n_cut_around", "node_generation", "marked", "reference")
    larger = {name: grown(getattr(candidates, name), n_nodes) for name in of_nodes}
    return candidates.replaced(
        **larger,
        place=grown(candidates.place, n_nodes, -1),
        search=new_search(max(n_nodes, len(candidates.edge_low))),
    )


@kernel
def clear_candidates(candidates: Candidates) -> None:
    """Remove all faces and pairs: the next update finds all of them again."""
    for i in range(candidates.n_nodes):
        node = candidates.node[i]
        candidates.place[node] = -1
        candidates.n_around[node] = 0
        candidates.n_cut_around[node] = 0
    candidates.n_nodes = 0
    for at in range(len(candidates.is_active)):
        candidates.is_active[at] = 0
        candidates.seen_generation[at] = -1
    candidates.path_since_check = np.inf
    clear_grid(candidates.points)
    clear_grid(candidates.triangles)
    clear_grid(candidates.edges)
    clear_pairs(candidates.point_triangle)
    clear_pairs(candidates.edge_edge)


@kernel
def mark_node(candidates: Candidates, node: int) -> None:
    """Let a node be paired again in this update."""
    candidates.marked[node] = candidates.n_updates


@kernel
def is_marked(candidates: Candidates, node: int) -> bool:
    """Whether a node is to be paired again in this update."""
    return bool(candidates.marked[node] == candidates.n_updates)


@kernel
def is_stale_point(candidates: Candidates, k: int) -> bool:
    """Whether pair `k` of node and triangle is out of date."""
    pairs = candidates.point_triangle
    of_node = candidates.node_generation[pairs.item[k, 0]]
    return bool(pairs.generation[k] != of_node + candidates.generation[pairs.item[k, 1]])


@kernel
def is_stale_edge(candidates: Candidates, k: int) -> bool:
    """Whether pair `k` of edges is out of date."""
    pairs, generation = candidates.edge_edge, candidates.generation
    first, second = generation[pairs.item[k, 0] // 3], generation[pairs.item[k, 1] // 3]
    return bool(pairs.generation[k] != first + second)
