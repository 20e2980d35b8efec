"""`EdgePairs`: which edge may come to cross which, kept true to motion and cuts.

A pair is listed if two edges would touch wherever in their balls their four nodes are, and holds
until one of them leaves its ball or a face at it changes (`pair_update`).
"""

import math

import numpy as np

from tissue.contact.geometry.edges import SAME_SIDE, Edges, distance_of_edges, face_the_same_side
from tissue.contact.geometry.eight_contacts import WIDER, FourPoints, squared_distances
from tissue.contact.geometry.faces import Faces
from tissue.contact.search.feature_edges import (
    FeatureEdges,
    arrange_edges,
    enter_edge,
    find_near_edges,
)
from tissue.contact.search.near_pairs import CONTACT_REACH, NearPairs
from tissue.contact.search.node_motion import NodeMotion
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, aligned, eight_points, filled, lanes, load_lanes
from tissue.core.simd_rows import larger, larger_bits
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, add, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.aabb import box_at, segment_box, store_box, widened

NOT_LISTED = -1


class EdgePairs(Arrays):
    """The pairs of edges, and where those touch that do."""

    n_pairs: IntCell
    """Number of pairs."""
    n_touching: IntCell
    """Number of pairs that touch."""
    first: IntCell
    """First contact of edges in the list in use."""
    n_contacts: IntCell
    """Number of contacts of edges in the list in use."""
    is_indexed: IntCell
    """1 if `of_edge` is up to date, else 0."""
    resting_until: FloatCell
    """Value of `NodeMotion.quiet_path` up to which no pair needs a test while no node moves much
    [m]."""
    edge: IntArray
    """The edges of each pair, shape (capacity, 2)."""
    of_edge: IntArray
    """The pairs of each edge, edge by edge; shape (2 * capacity,)."""
    wake: FloatArray
    """Sum of the paths of its four nodes up to which a pair needs no test [m]; below 0 for one that
    is new; shape (capacity,)."""
    is_touching: IntArray
    """1 if a pair touches, else 0; shape (capacity,)."""
    is_tested: IntArray
    """1 if a pair was tested since it was listed as a contact, else 0; shape (capacity,)."""
    contact: IntArray
    """Contact of each pair in the list in use, or NOT_LISTED; shape (capacity,)."""
    due: IntArray
    """Scratch: the pairs that need a test, shape (capacity + 8,)."""
    end: IntArray
    """Scratch: the ends of both edges of those, shape (capacity + 8, 4)."""
    tip: IntArray
    """Scratch: the tips of the faces next to both, shape (capacity + 8, 4)."""
    slack: FloatArray
    """Scratch: what is left before eight pairs need another test [m], shape (8,)."""
    before: IntArray
    """Scratch: the contact before each that begins with the same node, both counted from `first`;
    or NOT_LISTED; shape (capacity,)."""
    place: FloatArray
    """Where along its two edges a pair touches, as fractions; shape (capacity, 2)."""
    normal: FloatArray
    """Unit vector in which the first edge is pushed, shape (capacity, 3)."""


def new_edge_pairs(capacity: int) -> EdgePairs:
    """Return no pairs, with room for that many."""
    of_pairs = ("is_touching", "is_tested", "contact", "before")
    return EdgePairs(
        n_pairs=0,
        n_touching=0,
        first=0,
        n_contacts=0,
        is_indexed=0,
        resting_until=0.0,
        of_edge=np.zeros(2 * capacity, np.int64),
        edge=np.zeros((capacity, 2), np.int64),
        wake=np.zeros(capacity),
        **{name: np.zeros(capacity, np.int64) for name in of_pairs},
        due=np.zeros(filled(capacity) + WIDTH, np.int64),
        end=np.zeros((filled(capacity), 4), np.int64),
        tip=np.zeros((filled(capacity), 4), np.int64),
        slack=aligned(WIDTH),
        place=np.zeros((capacity, 2)),
        normal=np.zeros((capacity, 3)),
    )


@kernel
def pair_edges(
    found: EdgePairs, edges: FeatureEdges, pairs: NearPairs, motion: NodeMotion, faces: Faces
) -> bool:
    """Pair again the edges that changed or left their balls; return False if there is no room.

    Args:
        found: Written.
        edges: The edges that changed are dirty in this update.
        pairs: Which nodes were paired again.
        motion: The balls of the nodes.
        faces: The piece that each face is of.
    """
    now = pairs.n_updates
    found.resting_until, found.is_indexed = -math.inf, 0
    has_dirty = _list_edges(edges, pairs, motion, faces)
    _keep_pairs(found, edges, now)
    if not has_dirty:
        return True
    _enter_edges(edges, motion, now)
    for i in range(edges.n_edges):
        edge = edges.listed[i]
        if edges.dirty_at[edge] != now:
            continue
        n = _find_crossing(edges, pairs, motion, faces, edge)
        if found.n_pairs + n > len(found.wake):
            return False
        for q in range(n):
            _add_pair(found, edges, edge, edges.grid.found[q])
    return True


@kernel
def _list_edges(edges: FeatureEdges, pairs: NearPairs, motion: NodeMotion, faces: Faces) -> bool:
    """List the edges; return whether any are dirty: those with a node that is paired again are."""
    now, n, has_dirty, moved = pairs.n_updates, 0, False, pairs.moved_at
    for edge in range(3 * faces.n_places):
        if edges.is_feature[edge] == 0:
            continue
        a, b = edges.node[edge, 0], edges.node[edge, 1]
        if moved[a] == now or moved[b] == now:
            edges.dirty_at[edge] = now
        is_dirty = edges.dirty_at[edge] == now
        has_dirty = has_dirty or is_dirty
        if is_dirty or moved[edges.tip[edge, 0]] == now or moved[edges.tip[edge, 1]] == now:
            store(edges.outward, edge, outward_at(edges, motion.reference, edge))
        edges.listed[n] = edge
        n += 1
    edges.n_edges = n
    return has_dirty


@kernel
def _enter_edges(edges: FeatureEdges, motion: NodeMotion, now: int) -> None:
    """Put the edges into the grid; those that are dirty with the balls as they are now."""
    grid = edges.grid
    grid.short.n_items = grid.long.n_items = 0
    for i in range(edges.n_edges):
        edge = edges.listed[i]
        if edges.dirty_at[edge] == now:
            a, b = edges.node[edge, 0], edges.node[edge, 1]
            reach = max(motion.radius[a], motion.radius[b]) + 0.5 * CONTACT_REACH * motion.node_size
            box = widened(segment_box(motion.reference, a, b), reach)
            store_box(edges.low, edges.high, edge, box)
        enter_edge(grid, edge, box_at(edges.low, edges.high, edge), motion.node_size)
    low, high = edges.low, edges.high
    arrange_edges(grid, low, high, edges.outward, edges.dirty_at, now, motion.node_size)


@kernel
def _find_crossing(
    edges: FeatureEdges, pairs: NearPairs, motion: NodeMotion, faces: Faces, edge: int
) -> int:
    """Write the edges that a dirty one may cross to `grid.found`, in order; return how many.

    Of two that are dirty the first finds none: the second finds it.
    """
    found, outward = edges.grid.found, vec3(edges.outward, edge)
    box = box_at(edges.low, edges.high, edge)
    furthest = (1.0 + WIDER) * SAME_SIDE * norm(outward)
    n_near, n = 0, 0
    for q in range(find_near_edges(edges.grid, edge, box, outward, furthest)):
        other = found[q]
        found[n_near] = other
        n_near += 1 if _may_pair(edges, pairs, faces, edge, other) else 0
    for first in range(0, n_near, WIDTH):
        _note_others(edges, motion, first, n_near)
        is_near, is_apart = _eight_near(edges, motion, edge)
        for q in range(min(WIDTH, n_near - first)):
            other = found[first + q]
            if is_apart >> q & 1 == 1:
                continue
            if is_near >> q & 1 == 0 and not _are_near(edges, motion, edge, other):
                continue
            at = n
            while at > 0 and found[at - 1] > other:
                found[at] = found[at - 1]
                at -= 1
            found[at] = other
            n += 1
    return n


@kernel
def _note_others(edges: FeatureEdges, motion: NodeMotion, first: int, n: int) -> None:
    """Write what `_eight_near` reads of edges `first` to `first + 7` of the `n` in `grid.found`.

    Args:
        edges: `eight` and `reach` are written.
        motion: The balls of the nodes.
        first: The first of eight.
        n: How many there are; the last fills up the eight.
    """
    for q in range(WIDTH):
        other = edges.grid.found[min(first + q, n - 1)]
        edges.eight[q] = other
        edges.eight[WIDTH + q] = edges.node[other, 0]
        edges.eight[2 * WIDTH + q] = edges.node[other, 1]
        edges.reach[q] = _reach_of(edges, motion, other)


@inlined
def _reach_of(edges: FeatureEdges, motion: NodeMotion, edge: int) -> float:
    """Return the radius of the larger ball of the ends of an edge [m]."""
    radius, node = motion.radius, edges.node
    return float(max(radius[node[edge, 0]], radius[node[edge, 1]]))


@inlined
def _eight_near(edges: FeatureEdges, motion: NodeMotion, edge: int) -> tuple[int, int]:
    """Return bits for which of eight edges are near one and face it, and for which do not.

    What is in neither is left to `_are_near`.

    Args:
        edges: `eight` and `reach` are written.
        motion: Where the nodes were when they were paired.
        edge: The one.
    """
    x, node, wider, narrower = motion.reference, edges.node, 1.0 + WIDER, 1.0 - WIDER
    a, b = _everywhere(vec3(x, node[edge, 0])), _everywhere(vec3(x, node[edge, 1]))
    c, d = _eight(x, edges.eight, WIDTH), _eight(x, edges.eight, 2 * WIDTH)
    square = squared_distances(FourPoints(a, b, c, d))
    reach = lanes(_reach_of(edges, motion, edge) + CONTACT_REACH * motion.node_size)
    reach = reach + load_lanes(edges.reach, 0)
    own = vec3(edges.outward, edge)
    outward, other_outward = _everywhere(own), _eight(edges.outward, edges.eight, 0)
    same = larger(dot(outward, other_outward), lanes(0.0))
    limit = lanes(SAME_SIDE * SAME_SIDE * dot(own, own)) * dot(other_outward, other_outward)
    is_apart = larger_bits(square, lanes(wider) * reach * reach)
    is_apart |= larger_bits(same * same, lanes(wider) * limit)
    is_near = larger_bits(lanes(narrower) * reach * reach, square)
    return is_near & ~larger_bits(same * same, lanes(narrower) * limit), is_apart


@inlined
def _everywhere(a: Vec3) -> Vec3:
    """Return the same vector eight times."""
    return Vec3(lanes(a.x), lanes(a.y), lanes(a.z))


@inlined
def _eight(points: FloatArray, of: SlotArray, i: int) -> Vec3:
    """Return rows `of[i]` to `of[i + 7]`."""
    x, y, z = eight_points(points, of, i)
    return Vec3(x, y, z)


@kernel
def _keep_pairs(found: EdgePairs, edges: FeatureEdges, now: int) -> None:
    """Close up the pairs that hold."""
    n, n_touching = 0, 0
    for k in range(found.n_pairs):
        if edges.dirty_at[found.edge[k, 0]] == now or edges.dirty_at[found.edge[k, 1]] == now:
            continue
        if n < k:
            _move_pair(found, k, n)
        n_touching += found.is_touching[n]
        n += 1
    found.n_pairs, found.n_touching = n, n_touching


@inlined
def _move_pair(found: EdgePairs, k: int, to: int) -> None:
    """Copy a pair to another row."""
    found.edge[to, 0], found.edge[to, 1] = found.edge[k, 0], found.edge[k, 1]
    found.wake[to], found.contact[to] = found.wake[k], found.contact[k]
    found.is_touching[to], found.is_tested[to] = found.is_touching[k], found.is_tested[k]
    if found.is_touching[k] == 1:
        found.place[to, 0], found.place[to, 1] = found.place[k, 0], found.place[k, 1]
        store(found.normal, to, vec3(found.normal, k))


@kernel
def _add_pair(found: EdgePairs, edges: FeatureEdges, edge: int, other: int) -> None:
    """Add a pair; the edge that begins with the lower node is its first."""
    k = found.n_pairs
    is_first = edges.node[edge, 0] < edges.node[other, 0]
    found.edge[k, 0] = edge if is_first else other
    found.edge[k, 1] = other if is_first else edge
    found.wake[k] = -1.0
    found.is_touching[k] = found.is_tested[k] = 0
    found.contact[k] = NOT_LISTED
    found.n_pairs += 1


@kernel
def sort_by_edges(found: EdgePairs, edges: FeatureEdges) -> None:
    """Write which pairs each edge is in, unless that is done."""
    if found.is_indexed == 1 or edges.n_edges == 0:
        return
    found.is_indexed = 1
    begin, n_edges = edges.first_pair, edges.listed[edges.n_edges - 1] + 1
    for edge in range(n_edges + 2):
        begin[edge] = 0
    for k in range(found.n_pairs):
        begin[found.edge[k, 0] + 2] += 1
        begin[found.edge[k, 1] + 2] += 1
    for edge in range(2, n_edges + 2):
        begin[edge] += begin[edge - 1]
    for k in range(found.n_pairs):
        for side in range(2):
            edge = found.edge[k, side]
            found.of_edge[begin[edge + 1]] = k
            begin[edge + 1] += 1


@inlined
def _may_pair(edges: FeatureEdges, pairs: NearPairs, faces: Faces, edge: int, other: int) -> bool:
    """Whether two edges may touch at all: they have no node in common, nor the skin of a piece."""
    a, b = edges.node[edge, 0], edges.node[edge, 1]
    c, d = edges.node[other, 0], edges.node[other, 1]
    if a in (c, d) or b in (c, d):
        return False
    if edges.is_of_cut[edge] == 1 and edges.is_of_cut[other] == 1:
        return True
    piece = faces.piece[pairs.tetrahedron[edge // 3]]
    return not (piece >= 0 and piece == faces.piece[pairs.tetrahedron[other // 3]])


@kernel
def _are_near(edges: FeatureEdges, motion: NodeMotion, edge: int, other: int) -> bool:
    """Whether two edges face each other, and may touch while their nodes stay in their balls."""
    if face_the_same_side(vec3(edges.outward, edge), vec3(edges.outward, other)):
        return False
    x, node = motion.reference, edges.node
    reach = _reach_of(edges, motion, edge) + _reach_of(edges, motion, other)
    reach += CONTACT_REACH * motion.node_size
    a, b = vec3(x, node[edge, 0]), vec3(x, node[edge, 1])
    c, d = vec3(x, node[other, 0]), vec3(x, node[other, 1])
    return bool(distance_of_edges(Edges(a, b, c, d)) <= reach)


@kernel
def outward_at(edges: FeatureEdges, x: FloatArray, edge: int) -> Vec3:
    """Return a vector out of the body at an edge: the sum of the unit normals of its two faces."""
    a, b = vec3(x, edges.node[edge, 0]), vec3(x, edges.node[edge, 1])
    along = sub(b, a)
    own = cross(along, sub(vec3(x, edges.tip[edge, 0]), a))
    across = cross(sub(vec3(x, edges.tip[edge, 1]), a), along)
    size, other_size = norm(own), norm(across)
    if not (size > 0.0 and other_size > 0.0):
        return Vec3(0.0, 0.0, 0.0)
    if edges.tip[edge, 0] == edges.tip[edge, 1]:
        return scale(1.0 / size, own)
    return add(scale(1.0 / size, own), scale(1.0 / other_size, across))
