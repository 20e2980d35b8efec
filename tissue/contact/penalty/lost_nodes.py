"""Nodes that are inside another part of the body without a contact, found by its tetrahedra.

A blade can drag a node through a face in one time step, or press it in so deep that its contact is
given up. Nothing would ever push it out again. Each search looks into some tetrahedra, in turn. A
node that is inside one is paired with faces further above it, and is taken to be behind those that
it is not behind in the body at rest; it comes out as slowly as any overlap that had no force.
"""

import math

from tissue.contact.penalty.node_grid import NodeGrid, find_in_box
from tissue.contact.penalty.node_ways import BALL
from tissue.contact.penalty.search_state import SearchState
from tissue.core.jit import kernel
from tissue.core.vec3 import cross, dot, sub, vec3
from tissue.geometry.aabb import Aabb, overlap, widened, with_point
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import Body, local_index

_TETRAHEDRA_A_SEARCH = 32
"""Tetrahedra that are looked into in one search. More: lost nodes are found sooner than within the
0.2 s that it takes to look into some 6,000, and each time step costs more."""

_LARGEST_TETRAHEDRON = 8.0
"""Extent along an axis up to which a tetrahedron is looked into, per node size. Larger: where a
mesh is graded, one search takes as long as many."""

_INSIDE = 0.02
"""Least barycentric weight of a node that is inside."""


@kernel
def look_for_lost_nodes(search: SearchState, body: Body) -> None:
    """Look into the next tetrahedra for lost nodes; after the last, forget who was not found."""
    for _ in range(min(_TETRAHEDRA_A_SEARCH, body.n_tetrahedra)):
        if search.turn >= body.n_tetrahedra:
            _forget_others(search)
            search.turn = 0
            search.n_rounds += 1
        _look_into(search, body, search.turn)
        search.turn += 1


@kernel
def _forget_others(search: SearchState) -> None:
    """Forget that nodes were lost which no tetrahedron contained in this round."""
    pairs = search.pairs
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        if pairs.is_lost[node] == 1 and pairs.found_in[node] != search.n_rounds:
            pairs.is_lost[node] = 0


@kernel
def _look_into(search: SearchState, body: Body, t: int) -> None:
    """Find the nodes of faces that are lost in tetrahedron `t`."""
    x, ways = body.positions, search.ways
    a, b = vec3(x, body.tetrahedra[t, 0]), vec3(x, body.tetrahedra[t, 1])
    c, d = vec3(x, body.tetrahedra[t, 2]), vec3(x, body.tetrahedra[t, 3])
    box = with_point(with_point(with_point(Aabb(a, a), b), c), d)
    if not dot(cross(sub(b, a), sub(c, a)), sub(d, a)) > 0.0:
        return
    extent = sub(box.high, box.low)
    largest = _LARGEST_TETRAHEDRON * ways.node_size
    # Of numbers that are not finite this is not true, either.
    if not (extent.x < largest and extent.y < largest and extent.z < largest):
        return
    _find_lost(search, body, search.pairs.slow, box, t)
    _find_lost(search, body, search.pairs.fast, box, t)


@kernel
def _find_lost(search: SearchState, body: Body, grid: NodeGrid, box: Aabb, t: int) -> None:
    """Find the nodes of a grid that are lost in tetrahedron `t`, which is in `box`."""
    size = search.ways.node_size
    for i in range(find_in_box(grid, widened(box, BALL * size), size)):
        node = grid.found[i]
        p = vec3(body.positions, node)
        if overlap(box, Aabb(p, p)) and _is_lost_in(search, body, node, t):
            _note_lost(search, node)


@kernel
def _is_lost_in(search: SearchState, body: Body, node: int, t: int) -> bool:
    """Whether a node without a contact is in a tetrahedron that is not its own.

    Where no tetrahedron is inside out, only parts that overlap have such nodes.
    """
    if search.n_contacts[node] > 0 and search.pairs.is_lost[node] == 0:
        return False
    if search.inverted_step[node] == search.step or local_index(body, t, node) >= 0:
        return False
    x = body.positions
    return smallest_weight(barycentric_in(vec3(x, node), x, body.tetrahedra, t)) > _INSIDE


@kernel
def _note_lost(search: SearchState, node: int) -> None:
    """Note that a node is lost, so that it is paired with faces further off."""
    pairs = search.pairs
    pairs.found_in[node] = search.n_rounds
    if pairs.is_lost[node] == 0:
        pairs.is_lost[node] = 1
        # No ball is as large as that, so the node is paired anew in the next search.
        search.ways.radius[node] = math.nan
