"""Connected components of a graph, by disjoint sets with path halving.

Source: Tarjan and van Leeuwen, "Worst-case analysis of set union algorithms", J. ACM 31 (1984).
"""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel


def components(n: int, pairs: IntArray) -> tuple[int, IntArray]:
    """Return the number of components, and that of each vertex.

    Args:
        n: Number of vertices.
        pairs: Vertices that are joined, shape (n_pairs, 2).

    Returns:
        How many components there are, and for each vertex its component, shape (n,). They are
        numbered in the order of their lowest vertices.
    """
    parent = np.arange(n)
    _join(parent, np.ascontiguousarray(pairs))
    labels = np.cumsum(parent == np.arange(n)) - 1  # a root is the lowest vertex of its set
    return int(labels[-1]) + 1 if n else 0, labels[parent]


@kernel
def _root(parent: IntArray, vertex: int) -> int:
    """Return the root of the set that holds `vertex`, and shorten the path to it."""
    while parent[vertex] != vertex:
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


@kernel
def _join(parent: IntArray, pairs: IntArray) -> None:
    """Join the sets of each pair; afterwards each vertex's parent is its root."""
    for k in range(len(pairs)):
        a, b = _root(parent, pairs[k, 0]), _root(parent, pairs[k, 1])
        if a < b:
            parent[b] = a
        else:
            parent[a] = b
    for vertex in range(len(parent)):
        parent[vertex] = _root(parent, vertex)
