"""Rings of nodes around a focus, breadth-first along edges (paper, section 5.2 and Fig. 9)."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.elasticity.springs import Springs
from tissue.mesh.body import grown

N_FOUND, EPOCH = 0, 1
"""Places in `Rings.state`."""

UNREACHED = -1
"""Ring of a node that the last search did not come to."""


class Rings(Arrays):
    """What a search found. A new search forgets the last without clearing: it has a new epoch."""

    order: IntArray
    """Nodes, ring by ring, each in the order it was found; shape (capacity,)."""
    ring: IntArray
    """Edges from each node to the focus at least, shape (capacity,); see `ring_of`."""
    seen: IntArray
    """Search that found each node last, shape (capacity,)."""
    state: IntArray
    """How many nodes were found, and the number of the search; shape (2,)."""


def new_rings(n_nodes: int) -> Rings:
    """Return rings with room for that many nodes."""
    return Rings(
        order=np.zeros(n_nodes, np.int64),
        ring=np.zeros(n_nodes, np.int64),
        seen=np.zeros(n_nodes, np.int64),
        state=np.zeros(2, np.int64),
    )


def grown_rings(rings: Rings, n_nodes: int) -> Rings:
    """Return the rings with room for that many nodes."""
    of_nodes = ("order", "ring", "seen")
    return rings.replaced(**{name: grown(getattr(rings, name), n_nodes) for name in of_nodes})


@kernel
def begin_search(rings: Rings) -> None:
    """Forget what was found."""
    rings.state[N_FOUND] = 0
    rings.state[EPOCH] += 1


@kernel
def add_focus(rings: Rings, node: int) -> None:
    """Make `node` part of the focus, ring 0; before `search`."""
    if rings.seen[node] != rings.state[EPOCH]:
        _take(rings, node, 0)


@kernel
def search(rings: Rings, springs: Springs, last_ring: int) -> None:
    """Find every node up to `last_ring` edges from the focus, at a cost of what is found."""
    at = 0
    while at < rings.state[N_FOUND]:
        node = rings.order[at]
        at += 1
        ring = rings.ring[node] + 1
        if ring > last_ring:
            return
        first = springs.first[node]
        for slot in range(first, first + springs.count[node]):
            other = springs.neighbour[slot]
            if rings.seen[other] != rings.state[EPOCH]:
                _take(rings, other, ring)


@kernel
def ring_of(rings: Rings, node: int) -> int:
    """Ring of a node, or UNREACHED."""
    return rings.ring[node] if rings.seen[node] == rings.state[EPOCH] else UNREACHED


@kernel
def _take(rings: Rings, node: int, ring: int) -> None:
    rings.seen[node] = rings.state[EPOCH]
    rings.ring[node] = ring
    rings.order[rings.state[N_FOUND]] = node
    rings.state[N_FOUND] += 1
