"""The star of a node or an edge: the tetrahedra around it, which are connected through faces."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.geometry.tetrahedron import node_altitude
from tissue.mesh.body import Body, local_index
from tissue.mesh.nonconforming import listed_tetrahedra

LARGEST_STAR = 4096
"""Tetrahedra around one node at most. Ordinary meshes have 24 on average and 60 at most."""


class Visits(Arrays):
    """Tetrahedra and nodes that a search has visited. A new epoch forgets all, without clearing."""

    epoch: IntCell
    """Number of the current search."""
    is_full: IntCell
    """1 if there were more than `LARGEST_STAR` tetrahedra around a node, else 0."""
    tetrahedra: IntArray = sized("tetrahedra")
    """Search that visited each tetrahedron last, shape (capacity,)."""
    nodes: IntArray = sized("nodes")
    """Search that visited each node last, shape (capacity,)."""
    place: IntArray = sized("nodes")
    """Index of each node in a list of that search, shape (capacity,)."""


def no_visits(n_nodes: int, n_tetrahedra: int) -> Visits:
    """Return visits for that many nodes and tetrahedra."""
    return Visits.new({"nodes": n_nodes, "tetrahedra": n_tetrahedra})


@kernel
def star(body: Body, visits: Visits, node: int, start: int, out: IntArray) -> int:
    """Write the tetrahedra around `node` that are connected to `start` to `out`; return how many.

    They come in breadth-first order, `start` first. Where nodes may hang, the list of `node` is
    written instead.

    Args:
        body: The body.
        visits: For the search.
        node: The node.
        start: A tetrahedron around it.
        out: Written, shape (LARGEST_STAR,).
    """
    visits.epoch += 1
    epoch = visits.epoch
    if len(body.hanging.first) > 0:
        return _listed(body, visits, node, out)
    visits.tetrahedra[start] = epoch
    out[0] = start
    n = 1
    i = 0
    while i < n:
        t = out[i]
        i += 1
        for f in range(4):
            if body.tetrahedra[t, f] == node:
                continue
            link = body.links[t, f]
            if link < 0:
                continue
            other = link // 4
            if visits.tetrahedra[other] != epoch:
                if n == LARGEST_STAR:
                    visits.is_full = 1
                    return n
                visits.tetrahedra[other] = epoch
                out[n] = other
                n += 1
    return n


@kernel
def _listed(body: Body, visits: Visits, node: int, out: IntArray) -> int:
    n = listed_tetrahedra(body.hanging, node, out, LARGEST_STAR)
    if n == LARGEST_STAR:
        visits.is_full = 1
    for i in range(n):
        visits.tetrahedra[out[i]] = visits.epoch
    return n


@kernel
def edge_star(body: Body, visits: Visits, a: int, b: int, out: IntArray) -> int:
    """Write the tetrahedra around edge ab to `out`; return how many.

    They are the part of the star of `a` that holds `b`: at the rim of a cut an edge can have two
    fans of tetrahedra, which a walk around the edge would not find.

    Args:
        body: The body.
        visits: For the search.
        a: First node of the edge.
        b: Second node.
        out: Written, shape (LARGEST_STAR,).
    """
    n = star(body, visits, a, body.node_tetrahedron[a], out)
    kept = 0
    for i in range(n):
        if local_index(body, out[i], b) >= 0:
            out[kept] = out[i]
            kept += 1
    return kept


@kernel
def node_size(body: Body, visits: Visits, node: int, out: IntArray) -> float:
    """Return the smallest altitude from `node` over the tetrahedra around it, at rest [m]."""
    n = star(body, visits, node, body.node_tetrahedron[node], out)
    size = np.inf
    for i in range(n):
        t = out[i]
        k = local_index(body, t, node)
        h = node_altitude(body.rest, body.tetrahedra, t, k)
        size = min(size, h)
    return size


@kernel
def mean_node_size(body: Body, visits: Visits, out: IntArray) -> float:
    """Return the mean over all nodes of `node_size` [m]."""
    total = 0.0
    for node in range(body.n_nodes):
        total += node_size(body, visits, node, out)
    return total / body.n_nodes


@kernel
def sorted_star(body: Body, visits: Visits, node: int, out: IntArray) -> int:
    """Write the tetrahedra around `node` to `out` in order of their numbers; return how many.

    Sums over a star must not depend on where the search began, or action would not quite be
    reaction.
    """
    n = star(body, visits, node, body.node_tetrahedron[node], out)
    for i in range(1, n):  # insertion sort: stars are short
        t = out[i]
        j = i
        while j > 0 and out[j - 1] > t:
            out[j] = out[j - 1]
            j -= 1
        out[j] = t
    return n
