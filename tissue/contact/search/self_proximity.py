"""Self-proximity: skin near skin of the same piece that is not next to it in the body at rest.

A thin wall bends over before the blade, and a flap may turn over: such skin is far apart at rest.
The walls of a notch face each other at rest, however near they are. Both are searched for contacts;
other skin of one piece cannot touch itself, and costs nothing.
"""

import numpy as np

from tissue.contact.geometry.faces import Faces, area_at_rest
from tissue.contact.search.node_grid import (
    Cells,
    cells_in,
    count_thing,
    end_count,
    lay_cells,
    new_cells,
    row_of,
    take_place,
)
from tissue.contact.search.node_motion import NO_PROXIMITY, NOTCH, PROXIMITY, NodeMotion
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, dot, norm, store, sub, vec3
from tissue.geometry.aabb import Aabb, empty_box, widened, with_point
from tissue.mesh.body import OUTER, Body, grown
from tissue.mesh.faces import OUTWARD

NEAR = 3.0
"""Distance between nodes of skin from which on it may be in self-proximity, per node size. An edge
of a tetrahedron is two to three node sizes long, so that a node of either skin is that near before
they touch."""

APART = 8.0
"""Distance at rest above which it is in self-proximity, per node size. Nodes that near are 6 node
sizes apart at rest where the tissue is squeezed to half its length."""

OPPOSITE = -0.5
"""Cosine between normals at rest up to which skin faces other skin: the walls of a notch of less
than 60 degrees. Larger: skin in the corners of a body is searched for nothing; smaller: the walls
of a wedge go through each other."""

_DISPLACEMENT = 0.5
"""Displacement of a node after which skin is searched again, per node size. Larger: two skins may
be inside each other before they are seen; smaller: each search of all skin takes its time."""

FARTHEST = 1.0
"""Displacement of a node [m] from which on the motion has diverged, and nothing is searched for."""


class SelfProximity(Arrays):
    """Scratch of the search for self-proximity; what it finds is `NodeMotion.self_proximity`."""

    n_known: IntCell
    """Number of nodes that were there when it was checked last whether a search is due."""
    n_skin: IntCell
    """Number of nodes of the skin."""
    n_near: IntCell
    """Number of nodes near skin of their own piece."""
    n_searches: IntCell
    """Number of searches."""
    reference: FloatArray
    """Where each node was in the last search [m], shape (node capacity, 3)."""
    seen_at: IntArray
    """Search that listed each node last, shape (node capacity,)."""
    skin: IntArray
    """The nodes of the skin, shape (node capacity,)."""
    sorted: IntArray
    """Nodes of the skin in the order of their cells, shape (node capacity,)."""
    outward: FloatArray
    """Normal at each node of the skin at rest, weighted by area [m2]; shape (node capacity, 3)."""
    cells: Cells


def new_self_proximity(n_nodes: int) -> SelfProximity:
    """Return no self-proximity, with room for that many nodes."""
    return SelfProximity(
        n_known=0,
        n_skin=0,
        n_near=0,
        n_searches=0,
        reference=np.zeros((n_nodes, 3)),
        seen_at=np.zeros(n_nodes, np.int64),
        skin=np.zeros(n_nodes, np.int64),
        sorted=np.zeros(n_nodes, np.int64),
        outward=np.zeros((n_nodes, 3)),
        cells=new_cells(n_nodes),
    )


def grown_self_proximity(proximity: SelfProximity, n_nodes: int) -> SelfProximity:
    """Return the scratch with room for `n_nodes`."""
    return proximity.replaced(
        reference=grown(proximity.reference, n_nodes),
        seen_at=grown(proximity.seen_at, n_nodes),
        skin=np.zeros(n_nodes, np.int64),
        sorted=np.zeros(n_nodes, np.int64),
        outward=np.zeros((n_nodes, 3)),
        cells=new_cells(n_nodes),
    )


@kernel
def find_self_proximity(
    proximity: SelfProximity, motion: NodeMotion, faces: Faces, body: Body
) -> bool:
    """Find skin near itself if a node has moved far since the last search; return if any is.

    Args:
        proximity: Scratch.
        motion: `self_proximity` is written; where it changes, all skin is tested again whether it
            may touch.
        faces: The piece that each tetrahedron is in.
        body: Where the nodes are.
    """
    if _is_due(proximity, body, _DISPLACEMENT * motion.node_size):
        for node in range(body.n_nodes):
            store(proximity.reference, node, vec3(body.positions, node))
        _sort_skin(proximity, body, NEAR * motion.node_size)
        if _mark_skin(proximity, motion, faces, body):
            motion.largest_path = np.inf
    return proximity.n_near > 0


@kernel
def _is_due(proximity: SelfProximity, body: Body, displacement: float) -> bool:
    """Whether a node has moved by more than that [m] since the last search, or it is the first."""
    is_first = proximity.n_known == 0
    for node in range(proximity.n_known, body.n_nodes):
        store(proximity.reference, node, vec3(body.positions, node))
    proximity.n_known = body.n_nodes
    most = 0.0
    for node in range(body.n_nodes):
        d = sub(vec3(body.positions, node), vec3(proximity.reference, node))
        most = max(most, dot(d, d))
    return is_first or displacement * displacement < most < FARTHEST * FARTHEST


@kernel
def _sort_skin(proximity: SelfProximity, body: Body, edge: float) -> None:
    """List the nodes of the skin by cells of that edge [m], and find their normals at rest."""
    proximity.n_searches += 1
    proximity.n_skin = 0
    box = empty_box()
    for t in range(body.n_tetrahedra):
        for f in range(4):
            if body.links[t, f] != OUTER:
                continue
            i, j, k = OUTWARD[f, 0], OUTWARD[f, 1], OUTWARD[f, 2]
            a, b, c = body.tetrahedra[t, i], body.tetrahedra[t, j], body.tetrahedra[t, k]
            area = area_at_rest(body, a, b, c)
            for node in (a, b, c):
                if proximity.seen_at[node] != proximity.n_searches:
                    proximity.seen_at[node] = proximity.n_searches
                    proximity.skin[proximity.n_skin] = node
                    proximity.n_skin += 1
                    box = with_point(box, vec3(body.positions, node))
                    store(proximity.outward, node, Vec3(0.0, 0.0, 0.0))
                store(proximity.outward, node, add(vec3(proximity.outward, node), area))
    lay_cells(proximity.cells, box, edge)
    for i in range(proximity.n_skin):
        count_thing(proximity.cells, i, vec3(body.positions, proximity.skin[i]))
    end_count(proximity.cells)
    for i in range(proximity.n_skin):
        proximity.sorted[take_place(proximity.cells, i)] = proximity.skin[i]


@kernel
def _mark_skin(proximity: SelfProximity, motion: NodeMotion, faces: Faces, body: Body) -> bool:
    """Mark the nodes near skin of their own piece; return whether any mark has changed."""
    has_changed = False
    proximity.n_near = 0
    for i in range(proximity.n_skin):
        node = proximity.skin[i]
        mark = _mark_of(proximity, faces, body, node, motion.node_size)
        has_changed = has_changed or mark != motion.self_proximity[node]
        motion.self_proximity[node] = mark
        proximity.n_near += mark != NO_PROXIMITY
    return has_changed


@kernel
def _mark_of(proximity: SelfProximity, faces: Faces, body: Body, node: int, size: float) -> int:
    """Return FOLDED or NOTCHED where a node is near skin of its piece that may touch it, else FLAT.

    Args:
        proximity: The nodes of the skin, in cells, and their normals.
        faces: The piece that each tetrahedron is in.
        body: Where the nodes are.
        node: The node.
        size: Mean node size [m].
    """
    p, rest, piece = vec3(body.positions, node), vec3(body.rest, node), _piece(faces, body, node)
    near, apart, mark, outward = (
        NEAR * size,
        APART * size,
        NO_PROXIMITY,
        vec3(proximity.outward, node),
    )
    within = cells_in(proximity.cells, widened(Aabb(p, p), near))
    for z in range(within.z0, within.z1 + 1):
        for y in range(within.y0, within.y1 + 1):
            begin, end = row_of(proximity.cells, within, y, z)
            for i in range(begin, end):
                other = proximity.sorted[i]
                # What they are at rest is compared first: most are next to each other.
                d = sub(vec3(body.rest, other), rest)
                is_across = _is_across_notch(outward, vec3(proximity.outward, other), d)
                if not is_across and (mark == PROXIMITY or dot(d, d) <= apart * apart):
                    continue
                d = sub(vec3(body.positions, other), p)
                if dot(d, d) >= near * near or _are_apart(piece, _piece(faces, body, other)):
                    continue
                if is_across:
                    return NOTCH
                mark = PROXIMITY
    return mark


@kernel
def _is_across_notch(normal: Vec3, other: Vec3, d: Vec3) -> bool:
    """Whether two nodes of skin face each other at rest, with nothing of the body between them.

    Args:
        normal: Normal of the one, of any length.
        other: Normal of the other.
        d: From the one to the other.
    """
    if not (dot(normal, d) > 0.0 and dot(other, d) < 0.0):
        return False
    return dot(normal, other) < OPPOSITE * norm(normal) * norm(other)


@kernel
def _piece(faces: Faces, body: Body, node: int) -> int:
    """Return the piece that a node is in, -1 where that is not known."""
    return int(faces.piece[body.node_tetrahedron[node]])


@kernel
def _are_apart(piece: int, other: int) -> bool:
    """Whether two pieces are known to be two."""
    return piece >= 0 and other >= 0 and piece != other
