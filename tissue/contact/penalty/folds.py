"""Folds: skin that has come near skin of the same piece that is not beside it in the body at rest.

A thin wall folds before the blade, and a flap may fold over: such skin is far apart at rest. The
walls of a notch face each other at rest, however near they are. Both are asked for contacts; other
skin of one piece cannot touch itself, and costs nothing.
"""

import numpy as np

from tissue.contact.faces import Faces
from tissue.contact.node_normals import area_at_rest
from tissue.contact.penalty.cells import (
    Cells,
    cells_in,
    count_thing,
    end_count,
    lay_cells,
    new_cells,
    row_of,
    take_place,
)
from tissue.contact.penalty.node_ways import FLAT, FOLDED, NOTCHED, NodeWays
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, dot, norm, store, sub, vec3
from tissue.geometry.aabb import Aabb, empty_box, widened, with_point
from tissue.mesh.body import OUTER, Body, grown
from tissue.mesh.faces import OUTWARD

NEAR = 3.0
"""Distance between nodes of skin from which on it may be a fold, per node size. An edge of a
tetrahedron is two to three node sizes long, so that a node of either skin is that near before they
touch."""

APART = 8.0
"""Distance at rest above which it is a fold, per node size. Nodes that near are 6 node sizes apart
at rest where the tissue is squeezed to half its length."""

OPPOSITE = -0.5
"""Cosine between normals at rest up to which skin faces other skin: the walls of a notch of less
than 60 degrees. Larger: skin in the corners of a body is asked for nothing; smaller: the walls of
a wedge go through each other."""

WAY = 0.5
"""Way of a node after which folds are looked for again, per node size. Larger: two skins may be
inside each other before they are seen; smaller: each look at all skin takes its time."""

FARTHEST = 1.0
"""Way of a node [m] from which on the motion has diverged, and nothing is looked for."""


class Folds(Arrays):
    """Scratch of the search for folds; what it finds is `NodeWays.is_folded`."""

    n_known: IntCell
    """Number of nodes that were there when it was asked last whether to look."""
    n_skin: IntCell
    """Number of nodes of the skin."""
    n_folded: IntCell
    """Number of nodes of folds."""
    n_looks: IntCell
    """Number of searches."""
    reference: FloatArray
    """Where each node was in the last search [m], shape (node capacity, 3)."""
    seen_at: IntArray
    """Search that listed each node last, shape (node capacity,)."""
    skin: IntArray
    """The nodes of the skin, shape (node capacity,)."""
    sorted: IntArray
    """The same in the order of their cells, shape (node capacity,)."""
    outward: FloatArray
    """Normal at each node of the skin at rest, weighted by area [m2]; shape (node capacity, 3)."""
    cells: Cells


def new_folds(n_nodes: int) -> Folds:
    """Return no folds, with room for that many nodes."""
    return Folds(
        n_known=0,
        n_skin=0,
        n_folded=0,
        n_looks=0,
        reference=np.zeros((n_nodes, 3)),
        seen_at=np.zeros(n_nodes, np.int64),
        skin=np.zeros(n_nodes, np.int64),
        sorted=np.zeros(n_nodes, np.int64),
        outward=np.zeros((n_nodes, 3)),
        cells=new_cells(n_nodes),
    )


def grown_folds(folds: Folds, n_nodes: int) -> Folds:
    """Return the folds with room for `n_nodes`."""
    return folds.replaced(
        reference=grown(folds.reference, n_nodes),
        seen_at=grown(folds.seen_at, n_nodes),
        skin=np.zeros(n_nodes, np.int64),
        sorted=np.zeros(n_nodes, np.int64),
        outward=np.zeros((n_nodes, 3)),
        cells=new_cells(n_nodes),
    )


@kernel
def look_for_folds(folds: Folds, ways: NodeWays, faces: Faces, body: Body) -> bool:
    """Find the folds where a node has moved far since the last search; return if there are any.

    Args:
        folds: Scratch.
        ways: `is_folded` is written; where it changes, all skin is asked again whether it may
            touch.
        faces: The piece that each tetrahedron is in.
        body: Where the nodes are.
    """
    if _is_due(folds, body, WAY * ways.node_size):
        for node in range(body.n_nodes):
            store(folds.reference, node, vec3(body.positions, node))
        _sort_skin(folds, body, NEAR * ways.node_size)
        if _mark_folds(folds, ways, faces, body):
            ways.largest_way = np.inf
    return folds.n_folded > 0


@kernel
def _is_due(folds: Folds, body: Body, way: float) -> bool:
    """Whether a node has moved by more than `way` [m] since the last search, or it is the first."""
    is_first = folds.n_known == 0
    for node in range(folds.n_known, body.n_nodes):
        store(folds.reference, node, vec3(body.positions, node))
    folds.n_known = body.n_nodes
    most = 0.0
    for node in range(body.n_nodes):
        d = sub(vec3(body.positions, node), vec3(folds.reference, node))
        most = max(most, dot(d, d))
    return is_first or way * way < most < FARTHEST * FARTHEST


@kernel
def _sort_skin(folds: Folds, body: Body, edge: float) -> None:
    """List the nodes of the skin by cells of that edge [m], and find their normals at rest."""
    folds.n_looks += 1
    folds.n_skin = 0
    box = empty_box()
    for t in range(body.n_tetrahedra):
        for f in range(4):
            if body.links[t, f] != OUTER:
                continue
            i, j, k = OUTWARD[f, 0], OUTWARD[f, 1], OUTWARD[f, 2]
            a, b, c = body.tetrahedra[t, i], body.tetrahedra[t, j], body.tetrahedra[t, k]
            area = area_at_rest(body, a, b, c)
            for node in (a, b, c):
                if folds.seen_at[node] != folds.n_looks:
                    folds.seen_at[node] = folds.n_looks
                    folds.skin[folds.n_skin] = node
                    folds.n_skin += 1
                    box = with_point(box, vec3(body.positions, node))
                    store(folds.outward, node, Vec3(0.0, 0.0, 0.0))
                store(folds.outward, node, add(vec3(folds.outward, node), area))
    lay_cells(folds.cells, box, edge)
    for i in range(folds.n_skin):
        count_thing(folds.cells, i, vec3(body.positions, folds.skin[i]))
    end_count(folds.cells)
    for i in range(folds.n_skin):
        folds.sorted[take_place(folds.cells, i)] = folds.skin[i]


@kernel
def _mark_folds(folds: Folds, ways: NodeWays, faces: Faces, body: Body) -> bool:
    """Mark the nodes of folds; return whether any mark has changed."""
    has_changed = False
    folds.n_folded = 0
    for i in range(folds.n_skin):
        node = folds.skin[i]
        mark = _mark_of(folds, faces, body, node, ways.node_size)
        has_changed = has_changed or mark != ways.is_folded[node]
        ways.is_folded[node] = mark
        folds.n_folded += mark != FLAT
    return has_changed


@kernel
def _mark_of(folds: Folds, faces: Faces, body: Body, node: int, size: float) -> int:
    """Return FOLDED or NOTCHED where a node is near skin of its piece that may touch it, else FLAT.

    Args:
        folds: The nodes of the skin, in cells, and their normals.
        faces: The piece that each tetrahedron is in.
        body: Where the nodes are.
        node: The node.
        size: Mean node size [m].
    """
    p, rest, piece = vec3(body.positions, node), vec3(body.rest, node), _piece(faces, body, node)
    near, apart, mark, outward = NEAR * size, APART * size, FLAT, vec3(folds.outward, node)
    within = cells_in(folds.cells, widened(Aabb(p, p), near))
    for z in range(within.z0, within.z1 + 1):
        for y in range(within.y0, within.y1 + 1):
            begin, end = row_of(folds.cells, within, y, z)
            for i in range(begin, end):
                other = folds.sorted[i]
                # What they are at rest is asked first: most are beside each other.
                d = sub(vec3(body.rest, other), rest)
                is_across = _is_across_notch(outward, vec3(folds.outward, other), d)
                if not is_across and (mark == FOLDED or dot(d, d) <= apart * apart):
                    continue
                d = sub(vec3(body.positions, other), p)
                if dot(d, d) >= near * near or _are_apart(piece, _piece(faces, body, other)):
                    continue
                if is_across:
                    return NOTCHED
                mark = FOLDED
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
