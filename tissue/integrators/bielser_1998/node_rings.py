"""Rings of nodes around a focus, breadth-first along edges (paper, section 5.2 and Fig. 9)."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.elasticity.springs import Springs
from tissue.mesh.body import grown

UNREACHED = -1
"""Ring of a node that the last search did not reach."""


class Rings(Arrays):
    """The nodes that a search found. A new epoch forgets them, without clearing."""

    order: IntArray
    """Nodes, ring by ring, each in the order it was found; shape (capacity,)."""
    ring: IntArray
    """Smallest number of edges from each node to the focus, shape (capacity,); see `ring_of`."""
    seen: IntArray
    """Search that found each node last, shape (capacity,)."""
    n_found: IntCell
    """Number of nodes found."""
    epoch: IntCell
    """Number of the search."""


def new_rings(n_nodes: int) -> Rings:
    """Return rings with room for that many nodes."""
    return Rings(
        order=np.zeros(n_nodes, np.int64),
        ring=np.zeros(n_nodes, np.int64),
        seen=np.zeros(n_nodes, np.int64),
        n_found=0,
        epoch=0,
    )


def grown_rings(rings: Rings, n_nodes: int) -> Rings:
    """Return the rings with room for that many nodes."""
    of_nodes = ("order", "ring", "seen")
    return rings.replaced(**{name: grown(getattr(rings, name), n_nodes) for name in of_nodes})


@kernel
def begin_search(rings: Rings) -> None:
    """Start a new search, which has found nothing."""
    rings.n_found = 0
    rings.epoch += 1


@kernel
def add_focus(rings: Rings, node: int) -> None:
    """Make `node` part of the focus, ring 0; before `search`."""
    if rings.seen[node] != rings.epoch:
        append_node(rings, node, 0)


@kernel
def search(rings: Rings, springs: Springs, last_ring: int) -> None:
    """Find every node up to `last_ring` edges from the focus, at a cost of what is found."""
    at = 0
    while at < rings.n_found:
        node = rings.order[at]
        at += 1
        ring = rings.ring[node] + 1
        if ring > last_ring:
            return
        first = springs.first[node]
        for slot in range(first, first + springs.count[node]):
            other = springs.neighbour[slot]
            if rings.seen[other] != rings.epoch:
                append_node(rings, other, ring)


@kernel
def ring_of(rings: Rings, node: int) -> int:
    """Ring of a node, or UNREACHED."""
    return rings.ring[node] if rings.seen[node] == rings.epoch else UNREACHED


@kernel
def append_node(rings: Rings, node: int, ring: int) -> None:
    """Append a node to what was found."""
    rings.seen[node] = rings.epoch
    rings.ring[node] = ring
    rings.order[rings.n_found] = node
    rings.n_found += 1
