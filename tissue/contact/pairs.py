"""Pairs that may come to touch, and how far the body must move before each can.

A pair whose sides are d apart cannot touch before the motion of the two adds up to d. So each pair
notes when it must be looked at again, twice over: in terms of the largest motion of any node that
moves little, which costs one comparison; and in terms of the ways of its own four nodes, where one
of them moves much.
"""

import numpy as np

from tissue.contact.point_triangle import RIM
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import eight_points, filled
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3

Nodes = tuple[int, int, int, int]
"""A node and the corners of a triangle, or the ends of two edges."""

CLOSING = 2.0 + 4.0 * RIM
"""How much two sides can come nearer for each metre that neither exceeds: each moves by that, and
the rim of a triangle grows with the two edges that it is a share of."""

CLOSING_OF_NODES = 1.0 + 2.0 * RIM
"""The same for each metre that their four nodes move in sum."""


N_NEAR, N_PAIRS = 0, 1
"""Places in `Pairs.counts`."""


class Pairs(Arrays):
    """Pairs of one kind: first those that are near, then the others; in no particular order."""

    node: SlotArray
    """Their nodes, see `Nodes`: the first of all, then the second, third and fourth of all, so that
    eight are read at a time; shape (4 * capacity,)."""
    item: IntArray
    """Node and place of a triangle, or two edges; shape (capacity, 2)."""
    generation: IntArray
    """Sum of the generations of the two when they were paired: what changes only grows, so that the
    pair is out of date where the sum is another. Shape (capacity,)."""
    wake: FloatArray
    """The pair need not be looked at while the body's horizon is below this [m]; shape (capacity,).
    Where a node of it moves much, it is -inf."""
    wake_by_nodes: FloatArray
    """... nor while that of its nodes is below this [m], shape (capacity,)."""
    counts: IntArray
    """How many are near, and how many there are in all; shape (2,)."""


def new_pairs(capacity: int) -> Pairs:
    """Return no pairs, with room for that many."""
    return Pairs(
        node=np.zeros(4 * filled(capacity), np.int32),
        item=np.zeros((capacity, 2), np.int64),
        generation=np.zeros(capacity, np.int64),
        wake=np.zeros(capacity),
        wake_by_nodes=np.zeros(capacity),
        counts=np.zeros(2, np.int64),
    )


@kernel
def add_pair(pairs: Pairs, nodes: Nodes, first: int, second: int, generation: int) -> bool:
    """Add a pair, to be looked at at once; return False if there is no room."""
    k = pairs.counts[N_PAIRS]
    if k == len(pairs.wake):
        return False
    for q in range(4):
        pairs.node[_place(pairs, k, q)] = nodes[q]
    pairs.item[k, 0] = first
    pairs.item[k, 1] = second
    pairs.generation[k] = generation
    pairs.wake[k] = -np.inf
    pairs.wake_by_nodes[k] = -np.inf
    pairs.counts[N_PAIRS] += 1
    return True


@kernel
def drop_pair(pairs: Pairs, k: int) -> None:
    """Leave out pair `k`; another takes its place, a near one that of a near one."""
    counts = pairs.counts
    if k < counts[N_NEAR]:
        counts[N_NEAR] -= 1
        _exchange(pairs, k, counts[N_NEAR])
        k = counts[N_NEAR]
    counts[N_PAIRS] -= 1
    _exchange(pairs, k, counts[N_PAIRS])


@kernel
def make_near(pairs: Pairs, k: int) -> None:
    """Let pair `k` be among those that are looked at always; another takes its place."""
    _exchange(pairs, k, pairs.counts[N_NEAR])
    pairs.counts[N_NEAR] += 1


@kernel
def make_far(pairs: Pairs, k: int) -> None:
    """Let pair `k` sleep; another takes its place."""
    pairs.counts[N_NEAR] -= 1
    _exchange(pairs, k, pairs.counts[N_NEAR])


@kernel
def _exchange(pairs: Pairs, i: int, j: int) -> None:
    node, item, generation = pairs.node, pairs.item, pairs.generation
    for q in range(4):
        first, second = _place(pairs, i, q), _place(pairs, j, q)
        node[first], node[second] = node[second], node[first]
    for q in range(2):
        item[i, q], item[j, q] = item[j, q], item[i, q]
    generation[i], generation[j] = generation[j], generation[i]
    for wake in (pairs.wake, pairs.wake_by_nodes):
        wake[i], wake[j] = wake[j], wake[i]


@kernel
def nodes_of(node: IntArray, k: int) -> Nodes:
    """Return row `k`."""
    return node[k, 0], node[k, 1], node[k, 2], node[k, 3]


@kernel
def _place(pairs: Pairs, k: int, q: int) -> int:
    """Where node `q` of pair `k` is in `Pairs.node`."""
    return q * (len(pairs.node) // 4) + k


@kernel
def nodes_of_pair(pairs: Pairs, k: int) -> Nodes:
    """Return the nodes of pair `k`."""
    node = pairs.node
    return (
        int(node[_place(pairs, k, 0)]),
        int(node[_place(pairs, k, 1)]),
        int(node[_place(pairs, k, 2)]),
        int(node[_place(pairs, k, 3)]),
    )


@inlined
def eight_corners(points: FloatArray, pairs: Pairs, k: int, q: int) -> Vec3:
    """Return where the nodes `q` of pairs `k` to `k + 7` are: each coordinate is `Lanes`."""
    x, y, z = eight_points(points, pairs.node, _place(pairs, k, q))
    return Vec3(x, y, z)


class Hits(Arrays):
    """Pairs of which one side went through the other."""

    node: IntArray
    """See `Nodes`; shape (capacity, 4)."""
    face: IntArray
    """Places of the faces of both, in `Faces`; shape (capacity, 2)."""
    count: IntArray
    """Shape (1,)."""


def new_hits(capacity: int) -> Hits:
    """Return none, with room for that many."""
    return Hits(
        node=np.zeros((capacity, 4), np.int64),
        face=np.zeros((capacity, 2), np.int64),
        count=np.zeros(1, np.int64),
    )


@kernel
def add_hit(hits: Hits, nodes: Nodes, face: int, other: int) -> None:
    """Add a pair, of faces in these places."""
    k = hits.count[0]
    for q in range(4):
        hits.node[k, q] = nodes[q]
    hits.face[k, 0] = face
    hits.face[k, 1] = other
    hits.count[0] += 1


@kernel
def sort_hits(hits: Hits) -> None:
    """Put them in the order of their nodes, whatever the order in which they were found (Shell)."""
    n = hits.count[0]
    step = 1
    while step < n // 3:
        step = 3 * step + 1
    while step > 0:
        for i in range(step, n):
            moved, face, other = nodes_of(hits.node, i), hits.face[i, 0], hits.face[i, 1]
            j = i
            while j >= step and nodes_of(hits.node, j - step) > moved:
                _put(hits, j, nodes_of(hits.node, j - step))
                hits.face[j, 0] = hits.face[j - step, 0]
                hits.face[j, 1] = hits.face[j - step, 1]
                j -= step
            _put(hits, j, moved)
            hits.face[j, 0] = face
            hits.face[j, 1] = other
        step //= 3


@kernel
def _put(hits: Hits, k: int, nodes: Nodes) -> None:
    for q in range(4):
        hits.node[k, q] = nodes[q]
