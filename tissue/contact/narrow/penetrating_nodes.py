"""Nodes that are inside another part of the body without a contact, found by its tetrahedra.

A blade can drag a node through a face in one time step, or press it in so deep that its contact is
given up. Nothing would ever push it out again. Each search takes some tetrahedra, in turn. A
node that is inside one is paired with faces further above it, and is taken to be behind those that
it is not behind in the body at rest; it comes out as slowly as any overlap that had no force.
"""

import math

from tissue.contact.search.node_grid import NodeGrid, find_in_box
from tissue.contact.search.node_motion import BALL
from tissue.contact.search.search_state import SearchState
from tissue.core.jit import kernel
from tissue.core.vec3 import cross, dot, sub, vec3
from tissue.geometry.aabb import Aabb, overlap, widened, with_point
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import Body, local_index

_TETRAHEDRA_A_SEARCH = 32
"""Tetrahedra of one search. More: penetrating nodes are found sooner than within
the 0.2 s that some 6,000 take, and each time step costs more."""

_LARGEST_TETRAHEDRON = 8.0
"""Extent along an axis up to which a tetrahedron is searched, per node size. Larger: where a
mesh is graded, one search takes as long as many."""

_INSIDE = 0.02
"""Least barycentric weight of a node that is inside."""


@kernel
def find_penetrating_nodes(search: SearchState, body: Body) -> None:
    """Search the next tetrahedra for penetrating nodes; after the last, unmark those not found."""
    for _ in range(min(_TETRAHEDRA_A_SEARCH, body.n_tetrahedra)):
        if search.turn >= body.n_tetrahedra:
            _forget_others(search)
            search.turn = 0
            search.n_rounds += 1
        _search_tetrahedron(search, body, search.turn)
        search.turn += 1


@kernel
def _forget_others(search: SearchState) -> None:
    """Unmark the nodes that no tetrahedron contained in this round."""
    pairs = search.pairs
    for i in range(pairs.n_nodes):
        node = pairs.nodes[i]
        if pairs.is_penetrating[node] == 1 and pairs.found_in[node] != search.n_rounds:
            pairs.is_penetrating[node] = 0


@kernel
def _search_tetrahedron(search: SearchState, body: Body, t: int) -> None:
    """Find the nodes of faces that penetrate tetrahedron `t`."""
    x, motion = body.positions, search.motion
    a, b = vec3(x, body.tetrahedra[t, 0]), vec3(x, body.tetrahedra[t, 1])
    c, d = vec3(x, body.tetrahedra[t, 2]), vec3(x, body.tetrahedra[t, 3])
    box = with_point(with_point(with_point(Aabb(a, a), b), c), d)
    if not dot(cross(sub(b, a), sub(c, a)), sub(d, a)) > 0.0:
        return
    extent = sub(box.high, box.low)
    largest = _LARGEST_TETRAHEDRON * motion.node_size
    # Of numbers that are not finite this is not true, either.
    if not (extent.x < largest and extent.y < largest and extent.z < largest):
        return
    _find_penetrating(search, body, search.pairs.slow, box, t)
    _find_penetrating(search, body, search.pairs.fast, box, t)


@kernel
def _find_penetrating(search: SearchState, body: Body, grid: NodeGrid, box: Aabb, t: int) -> None:
    """Find the nodes of a grid that penetrate tetrahedron `t`, which is in `box`."""
    size = search.motion.node_size
    for i in range(find_in_box(grid, widened(box, BALL * size), size)):
        node = grid.found[i]
        p = vec3(body.positions, node)
        if overlap(box, Aabb(p, p)) and _is_penetrating(search, body, node, t):
            _mark_penetrating(search, node)


@kernel
def _is_penetrating(search: SearchState, body: Body, node: int, t: int) -> bool:
    """Whether a node without a contact is in a tetrahedron that is not its own.

    Where no tetrahedron is inside out, only parts that overlap have such nodes.
    """
    if search.n_contacts[node] > 0 and search.pairs.is_penetrating[node] == 0:
        return False
    if search.inverted_step[node] == search.step or local_index(body, t, node) >= 0:
        return False
    x = body.positions
    return smallest_weight(barycentric_in(vec3(x, node), x, body.tetrahedra, t)) > _INSIDE


@kernel
def _mark_penetrating(search: SearchState, node: int) -> None:
    """Mark a node as penetrating, so that it is paired with faces further off."""
    pairs = search.pairs
    pairs.found_in[node] = search.n_rounds
    if pairs.is_penetrating[node] == 0:
        pairs.is_penetrating[node] = 1
        # No ball is as large as that, so the node is paired again in the next search.
        search.motion.radius[node] = math.nan
