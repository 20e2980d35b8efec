"""Pairs that may come to touch, and how far the body must move before each can.

A pair whose sides are d apart cannot touch before the displacements of the two add up to d. So each
pair notes when it must be tested again, twice: in terms of the largest displacement of all slow
nodes, which costs one comparison; and in terms of the paths of its own four nodes, where one of
them is fast (see `motion_bounds`).
"""

import numpy as np

from tissue.contact.point_triangle import RIM
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import eight_points, filled
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3

Nodes = tuple[int, int, int, int]
"""A node and the corners of a triangle, or the ends of two edges."""

CLOSING = 2.0 + 4.0 * RIM
"""By how much two sides come nearer at most for each metre that no node's path exceeds: each side
moves by that, and the rim of a triangle grows with the two edges that it is a share of."""

CLOSING_OF_NODES = 1.0 + 2.0 * RIM
"""By how much two sides come nearer at most for each metre that their four nodes move in sum."""


class Pairs(Arrays):
    """Pairs of one type: first those that are near, then those that are far; otherwise unordered.

    Near pairs are tested in every Runge-Kutta step, eight at a time. Far pairs sleep until they
    may touch.
    """

    n_near: IntCell
    """Number of near pairs."""
    n_pairs: IntCell
    """Number of pairs in all."""
    node: SlotArray
    """Nodes of each pair, see `Nodes`: the first of all, then the second, third and fourth of all,
    so that eight are read at a time; shape (4 * capacity,)."""
    item: IntArray
    """Node and place of a triangle, or two edges, as in `Candidates`; shape (capacity, 2)."""
    generation: IntArray
    """Sum of the generations of the two items when they were paired: generations only grow, so the
    pair is out of date where the sum is another. Shape (capacity,)."""
    wake: FloatArray
    """Horizon from which on the pair is to be tested [m], see `motion_bounds.horizon`; -inf where a
    node of it is fast. Shape (capacity,)."""
    wake_by_nodes: FloatArray
    """Path of its own nodes from which on the pair may touch [m], see `motion_bounds.can_touch`;
    shape (capacity,)."""


def new_pairs(capacity: int) -> Pairs:
    """Return no pairs, with room for `capacity`."""
    return Pairs(
        n_near=0,
        n_pairs=0,
        node=np.zeros(4 * filled(capacity), np.int32),
        item=np.zeros((capacity, 2), np.int64),
        generation=np.zeros(capacity, np.int64),
        wake=np.zeros(capacity),
        wake_by_nodes=np.zeros(capacity),
    )


@kernel
def clear_pairs(pairs: Pairs) -> None:
    """Remove all pairs."""
    pairs.n_near = 0
    pairs.n_pairs = 0


@kernel
def add_pair(pairs: Pairs, nodes: Nodes, first: int, second: int, generation: int) -> bool:
    """Add a pair, to be tested at once; return False if there is no room.

    Args:
        pairs: Written.
        nodes: Nodes of the pair.
        first: Node, or first edge.
        second: Place of the triangle, or second edge.
        generation: Sum of the generations of the two.
    """
    k = pairs.n_pairs
    if k == len(pairs.wake):
        return False
    for q in range(4):
        pairs.node[_place(pairs, k, q)] = nodes[q]
    pairs.item[k, 0] = first
    pairs.item[k, 1] = second
    pairs.generation[k] = generation
    pairs.wake[k] = -np.inf
    pairs.wake_by_nodes[k] = -np.inf
    pairs.n_pairs += 1
    return True


@kernel
def drop_pair(pairs: Pairs, k: int) -> None:
    """Remove pair `k`; another takes its place, a near one that of a near one."""
    if k < pairs.n_near:
        pairs.n_near -= 1
        _exchange(pairs, k, pairs.n_near)
        k = pairs.n_near
    pairs.n_pairs -= 1
    _exchange(pairs, k, pairs.n_pairs)


@kernel
def make_near(pairs: Pairs, k: int) -> None:
    """Move far pair `k` to the near ones; another takes its place."""
    _exchange(pairs, k, pairs.n_near)
    pairs.n_near += 1


@kernel
def make_far(pairs: Pairs, k: int) -> None:
    """Move near pair `k` to the far ones; another takes its place."""
    pairs.n_near -= 1
    _exchange(pairs, k, pairs.n_near)


@kernel
def _exchange(pairs: Pairs, i: int, j: int) -> None:
    """Exchange two pairs."""
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
    """Return row `k` of an array of nodes, shape (n, 4)."""
    return node[k, 0], node[k, 1], node[k, 2], node[k, 3]


@kernel
def _place(pairs: Pairs, k: int, q: int) -> int:
    """Return where node `q` of pair `k` is in `Pairs.node`."""
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
    """Return where the nodes `q` of pairs `k` to `k + 7` are [m]: each coordinate is `Lanes`."""
    x, y, z = eight_points(points, pairs.node, _place(pairs, k, q))
    return Vec3(x, y, z)
