"""`Looks`: the pairs of node and face that a search looks at, gone through eight at a time."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.simd import WIDTH, aligned, filled
from tissue.core.structs import Arrays, IntCell

_NUMBERS = ("is_held", "highest", "deepest", "size_of_normal", "way", "wake", "left", "distance")


class Looks(Arrays):
    """Pairs that are due, node by node, and those of them that are so close that they may touch.

    There are rows behind the last to fill eight. They hold what earlier looks left, or 0: what is
    computed from it is not read.
    """

    n: IntCell
    """Number of looks."""
    n_close: IntCell
    """Number of close ones."""
    next: IntCell
    """The look whose result is to be taken next."""
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
    way: FloatArray
    """Sum of the ways of the four nodes of each [m], shape (capacity,)."""
    wake: FloatArray
    """That sum up to which the pair needs no other look [m], shape (capacity,)."""
    left: FloatArray
    """How much way is left before that at least [m], shape (capacity,)."""
    close: IntArray
    """Number of each close look, shape (capacity,)."""
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


def new_looks(capacity: int) -> Looks:
    """Return no looks, with room for that many."""
    rows = filled(capacity) + WIDTH
    return Looks(
        n=0,
        n_close=0,
        next=0,
        next_close=0,
        **{name: np.zeros(rows, np.int64) for name in ("pair", "close")},
        **{name: np.zeros((rows, 4), np.int64) for name in ("nodes", "close_nodes")},
        **{name: aligned(rows) for name in _NUMBERS},
        **{name: aligned(4 * rows).reshape(rows, 4) for name in ("foot", "push")},
    )
