"""`Hits`: the pairs of which one side went through the other in a Runge-Kutta step."""

import numpy as np

from tissue.contact.pairs import Nodes, nodes_of
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell


class Hits(Arrays):
    """Pairs of one type of which one side went through the other."""

    n_hits: IntCell
    """Number of hits."""
    node: IntArray
    """Nodes of each pair, see `pairs.Nodes`; shape (capacity, 4)."""
    face: IntArray
    """Places of the faces of both sides in `Faces`, shape (capacity, 2)."""


def new_hits(capacity: int) -> Hits:
    """Return no hits, with room for `capacity`."""
    return Hits(
        n_hits=0, node=np.zeros((capacity, 4), np.int64), face=np.zeros((capacity, 2), np.int64)
    )


@kernel
def add_hit(hits: Hits, nodes: Nodes, face: int, other: int) -> None:
    """Add a pair, of the faces in places `face` and `other`."""
    k = hits.n_hits
    _write_nodes(hits, k, nodes)
    hits.face[k, 0] = face
    hits.face[k, 1] = other
    hits.n_hits += 1


@kernel
def sort_hits(hits: Hits) -> None:
    """Sort hits by their nodes (Shell), whatever the order in which they were found."""
    n = hits.n_hits
    step = 1
    while step < n // 3:
        step = 3 * step + 1
    while step > 0:
        for i in range(step, n):
            moved, face, other = nodes_of(hits.node, i), hits.face[i, 0], hits.face[i, 1]
            j = i
            while j >= step and nodes_of(hits.node, j - step) > moved:
                _write_nodes(hits, j, nodes_of(hits.node, j - step))
                hits.face[j, 0] = hits.face[j - step, 0]
                hits.face[j, 1] = hits.face[j - step, 1]
                j -= step
            _write_nodes(hits, j, moved)
            hits.face[j, 0] = face
            hits.face[j, 1] = other
        step //= 3


@kernel
def _write_nodes(hits: Hits, k: int, nodes: Nodes) -> None:
    """Write the nodes of hit `k`."""
    for q in range(4):
        hits.node[k, q] = nodes[q]
