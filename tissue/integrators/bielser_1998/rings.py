"""Rings of nodes around the tip of the blade, breadth-first along edges (section 5.2, Fig. 9)."""

import numpy as np

from tissue.blade.blade_state import BladeState
from tissue.blade.edge_anchors import ANCHORED, holding_node, n_holding_nodes
from tissue.blade.spine_contact import PRESSING
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.elasticity.springs import Springs
from tissue.mesh.body import Body, grown

N_CORNERS = 4
"""Nodes of a tetrahedron."""

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


@kernel
def find_held(held: Rings, body: Body, blade: BladeState) -> None:
    """Make the nodes that the blade acts on ring 0 of `held`.

    The nodes of the anchor nearest to the tip come first. Without any, `held` stays as it was.
    """
    anchors, sides, spine = blade.anchors, blade.sides, blade.spine
    n = 0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            if n == 0:
                begin_search(held)
            n += 1
            for i in range(n_holding_nodes(anchors, k)):
                add_focus(held, holding_node(anchors, body, k, i))
    for i in range(sides.n_faces):
        if n == 0:
            begin_search(held)
        n += 1
        for corner in range(3):
            add_focus(held, sides.node[i, corner])
    if spine.n_pressing > 0:
        for k in range(len(spine.state)):
            if spine.state[k] >= PRESSING:
                if n == 0:
                    begin_search(held)
                n += 1
                for q in range(N_CORNERS):
                    add_focus(held, body.tetrahedra[spine.tetrahedron[k], q])


@kernel
def find_rings(
    rings: Rings, held: Rings, springs: Springs, last_ring: int, scratch: IntArray
) -> None:
    """Find the rings around the tip of the blade: the active point tetrahedron is the focus.

    The other nodes that the blade holds, along its edge, are put into ring 0 as well, so that all
    of them are at the same instant whenever it pulls on them; but no rings grow around them.

    Args:
        rings: Written.
        held: The nodes that `find_held` found.
        springs: The rows of neighbours.
        last_ring: Last ring of the search.
        scratch: Shape (capacity,).
    """
    begin_search(rings)
    for k in range(min(N_CORNERS, held.n_found)):
        add_focus(rings, held.order[k])
    search(rings, springs, last_ring)
    n = rings.n_found
    for k in range(n):
        scratch[k] = rings.order[k]
    rings.n_found = 0
    for k in range(held.n_found):
        append_node(rings, held.order[k], 0)
    for k in range(n):
        if rings.ring[scratch[k]] > 0:
            append_node(rings, scratch[k], rings.ring[scratch[k]])
    _append_neighbours(rings, held, springs, last_ring)


@kernel
def _append_neighbours(rings: Rings, held: Rings, springs: Springs, last_ring: int) -> None:
    """Append the neighbours of held nodes that were beyond the last ring."""
    for k in range(held.n_found):
        first = springs.first[held.order[k]]
        for slot in range(first, first + springs.count[held.order[k]]):
            other = springs.neighbour[slot]
            if rings.seen[other] != rings.epoch:
                append_node(rings, other, last_ring)
