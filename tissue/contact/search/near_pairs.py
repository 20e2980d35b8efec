"""`NearPairs`: which node may come to touch which face, by nodes, kept true to motion and cuts.

A pair is listed if node and face would touch wherever in their balls their four nodes are. It holds
until one of them leaves its ball or the face changes; only then are that node and that face paired
again (`pair_update`). Faces go by their places in `Faces`. Pairs are tested eight at a time, in the
rows of `PairTests`.
"""

import numpy as np

from tissue.contact.search.node_grid import NodeGrid, new_node_grid
from tissue.contact.search.node_motion import NodeMotion
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, aligned, filled
from tissue.core.simd_rows import natural
from tissue.core.structs import Arrays, IntCell
from tissue.mesh.body import grown

_NUMBERS = ("is_held", "highest", "deepest", "size_of_normal", "path", "wake", "left", "distance")

CONTACT_REACH = 0.05
"""Gap up to which a contact is kept ready, per node size: fast nodes touch within a time step.
Larger: contacts that do not press take stiffness from those that do."""

_OF_NODES = (
    "nodes",
    "seen_at",
    "cut_at",
    "moved_at",
    "unpaired_at",
    "is_penetrating",
    "found_in",
    "face_moved_at",
    "moved",
    "begin",
    "end",
)
"""Fields with an entry for each node."""


class PairTests(Arrays):
    """Pairs that are due, node by node, and those of them that are so close that they may touch.

    There are rows behind the last to fill eight. They hold what earlier tests left, or 0: what is
    computed from it is not read.
    """

    n: IntCell
    """Number of tests."""
    n_close: IntCell
    """Number of close ones."""
    next: IntCell
    """The test whose result is to be taken next."""
    next_close: IntCell
    """The close one whose result is to be taken next."""
    pair: IntArray
    """Row of each pair in `NearPairs`, shape (capacity,)."""
    nodes: IntArray
    """Node of each, and the corners of its face; shape (capacity, 4)."""
    is_held: FloatArray
    """1 if the node has a contact with the face since the last search, else 0; shape
    (capacity,)."""
    highest: FloatArray
    """Height above its face up to which each may touch [m], shape (capacity,)."""
    deepest: FloatArray
    """Depth below its face up to which each may touch [m], shape (capacity,)."""
    size_of_normal: FloatArray
    """Length of the normal of each node [m2], shape (capacity,)."""
    path: FloatArray
    """Sum of the paths of the four nodes of each [m], shape (capacity,)."""
    wake: FloatArray
    """Sum of the paths up to which the pair needs no other test [m], shape (capacity,)."""
    left: FloatArray
    """Path that is left before that at least [m], shape (capacity,)."""
    close: IntArray
    """Number of each close pair, shape (capacity,)."""
    close_nodes: IntArray
    """Node of each close one, and the corners of its face; shape (capacity, 4)."""
    foot: FloatArray
    """Barycentric weights of the foot of each close one, and how far the node was above the face in
    the last search [m]; shape (capacity, 4)."""
    push: FloatArray
    """Unit vector in which each close one would push its node, and the gap along that [m]; shape
    (capacity, 4)."""
    distance: FloatArray
    """Squared distance of the node of each close one from the foot [m2], or -1 if it does not
    touch; shape (capacity,)."""


class NearPairs(Arrays):
    """Two lists of pairs, that in use and room for the next, and what they were made from.

    The pairs of one list are one after the other, so their arrays have 2 * capacity rows.
    """

    first: IntCell
    """First row of the list in use: 0, or the capacity."""
    n_pairs: IntCell
    """Number of pairs in the list in use."""
    n_nodes: IntCell
    """Number of nodes of faces."""
    n_moved: IntCell
    """Number of nodes that were paired again in the last update."""
    n_updates: IntCell
    """Number of the last update, from 1."""
    changed_at: IntCell
    """Number of the last update before which a face had changed."""
    n_indexed: IntCell
    """Update after which pairs were last sorted by their faces."""
    n_kept: IntCell
    """Number of pairs that hold in this update."""
    n_found: IntCell
    """Number of pairs that were found in this update; there may be no room for all."""
    nodes: IntArray
    """Nodes of faces, shape (node capacity,)."""
    seen_at: IntArray
    """Update in which each node was last one of a face, shape (node capacity,)."""
    cut_at: IntArray
    """Update in which each node was last one of a face of a cut, shape (node capacity,)."""
    moved_at: IntArray
    """Update in which each node was last paired again, shape (node capacity,)."""
    unpaired_at: IntArray
    """Update in which a near pair of each node last ended, shape (node capacity,)."""
    is_penetrating: IntArray
    """1 if a node is known to be inside another part of the body, else 0 (`penetrating_nodes`);
    shape (node capacity,)."""
    found_in: IntArray
    """Round of `penetrating_nodes` in which each node was last found inside another part, shape
    (node capacity,)."""
    face_moved_at: IntArray
    """Search in which a corner of a face that a node is paired with last moved much, shape (node
    capacity,)."""
    moved: IntArray
    """Nodes that were paired again in the last update, shape (node capacity,)."""
    begin: IntArray
    """Row of the first pair of each node, shape (node capacity,)."""
    end: IntArray
    """Row behind its last pair, shape (node capacity,)."""
    triangle: IntArray
    """Nodes of each face, counter-clockwise seen from outside; shape (face capacity, 3)."""
    tetrahedron: IntArray
    """Tetrahedron of each face, shape (face capacity,)."""
    is_of_cut: IntArray
    """1 if a face was made by a cut, else 0; shape (face capacity,)."""
    is_active: IntArray
    """1 if a face is paired, else 0; shape (face capacity,)."""
    seen_generation: IntArray
    """Generation in `Faces` of each face when it was last tested; shape (face capacity,)."""
    dirty_at: IntArray
    """Update in which each face was last paired again, shape (face capacity,)."""
    face_begin: IntArray
    """Where the nodes of each face begin in `of_face`, shape (face capacity + 2,)."""
    of_face: IntArray
    """The nodes that each face is paired with, face by face; shape (capacity,)."""
    known_at: IntArray
    """Search in which `path` and `displacement` of each face were last computed, shape (face
    capacity,)."""
    path: FloatArray
    """Sum of the paths of the corners of each face [m], shape (face capacity,)."""
    displacement: FloatArray
    """Displacement of the middle of each face since it was paired [m], shape (face
    capacity, 3)."""
    low: FloatArray
    """Lowest corner of the box in which each face queries nodes [m], shape (face capacity, 3)."""
    high: FloatArray
    """Highest corner of that box [m], shape (face capacity, 3)."""
    node: IntArray
    """Node of each pair, shape (2 * capacity,)."""
    face: IntArray
    """Place of the face of each pair, shape (2 * capacity,)."""
    is_near: IntArray
    """1 if node and face touch, or may by what they move against each other; else 0. Shape
    (2 * capacity,)."""
    is_kept: IntArray
    """Scratch: 1 if a pair holds in this update, else 0; shape (2 * capacity,)."""
    found_node: IntArray
    """Scratch: nodes of the pairs that were found, shape (capacity,)."""
    found_face: IntArray
    """Scratch: places of their faces, shape (capacity,)."""
    wake: FloatArray
    """Sum of the paths of its four nodes up to which a pair needs no test [m], shape
    (2 * capacity,)."""
    relative: FloatArray
    """Displacement of the node against the face as a near pair was last tested [m], shape
    (2 * capacity, 3)."""
    slow: NodeGrid
    """Nodes of faces whose balls are barely larger than those of slow ones."""
    fast: NodeGrid
    """The other nodes of faces."""
    renewed: NodeGrid
    """Nodes that were paired again in the last update."""
    tests: PairTests
    """Scratch: pairs that are tested together."""


def _new_pair_tests(capacity: int) -> PairTests:
    """Return no tests, with room for that many."""
    rows = filled(capacity) + WIDTH
    return PairTests(
        n=0,
        n_close=0,
        next=0,
        next_close=0,
        **{name: np.zeros(rows, np.int64) for name in ("pair", "close")},
        **{name: np.zeros((rows, 4), np.int64) for name in ("nodes", "close_nodes")},
        **{name: aligned(rows) for name in _NUMBERS},
        **{name: aligned(4 * rows).reshape(rows, 4) for name in ("foot", "push")},
    )


def new_near_pairs(n_nodes: int, n_faces: int, capacity: int) -> NearPairs:
    """Return no pairs.

    Args:
        n_nodes: Nodes of the body that there is room for.
        n_faces: Faces that there is room for.
        capacity: Pairs that there is room for.
    """
    of_faces = ("tetrahedron", "is_of_cut", "is_active", "dirty_at", "known_at")
    return NearPairs(
        first=0,
        n_pairs=0,
        n_nodes=0,
        n_moved=0,
        n_updates=1,
        changed_at=0,
        n_indexed=0,
        n_kept=0,
        n_found=0,
        **{name: np.zeros(n_nodes, np.int64) for name in _OF_NODES},
        triangle=np.zeros((n_faces, 3), np.int64),
        **{name: np.zeros(n_faces, np.int64) for name in of_faces},
        seen_generation=np.full(n_faces, -1, np.int64),
        face_begin=np.zeros(n_faces + 2, np.int64),
        of_face=np.zeros(capacity, np.int64),
        path=np.zeros(n_faces),
        displacement=np.zeros((n_faces, 3)),
        low=np.zeros((n_faces, 3)),
        high=np.zeros((n_faces, 3)),
        **{
            name: np.zeros(2 * capacity, np.int64)
            for name in ("node", "face", "is_near", "is_kept")
        },
        **{name: np.zeros(capacity, np.int64) for name in ("found_node", "found_face")},
        wake=np.zeros(2 * capacity),
        relative=np.zeros((2 * capacity, 3)),
        **_new_grids(n_nodes),
        tests=_new_pair_tests(capacity),
    )


def grown_near_pairs(pairs: NearPairs, n_nodes: int) -> NearPairs:
    """Return the pairs with room for `n_nodes` of the body."""
    larger = {name: grown(getattr(pairs, name), n_nodes) for name in _OF_NODES}
    return pairs.replaced(**larger, **_new_grids(n_nodes))


def _new_grids(n_nodes: int) -> dict[str, NodeGrid]:
    """Return empty grids for that many nodes."""
    return {name: new_node_grid(n_nodes) for name in ("slow", "fast", "renewed")}


@inlined
def know_motion(pairs: NearPairs, motion: NodeMotion, face: int) -> None:
    """Compute how far a face has moved, unless that was done in this search."""
    if pairs.known_at[face] == motion.frame:
        return
    pairs.known_at[face] = motion.frame
    path, d, third = motion.path, motion.displacement, 1.0 / 3.0
    a, b = natural(pairs.triangle[face, 0]), natural(pairs.triangle[face, 1])
    c = natural(pairs.triangle[face, 2])
    pairs.path[face] = path[a] + path[b] + path[c]
    for x in range(3):
        pairs.displacement[face, x] = third * (d[a, x] + d[b, x] + d[c, x])


@kernel
def sort_by_faces(pairs: NearPairs, n_faces: int) -> None:
    """Write the nodes that each of the first `n_faces` is paired with, unless that is done."""
    if pairs.n_indexed == pairs.n_updates:
        return
    pairs.n_indexed = pairs.n_updates
    begin, rows = pairs.face_begin, range(pairs.first, pairs.first + pairs.n_pairs)
    for at in range(n_faces + 2):
        begin[at] = 0
    for k in rows:
        begin[pairs.face[k] + 2] += 1
    for at in range(2, n_faces + 2):
        begin[at] += begin[at - 1]
    for k in rows:
        at = pairs.face[k]
        pairs.of_face[begin[at + 1]] = pairs.node[k]
        begin[at + 1] += 1
