"""Nodes that are inside another part of the body without a contact: found in turn, one a search.

A blade can drag a node through a face in one time step, or press it in so deep that its contact is
given up. Nothing would ever push it out again. A node that is found inside a tetrahedron which at
rest is far from it is paired with faces further above it, and is taken to be behind them; it comes
out as slowly as any overlap that had no force.
"""

import math

from tissue.contact.penalty.search_state import SearchState
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, sub, vec3
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import Body, local_index

_FAR_AT_REST = 2.0
"""Distance at rest beyond which a tetrahedron is another part of the body, per node size. Smaller:
nodes of elements that are folded are taken for lost."""

_LARGEST_TETRAHEDRON = 4.0
"""Distance from a corner up to which a tetrahedron is searched, per node size."""

_INSIDE = 0.02
"""Least barycentric weight of a node that is inside."""


@kernel
def look_for_lost_node(search: SearchState, body: Body) -> None:
    """Find out about the next node without a contact whether it is inside another part."""
    pairs = search.pairs
    node = -1
    for _ in range(pairs.n_nodes):
        search.turn = search.turn + 1 if search.turn + 1 < pairs.n_nodes else 0
        node = pairs.nodes[search.turn]
        if search.n_contacts[node] == 0 or pairs.is_lost[node] == 1:
            break
        node = -1
    if node < 0:
        return
    is_inside = _is_inside_another_part(search, body, node)
    if is_inside and pairs.is_lost[node] == 0:
        # No ball is as large as that, so the node is paired anew in the next search.
        search.ways.radius[node] = math.nan
    pairs.is_lost[node] = 1 if is_inside else 0


@kernel
def _is_inside_another_part(search: SearchState, body: Body, node: int) -> bool:
    """Whether a node is in a tetrahedron that at rest is far from it."""
    x, rest, size = body.positions, body.rest, search.ways.node_size
    p, p_rest = vec3(x, node), vec3(rest, node)
    near = (_LARGEST_TETRAHEDRON * size) ** 2
    far = (_FAR_AT_REST * size) ** 2
    for t in range(body.n_tetrahedra):
        corner = body.tetrahedra[t, 0]
        d = sub(vec3(x, corner), p)
        if not dot(d, d) < near:
            continue
        d = sub(vec3(rest, corner), p_rest)
        if dot(d, d) < far or local_index(body, t, node) >= 0:
            continue
        if smallest_weight(barycentric_in(p, x, body.tetrahedra, t)) > _INSIDE:
            return True
    return False
