"""Broad phase: the pairs of node and triangle, and of edge and edge, that may come to touch.

Only faces of cuts and skin near another piece are looked at (see `faces`). Each node has a place of
reference; pairs are found with a margin around those places, and hold until one of their nodes has
left its own by half the margin, or the mesh around it has changed. Only what did so is sought anew:
a cut, or a lip that the blade drags along, costs its neighbourhood and not the body.
"""

import math

import numpy as np

from tissue.contact.distance import distance_of_edges, distance_to_triangle
from tissue.contact.edge_edge import Edges
from tissue.contact.faces import (
    N_FACES,
    NONE,
    Faces,
    is_cut,
    may_touch,
    measure_pieces,
)
from tissue.contact.feature_edges import across, is_ridge
from tissue.contact.motion_bounds import Motion, begin_motion
from tissue.contact.pairs import CLOSING, N_PAIRS, Pairs, add_pair, drop_pair, new_pairs
from tissue.contact.point_triangle import RIM, Corners
from tissue.contact.spatial_hash import (
    Box,
    Grid,
    Search,
    boxes_near,
    clear_grid,
    new_grid,
    new_search,
)
from tissue.contact.spatial_hash import put as put_in
from tissue.contact.spatial_hash import take as take_out
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, dot, store, sub, vec3
from tissue.mesh.body import Body, grown
from tissue.mesh.faces import OUTWARD

N_NODES, N_DIRTY, N_UPDATES = 0, 1, 2
"""Places in `Candidates.counts`."""

FARTHEST = 1.0
"""A node that moves farther in one Runge-Kutta step [m] belongs to a body that has exploded, of
which nothing is asked; its cells could not be counted."""

WAY_OF_PIECES = 4.0
"""How far nodes may go before it is looked at again which skin is near another piece, in margins.
Larger: more skin is looked at; smaller: more looks at all of it."""

OUT, IN = 0, 1
"""Whether a face is looked at: see `Candidates.state`."""


class Candidates(Arrays):
    """What may touch, and the pairs. Faces go by their places in `Faces`, edges by 3 * place + k.

    An edge belongs to the face that has it from its lower node to its higher. Of cuts, only ridges
    are paired.
    """

    node: IntArray
    """Nodes of the faces that are looked at, in no particular order; shape (node capacity,)."""
    place: IntArray
    """Where in `node` each is, or -1; shape (node capacity,)."""
    around: IntArray
    """Faces around each node that are looked at, shape (node capacity,)."""
    cut_around: IntArray
    """Those of them that are faces of cuts."""
    node_generation: IntArray
    """How often each node was sought anew, shape (node capacity,)."""
    marked: IntArray
    """The update in which each node was to be sought anew, shape (node capacity,)."""
    reference: FloatArray
    """Where each node was when it was sought [m], shape (node capacity, 3)."""
    triangle: IntArray
    """Nodes of each face, counter-clockwise seen from outside; shape (capacity, 3)."""
    state: IntArray
    """OUT or IN, shape (capacity,)."""
    known: IntArray
    """Generation of the face when it was taken in, shape (capacity,)."""
    is_cut: IntArray
    """Whether it was one of a cut then."""
    is_near: IntArray
    """Whether it is to be looked at: of a cut, or skin near another piece."""
    generation: IntArray
    """How often each face was sought anew, shape (capacity,)."""
    has_edge: IntArray
    """Whether each edge belongs to its face, and is of skin or a ridge; shape (3 * capacity,)."""
    listed: IntArray
    """The update in which each face was to be sought anew, shape (capacity,)."""
    dirty: IntArray
    """Scratch: faces to be sought anew, shape (capacity,)."""
    low: FloatArray
    """Lowest corner of the box of each triangle's reference [m], shape (capacity, 3)."""
    high: FloatArray
    """Highest corner."""
    edge_low: FloatArray
    """The same of each edge, shape (3 * capacity, 3)."""
    edge_high: FloatArray
    points: Grid
    triangles: Grid
    edges: Grid
    search: Search
    point_triangle: Pairs
    edge_edge: Pairs
    way: FloatArray
    """How far nodes have gone at most since it was looked at which skin is near another piece [m],
    shape (1,)."""
    counts: IntArray
    """Number of nodes, of dirty faces, and of updates; shape (3,)."""
    outward: IntArray
    """`surface.OUTWARD`."""


def new_candidates(n_nodes: int, capacity: int, size: float) -> Candidates:
    """Return no candidates.

    Args:
        n_nodes: Nodes of the body that there is room for.
        capacity: Faces.
        size: Edge of a cell of the grids [m]: some elements' size.
    """
    buckets = 1 << (4 * capacity - 1).bit_length()
    of_nodes = ("node", "around", "cut_around", "node_generation", "marked")
    of_faces = ("state", "is_cut", "is_near", "generation", "listed", "dirty")
    return Candidates(
        **{name: np.zeros(n_nodes, np.int64) for name in of_nodes},
        place=np.full(n_nodes, -1, np.int64),
        reference=np.zeros((n_nodes, 3)),
        **{name: np.zeros(capacity, np.int64) for name in of_faces},
        known=np.full(capacity, -1, np.int64),
        has_edge=np.zeros(3 * capacity, np.int64),
        triangle=np.zeros((capacity, 3), np.int64),
        low=np.zeros((capacity, 3)),
        high=np.zeros((capacity, 3)),
        edge_low=np.zeros((3 * capacity, 3)),
        edge_high=np.zeros((3 * capacity, 3)),
        points=new_grid(buckets, 4 * capacity, size),
        triangles=new_grid(buckets, 32 * capacity, size),
        edges=new_grid(buckets, 32 * capacity, size),
        search=new_search(max(n_nodes, 3 * capacity)),
        point_triangle=new_pairs(16 * capacity),
        edge_edge=new_pairs(32 * capacity),
        way=np.full(1, np.inf),
        counts=np.zeros(3, np.int64),
        outward=OUTWARD,
    )


def grown_candidates(candidates: Candidates, n_nodes: int) -> Candidates:
    """Return the candidates with room for that many nodes of the body."""
    of_nodes = ("node", "around", "cut_around", "node_generation", "marked", "reference")
    larger = {name: grown(getattr(candidates, name), n_nodes) for name in of_nodes}
    return candidates.replaced(
        **larger,
        place=grown(candidates.place, n_nodes, -1),
        search=new_search(max(n_nodes, len(candidates.edge_low))),
    )


@kernel
def clear(candidates: Candidates) -> None:
    """Forget all: everything will be sought anew."""
    for i in range(candidates.counts[N_NODES]):
        node = candidates.node[i]
        candidates.place[node] = -1
        candidates.around[node] = 0
        candidates.cut_around[node] = 0
    candidates.counts[N_NODES] = 0
    for at in range(len(candidates.state)):
        candidates.state[at] = OUT
        candidates.known[at] = -1
    candidates.way[0] = np.inf
    clear_grid(candidates.points)
    clear_grid(candidates.triangles)
    clear_grid(candidates.edges)
    candidates.point_triangle.counts[:] = 0
    candidates.edge_edge.counts[:] = 0


@kernel
def moves_as_tissue_does(body: Body, start: FloatArray) -> bool:
    """Whether no node at all has moved by more than `FARTHEST`, or to nowhere, since `start`."""
    for node in range(body.n_nodes):
        d = sub(vec3(body.positions, node), vec3(start, node))
        if not dot(d, d) <= FARTHEST * FARTHEST:
            return False
    return True


@kernel
def renew_candidates(
    candidates: Candidates,
    motion: Motion,
    faces: Faces,
    body: Body,
    start: FloatArray,
    move: float,
    has_changed: bool,
    margin: float,
) -> bool:
    """Seek anew what has moved or changed; return False if there is no room.

    Args:
        candidates: Written.
        motion: New nodes are measured from now on.
        faces: The faces that may touch.
        body: Where they are.
        start: Where they were before the Runge-Kutta step [m].
        move: How far nodes have moved in it at most [m].
        has_changed: Whether faces have changed since the last call.
        margin: [m].
    """
    counts, way = candidates.counts, candidates.way
    way[0] += move
    if not way[0] <= WAY_OF_PIECES * margin:
        measure_pieces(faces, body)
        way[0] = 0.0
        has_changed = True
    counts[N_UPDATES] += 1
    if not _mark_moved(candidates, body, margin) and not has_changed:
        return True
    if faces.counts[N_FACES] > len(candidates.triangle):
        return False
    _leave_out_dead(candidates)
    _list_dirty(candidates, faces, body, (1.0 + 2.0 * WAY_OF_PIECES) * margin)
    for i in range(counts[N_DIRTY]):
        _take_out(candidates, faces, body, candidates.dirty[i])
    for i in range(counts[N_DIRTY]):
        _take_in(candidates, motion, faces, body, candidates.dirty[i])
    move = max(move, _renew_references(candidates, body, start))
    for i in range(counts[N_DIRTY]):
        _measure_boxes(candidates, faces, body, candidates.dirty[i])
    return _pair(candidates, faces, body, margin + CLOSING * move)


@kernel
def _mark_moved(candidates: Candidates, body: Body, margin: float) -> bool:
    """Mark the nodes that have left their reference by half the margin; return whether any has."""
    most = 0.25 * margin * margin
    any_moved = False
    for i in range(candidates.counts[N_NODES]):
        node = candidates.node[i]
        d = sub(vec3(body.positions, node), vec3(candidates.reference, node))
        if not dot(d, d) <= most:
            _mark(candidates, node)
            any_moved = True
    return any_moved


@kernel
def _mark(candidates: Candidates, node: int) -> None:
    candidates.marked[node] = candidates.counts[N_UPDATES]


@kernel
def _is_marked(candidates: Candidates, node: int) -> bool:
    return candidates.marked[node] == candidates.counts[N_UPDATES]


@kernel
def _has_marked(candidates: Candidates, at: int) -> bool:
    """Whether a node of that triangle is marked."""
    node = candidates.triangle
    return (
        _is_marked(candidates, node[at, 0])
        or _is_marked(candidates, node[at, 1])
        or _is_marked(candidates, node[at, 2])
    )


@kernel
def _leave_out_dead(candidates: Candidates) -> None:
    """Leave out pairs that are out of date, where half the room is taken."""
    pairs = candidates.point_triangle
    if 2 * pairs.counts[N_PAIRS] > len(pairs.wake):
        for k in range(pairs.counts[N_PAIRS] - 1, -1, -1):
            if is_dead_point(candidates, k):
                drop_pair(pairs, k)
    pairs = candidates.edge_edge
    if 2 * pairs.counts[N_PAIRS] > len(pairs.wake):
        for k in range(pairs.counts[N_PAIRS] - 1, -1, -1):
            if is_dead_edge(candidates, k):
                drop_pair(pairs, k)


@kernel
def is_dead_point(candidates: Candidates, k: int) -> bool:
    """Whether that pair of node and triangle is out of date."""
    pairs = candidates.point_triangle
    of_node = candidates.node_generation[pairs.item[k, 0]]
    return pairs.generation[k] != of_node + candidates.generation[pairs.item[k, 1]]


@kernel
def is_dead_edge(candidates: Candidates, k: int) -> bool:
    """Whether that pair of edges is out of date."""
    pairs, generation = candidates.edge_edge, candidates.generation
    first, second = generation[pairs.item[k, 0] // 3], generation[pairs.item[k, 1] // 3]
    return pairs.generation[k] != first + second


@kernel
def _list_dirty(candidates: Candidates, faces: Faces, body: Body, reach: float) -> None:
    """List the faces that are new, that changed or moved, or come near another piece or go away."""
    dirty, counts = candidates.dirty, candidates.counts
    counts[N_DIRTY] = 0
    pieces_seen = candidates.way[0] == 0.0
    for at in range(faces.counts[N_FACES]):
        has_changed = candidates.known[at] != faces.generation[at]
        if has_changed or pieces_seen:
            face = faces.face[at]
            is_near = face != NONE and may_touch(faces, body, face, reach)
            has_changed = has_changed or is_near != (candidates.state[at] == IN)
            candidates.is_near[at] = is_near
        if has_changed or (candidates.state[at] == IN and _has_marked(candidates, at)):
            _list(candidates, at)
    for i in range(counts[N_DIRTY]):
        at = dirty[i]
        if candidates.known[at] != faces.generation[at] and faces.face[at] != NONE:
            _list_beside(candidates, faces, body, faces.face[at])


@kernel
def _list(candidates: Candidates, at: int) -> None:
    candidates.dirty[candidates.counts[N_DIRTY]] = at
    candidates.counts[N_DIRTY] += 1
    candidates.listed[at] = candidates.counts[N_UPDATES]


@kernel
def _list_beside(candidates: Candidates, faces: Faces, body: Body, face: int) -> None:
    """List the faces beside one that changed, too: their edges may be ridges now, or no more."""
    for k in range(3):
        other = across(body, face // 4, face % 4, k, candidates.outward)[0]
        at = faces.place[other // 4, other % 4] if other >= 0 else -1
        if (
            at >= 0
            and candidates.state[at] == IN
            and candidates.listed[at] != candidates.counts[N_UPDATES]
        ):
            _list(candidates, at)


@kernel
def _take_out(candidates: Candidates, faces: Faces, body: Body, at: int) -> None:
    """Take a face out of the grids; and out of the nodes' counts, unless it only moved."""
    candidates.generation[at] += 1
    if candidates.state[at] == OUT:
        return
    take_out(candidates.triangles, at, _box(candidates.low, candidates.high, at))
    for k in range(3):
        if candidates.has_edge[3 * at + k] == 1:
            edge = 3 * at + k
            take_out(candidates.edges, edge, _box(candidates.edge_low, candidates.edge_high, edge))
    if candidates.known[at] == faces.generation[at] and candidates.is_near[at] == 1:
        return
    candidates.state[at] = OUT
    for k in range(3):
        node = candidates.triangle[at, k]
        candidates.around[node] -= 1
        candidates.cut_around[node] -= candidates.is_cut[at]


@kernel
def _take_in(candidates: Candidates, motion: Motion, faces: Faces, body: Body, at: int) -> None:
    """Note a face's nodes, if it is to be looked at and is not yet."""
    candidates.known[at] = faces.generation[at]
    if candidates.is_near[at] == 0 or candidates.state[at] == IN:
        return
    candidates.state[at] = IN
    candidates.is_cut[at] = is_cut(faces, body, at)
    t, f = faces.face[at] // 4, faces.face[at] % 4
    for k in range(3):
        node = body.tetrahedra[t, candidates.outward[f, k]]
        candidates.triangle[at, k] = node
        if candidates.place[node] < 0:
            candidates.place[node] = candidates.counts[N_NODES]
            candidates.node[candidates.counts[N_NODES]] = node
            candidates.counts[N_NODES] += 1
            begin_motion(motion, body, node)
            candidates.around[node] = 0
            candidates.cut_around[node] = 0
            _mark(candidates, node)
        elif candidates.cut_around[node] == 0 and candidates.is_cut[at] == 1:
            _mark(candidates, node)
        candidates.around[node] += 1
        candidates.cut_around[node] += candidates.is_cut[at]


@kernel
def _renew_references(candidates: Candidates, body: Body, start: FloatArray) -> float:
    """Let marked nodes be sought from where they are, and forget those without faces.

    Return how far the marked ones have moved since `start` at most [m].
    """
    points, reference = candidates.points, candidates.reference
    most = 0.0
    i = 0
    while i < candidates.counts[N_NODES]:
        node = candidates.node[i]
        if candidates.around[node] > 0:
            if _is_marked(candidates, node):
                take_out(points, node, _box(reference, reference, node))
                candidates.node_generation[node] += 1
                store(reference, node, vec3(body.positions, node))
                moved = sub(vec3(reference, node), vec3(start, node))
                most = max(most, math.sqrt(dot(moved, moved)))
            i += 1
            continue
        take_out(points, node, _box(reference, reference, node))
        candidates.node_generation[node] += 1
        candidates.place[node] = -1
        candidates.counts[N_NODES] -= 1
        last = candidates.node[candidates.counts[N_NODES]]
        candidates.node[i] = last
        if last != node:
            candidates.place[last] = i
    return most


@kernel
def _owns_edge(candidates: Candidates, at: int, k: int) -> bool:
    return candidates.triangle[at, k] < candidates.triangle[at, (k + 1) % 3]


@kernel
def _box(low: FloatArray, high: FloatArray, i: int) -> Box:
    return Box(vec3(low, i), vec3(high, i))


@kernel
def _around(box: Box, reach: float) -> Box:
    """A box that is larger on each side."""
    low, high = box.low, box.high
    return Box(
        Vec3(low.x - reach, low.y - reach, low.z - reach),
        Vec3(high.x + reach, high.y + reach, high.z + reach),
    )


@kernel
def rim_of(a: Vec3, b: Vec3, c: Vec3) -> float:
    """How far outside a triangle a node may be that still meets it, at most [m]."""
    ab, ac = sub(b, a), sub(c, a)
    return RIM * (math.sqrt(dot(ab, ab)) + math.sqrt(dot(ac, ac)))


@kernel
def _measure_boxes(candidates: Candidates, faces: Faces, body: Body, at: int) -> None:
    """Write the boxes of a triangle with its rim, and of its edges, from the nodes' references.

    And which of its edges are to be paired.
    """
    if candidates.state[at] == OUT:
        return
    t, f = faces.face[at] // 4, faces.face[at] % 4
    for k in range(3):
        owns = _owns_edge(candidates, at, k)
        is_skin = candidates.is_cut[at] == 0
        has_edge = owns and (is_skin or is_ridge(body, t, f, k, candidates.outward))
        candidates.has_edge[3 * at + k] = 1 if has_edge else 0
    x, triangle = candidates.reference, candidates.triangle
    i, j, k = triangle[at, 0], triangle[at, 1], triangle[at, 2]
    rim = rim_of(vec3(x, i), vec3(x, j), vec3(x, k))
    for c in range(3):
        candidates.low[at, c] = min(x[i, c], min(x[j, c], x[k, c])) - rim
        candidates.high[at, c] = max(x[i, c], max(x[j, c], x[k, c])) + rim
    for k in range(3):
        a, b = triangle[at, k], triangle[at, (k + 1) % 3]
        for c in range(3):
            candidates.edge_low[3 * at + k, c] = min(x[a, c], x[b, c])
            candidates.edge_high[3 * at + k, c] = max(x[a, c], x[b, c])


@kernel
def _pair(candidates: Candidates, faces: Faces, body: Body, reach: float) -> bool:
    """Find the pairs of marked nodes and dirty faces, and put those into the grids."""
    for i in range(candidates.counts[N_NODES]):
        node = candidates.node[i]
        if _is_marked(candidates, node) and not _pair_node(candidates, faces, body, node, reach):
            return False
    for i in range(candidates.counts[N_DIRTY]):
        at = candidates.dirty[i]
        if candidates.state[at] == OUT:
            continue
        if not _pair_triangle(candidates, faces, body, at, reach):
            return False
        for k in range(3):
            if candidates.has_edge[3 * at + k] == 1 and not _pair_edge(
                candidates, faces, at, k, reach
            ):
                return False
    return True


@kernel
def _pair_node(candidates: Candidates, faces: Faces, body: Body, node: int, reach: float) -> bool:
    """Pair a node with the triangles that are in the grid, and put it in."""
    box = _box(candidates.reference, candidates.reference, node)
    low, high = candidates.low, candidates.high
    n = boxes_near(candidates.triangles, candidates.search, low, high, _around(box, reach))
    for i in range(n):
        if not _add_point(candidates, faces, body, node, candidates.search.found[i], reach):
            return False
    return put_in(candidates.points, node, box)


@kernel
def _pair_triangle(candidates: Candidates, faces: Faces, body: Body, at: int, reach: float) -> bool:
    """Pair a triangle with the nodes, which are all in the grid, and put it in."""
    x, box = candidates.reference, _box(candidates.low, candidates.high, at)
    n = boxes_near(candidates.points, candidates.search, x, x, _around(box, reach))
    for i in range(n):
        if not _add_point(candidates, faces, body, candidates.search.found[i], at, reach):
            return False
    return put_in(candidates.triangles, at, box)


@kernel
def _pair_edge(candidates: Candidates, faces: Faces, at: int, k: int, reach: float) -> bool:
    """Pair an edge with those that are in the grid, and put it in."""
    low, high, edge = candidates.edge_low, candidates.edge_high, 3 * at + k
    box = _box(low, high, edge)
    n = boxes_near(candidates.edges, candidates.search, low, high, _around(box, reach))
    for i in range(n):
        if not _add_edges(candidates, faces, edge, candidates.search.found[i], reach):
            return False
    return put_in(candidates.edges, edge, box)


@kernel
def _add_point(
    candidates: Candidates, faces: Faces, body: Body, node: int, at: int, reach: float
) -> bool:
    """Add a pair of node and triangle if they may touch; return False if there is no room."""
    a, b, c = candidates.triangle[at, 0], candidates.triangle[at, 1], candidates.triangle[at, 2]
    if node in (a, b, c):
        return True
    piece = faces.piece[body.node_tetrahedron[node]]
    of_cuts = candidates.cut_around[node] > 0 and candidates.is_cut[at] == 1
    if not of_cuts and _is_one_piece(piece, faces.piece[faces.face[at] // 4]):
        return True
    x = candidates.reference
    corners = Corners(vec3(x, node), vec3(x, a), vec3(x, b), vec3(x, c))
    if distance_to_triangle(corners) > reach + rim_of(corners.a, corners.b, corners.c):
        return True
    generation = candidates.node_generation[node] + candidates.generation[at]
    return add_pair(candidates.point_triangle, (node, a, b, c), node, at, generation)


@kernel
def _add_edges(candidates: Candidates, faces: Faces, edge: int, other: int, reach: float) -> bool:
    """Add a pair of edges if they may touch; return False if there is no room."""
    at, beside = edge // 3, other // 3
    k, m = edge % 3, other % 3
    a, b = candidates.triangle[at, k], candidates.triangle[at, (k + 1) % 3]
    c, d = candidates.triangle[beside, m], candidates.triangle[beside, (m + 1) % 3]
    if a in (c, d) or b in (c, d):
        return True
    of_cuts = candidates.is_cut[at] == 1 and candidates.is_cut[beside] == 1
    piece, other_piece = faces.piece[faces.face[at] // 4], faces.piece[faces.face[beside] // 4]
    if not of_cuts and _is_one_piece(piece, other_piece):
        return True
    x = candidates.reference
    if distance_of_edges(Edges(vec3(x, a), vec3(x, b), vec3(x, c), vec3(x, d))) > reach:
        return True
    generation = candidates.generation[at] + candidates.generation[beside]
    nodes = (a, b, c, d) if a < c else (c, d, a, b)
    return add_pair(candidates.edge_edge, nodes, edge, other, generation)


@kernel
def _is_one_piece(piece: int, other: int) -> bool:
    """Whether both are known to be in the same piece, of which only faces of cuts touch."""
    return piece == other and piece >= 0
