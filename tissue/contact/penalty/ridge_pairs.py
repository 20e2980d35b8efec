"""`RidgePairs`: which ridge may come to cross which, kept true to motion and cuts.

A pair is listed if two ridges would touch wherever in their balls their four nodes are, and holds
until one of them leaves its ball or a face beside it changes (`pair_update`).
"""

import math

import numpy as np

from tissue.contact.edge_edge import SAME_SIDE, Edges, distance_of_edges, face_the_same_side
from tissue.contact.faces import Faces
from tissue.contact.penalty.eight_contacts import FourPoints
from tissue.contact.penalty.eight_edges import WIDER, squared_distances
from tissue.contact.penalty.near_pairs import CONTACT_REACH, NearPairs
from tissue.contact.penalty.node_ways import NodeWays
from tissue.contact.penalty.ridge_grid import arrange_ridges, enter_ridge, find_near_ridges
from tissue.contact.penalty.ridges import Ridges
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, aligned, eight_points, filled, lanes, load_lanes
from tissue.core.simd_gather import larger, larger_bits
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, add, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.aabb import box_at, segment_box, store_box, widened

NOT_LISTED = -1


class RidgePairs(Arrays):
    """The pairs of ridges, and where those touch that do."""

    n_pairs: IntCell
    """Number of pairs."""
    n_touching: IntCell
    """Number of pairs that touch."""
    first: IntCell
    """First contact of ridges in the list in use."""
    n_contacts: IntCell
    """Number of contacts of ridges in the list in use."""
    is_indexed: IntCell
    """1 if `of_ridge` is up to date, else 0."""
    calm_until: FloatCell
    """Value of `NodeWays.quiet_way` up to which no pair needs a look while no node moves much
    [m]."""
    ridge: IntArray
    """The ridges of each pair, shape (capacity, 2)."""
    of_ridge: IntArray
    """The pairs of each ridge, ridge by ridge; shape (2 * capacity,)."""
    wake: FloatArray
    """Sum of the ways of its four nodes up to which a pair needs no look [m]; below 0 for one that
    is new; shape (capacity,)."""
    is_touching: IntArray
    """1 if a pair touches, else 0; shape (capacity,)."""
    is_sought: IntArray
    """1 if a pair was looked at since it was listed as a contact, else 0; shape (capacity,)."""
    contact: IntArray
    """Contact of each pair in the list in use, or NOT_LISTED; shape (capacity,)."""
    asked: IntArray
    """Scratch: the pairs that need a look, shape (capacity + 8,)."""
    end: IntArray
    """Scratch: the ends of both ridges of those, shape (capacity + 8, 4)."""
    tip: IntArray
    """Scratch: the tips of the faces beside both, shape (capacity + 8, 4)."""
    slack: FloatArray
    """Scratch: what is left before eight pairs need another look [m], shape (8,)."""
    before: IntArray
    """Scratch: the contact before each that begins with the same node, both counted from `first`;
    or NOT_LISTED; shape (capacity,)."""
    place: FloatArray
    """Where along its two ridges a pair touches, as fractions; shape (capacity, 2)."""
    normal: FloatArray
    """Unit vector in which the first ridge is pushed, shape (capacity, 3)."""


def new_ridge_pairs(capacity: int) -> RidgePairs:
    """Return no pairs, with room for that many."""
    of_pairs = ("is_touching", "is_sought", "contact", "before")
    return RidgePairs(
        n_pairs=0,
        n_touching=0,
        first=0,
        n_contacts=0,
        is_indexed=0,
        calm_until=0.0,
        of_ridge=np.zeros(2 * capacity, np.int64),
        ridge=np.zeros((capacity, 2), np.int64),
        wake=np.zeros(capacity),
        **{name: np.zeros(capacity, np.int64) for name in of_pairs},
        asked=np.zeros(filled(capacity) + WIDTH, np.int64),
        end=np.zeros((filled(capacity), 4), np.int64),
        tip=np.zeros((filled(capacity), 4), np.int64),
        slack=aligned(WIDTH),
        place=np.zeros((capacity, 2)),
        normal=np.zeros((capacity, 3)),
    )


@kernel
def pair_ridges(
    found: RidgePairs, ridges: Ridges, pairs: NearPairs, ways: NodeWays, faces: Faces
) -> bool:
    """Pair anew the ridges that changed or left their balls; return False if there is no room.

    Args:
        found: Written.
        ridges: The ridges that changed are dirty in this update.
        pairs: Which nodes were paired anew.
        ways: The balls of the nodes.
        faces: The piece that each face is of.
    """
    now = pairs.n_updates
    found.calm_until, found.is_indexed = -math.inf, 0
    has_dirty = _list_ridges(ridges, pairs, ways, faces)
    _keep_pairs(found, ridges, now)
    if not has_dirty:
        return True
    _enter_ridges(ridges, ways, now)
    for i in range(ridges.n_ridges):
        edge = ridges.listed[i]
        if ridges.dirty_at[edge] != now:
            continue
        n = _find_crossing(ridges, pairs, ways, faces, edge)
        if found.n_pairs + n > len(found.wake):
            return False
        for q in range(n):
            _add_pair(found, ridges, edge, ridges.grid.found[q])
    return True


@kernel
def _list_ridges(ridges: Ridges, pairs: NearPairs, ways: NodeWays, faces: Faces) -> bool:
    """List the ridges; return whether any are dirty: those with a node that is paired anew are."""
    now, n, has_dirty, moved = pairs.n_updates, 0, False, pairs.moved_at
    for edge in range(3 * faces.n_places):
        if ridges.is_one[edge] == 0:
            continue
        a, b = ridges.node[edge, 0], ridges.node[edge, 1]
        if moved[a] == now or moved[b] == now:
            ridges.dirty_at[edge] = now
        is_dirty = ridges.dirty_at[edge] == now
        has_dirty = has_dirty or is_dirty
        if is_dirty or moved[ridges.tip[edge, 0]] == now or moved[ridges.tip[edge, 1]] == now:
            store(ridges.outward, edge, outward_at(ridges, ways.reference, edge))
        ridges.listed[n] = edge
        n += 1
    ridges.n_ridges = n
    return has_dirty


@kernel
def _enter_ridges(ridges: Ridges, ways: NodeWays, now: int) -> None:
    """Put the ridges into the grid; those that are dirty with the balls as they are now."""
    grid = ridges.grid
    grid.short.n_items = grid.long.n_items = 0
    for i in range(ridges.n_ridges):
        edge = ridges.listed[i]
        if ridges.dirty_at[edge] == now:
            a, b = ridges.node[edge, 0], ridges.node[edge, 1]
            reach = max(ways.radius[a], ways.radius[b]) + 0.5 * CONTACT_REACH * ways.node_size
            box = widened(segment_box(ways.reference, a, b), reach)
            store_box(ridges.low, ridges.high, edge, box)
        enter_ridge(grid, edge, box_at(ridges.low, ridges.high, edge), ways.node_size)
    low, high = ridges.low, ridges.high
    arrange_ridges(grid, low, high, ridges.outward, ridges.dirty_at, now, ways.node_size)


@kernel
def _find_crossing(
    ridges: Ridges, pairs: NearPairs, ways: NodeWays, faces: Faces, edge: int
) -> int:
    """Write the ridges that a dirty one may cross to `grid.found`, in order; return how many.

    Of two that are dirty the first finds none: the second finds it.
    """
    found, outward = ridges.grid.found, vec3(ridges.outward, edge)
    box = box_at(ridges.low, ridges.high, edge)
    furthest = (1.0 + WIDER) * SAME_SIDE * norm(outward)
    n_near, n = 0, 0
    for q in range(find_near_ridges(ridges.grid, edge, box, outward, furthest)):
        other = found[q]
        found[n_near] = other
        n_near += 1 if _may_pair(ridges, pairs, faces, edge, other) else 0
    for first in range(0, n_near, WIDTH):
        _note_others(ridges, ways, first, n_near)
        is_near, is_apart = _eight_near(ridges, ways, edge)
        for q in range(min(WIDTH, n_near - first)):
            other = found[first + q]
            if is_apart >> q & 1 == 1:
                continue
            if is_near >> q & 1 == 0 and not _are_near(ridges, ways, edge, other):
                continue
            at = n
            while at > 0 and found[at - 1] > other:
                found[at] = found[at - 1]
                at -= 1
            found[at] = other
            n += 1
    return n


@kernel
def _note_others(ridges: Ridges, ways: NodeWays, first: int, n: int) -> None:
    """Write what `_eight_near` reads of ridges `first` to `first + 7` of the `n` in `grid.found`.

    Args:
        ridges: `eight` and `reach` are written.
        ways: The balls of the nodes.
        first: The first of eight.
        n: How many there are; the last fills up the eight.
    """
    for q in range(WIDTH):
        other = ridges.grid.found[min(first + q, n - 1)]
        ridges.eight[q] = other
        ridges.eight[WIDTH + q] = ridges.node[other, 0]
        ridges.eight[2 * WIDTH + q] = ridges.node[other, 1]
        ridges.reach[q] = _reach_of(ridges, ways, other)


@inlined
def _reach_of(ridges: Ridges, ways: NodeWays, edge: int) -> float:
    """Return the radius of the larger ball of the ends of a ridge [m]."""
    radius, node = ways.radius, ridges.node
    return float(max(radius[node[edge, 0]], radius[node[edge, 1]]))


@inlined
def _eight_near(ridges: Ridges, ways: NodeWays, edge: int) -> tuple[int, int]:
    """Return bits for which of eight ridges are near one and face it, and for which do not.

    What is in neither is left to `_are_near`.

    Args:
        ridges: `eight` and `reach` are written.
        ways: Where the nodes were when they were paired.
        edge: The one.
    """
    x, node, wider, narrower = ways.reference, ridges.node, 1.0 + WIDER, 1.0 - WIDER
    a, b = _everywhere(vec3(x, node[edge, 0])), _everywhere(vec3(x, node[edge, 1]))
    c, d = _eight(x, ridges.eight, WIDTH), _eight(x, ridges.eight, 2 * WIDTH)
    square = squared_distances(FourPoints(a, b, c, d))
    reach = lanes(_reach_of(ridges, ways, edge) + CONTACT_REACH * ways.node_size)
    reach = reach + load_lanes(ridges.reach, 0)
    own = vec3(ridges.outward, edge)
    outward, other_outward = _everywhere(own), _eight(ridges.outward, ridges.eight, 0)
    same = larger(dot(outward, other_outward), lanes(0.0))
    alike = lanes(SAME_SIDE * SAME_SIDE * dot(own, own)) * dot(other_outward, other_outward)
    is_apart = larger_bits(square, lanes(wider) * reach * reach)
    is_apart |= larger_bits(same * same, lanes(wider) * alike)
    is_near = larger_bits(lanes(narrower) * reach * reach, square)
    return is_near & ~larger_bits(same * same, lanes(narrower) * alike), is_apart


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
def _keep_pairs(found: RidgePairs, ridges: Ridges, now: int) -> None:
    """Close up the pairs that hold."""
    n, n_touching = 0, 0
    for k in range(found.n_pairs):
        if ridges.dirty_at[found.ridge[k, 0]] == now or ridges.dirty_at[found.ridge[k, 1]] == now:
            continue
        if n < k:
            _move_pair(found, k, n)
        n_touching += found.is_touching[n]
        n += 1
    found.n_pairs, found.n_touching = n, n_touching


@inlined
def _move_pair(found: RidgePairs, k: int, to: int) -> None:
    """Copy a pair to another row."""
    found.ridge[to, 0], found.ridge[to, 1] = found.ridge[k, 0], found.ridge[k, 1]
    found.wake[to], found.contact[to] = found.wake[k], found.contact[k]
    found.is_touching[to], found.is_sought[to] = found.is_touching[k], found.is_sought[k]
    if found.is_touching[k] == 1:
        found.place[to, 0], found.place[to, 1] = found.place[k, 0], found.place[k, 1]
        store(found.normal, to, vec3(found.normal, k))


@kernel
def _add_pair(found: RidgePairs, ridges: Ridges, edge: int, other: int) -> None:
    """Add a pair; the ridge that begins with the lower node is its first."""
    k = found.n_pairs
    is_first = ridges.node[edge, 0] < ridges.node[other, 0]
    found.ridge[k, 0] = edge if is_first else other
    found.ridge[k, 1] = other if is_first else edge
    found.wake[k] = -1.0
    found.is_touching[k] = found.is_sought[k] = 0
    found.contact[k] = NOT_LISTED
    found.n_pairs += 1


@kernel
def sort_by_ridges(found: RidgePairs, ridges: Ridges) -> None:
    """Write which pairs each ridge is in, unless that is done."""
    if found.is_indexed == 1 or ridges.n_ridges == 0:
        return
    found.is_indexed = 1
    begin, n_edges = ridges.first_pair, ridges.listed[ridges.n_ridges - 1] + 1
    for edge in range(n_edges + 2):
        begin[edge] = 0
    for k in range(found.n_pairs):
        begin[found.ridge[k, 0] + 2] += 1
        begin[found.ridge[k, 1] + 2] += 1
    for edge in range(2, n_edges + 2):
        begin[edge] += begin[edge - 1]
    for k in range(found.n_pairs):
        for side in range(2):
            edge = found.ridge[k, side]
            found.of_ridge[begin[edge + 1]] = k
            begin[edge + 1] += 1


@inlined
def _may_pair(ridges: Ridges, pairs: NearPairs, faces: Faces, edge: int, other: int) -> bool:
    """Whether two ridges may touch at all: they have no node in common, nor the skin of a piece."""
    a, b = ridges.node[edge, 0], ridges.node[edge, 1]
    c, d = ridges.node[other, 0], ridges.node[other, 1]
    if a in (c, d) or b in (c, d):
        return False
    if ridges.is_of_cut[edge] == 1 and ridges.is_of_cut[other] == 1:
        return True
    piece = faces.piece[pairs.tetrahedron[edge // 3]]
    return not (piece >= 0 and piece == faces.piece[pairs.tetrahedron[other // 3]])


@kernel
def _are_near(ridges: Ridges, ways: NodeWays, edge: int, other: int) -> bool:
    """Whether two ridges face each other, and may touch while their nodes stay in their balls."""
    if face_the_same_side(vec3(ridges.outward, edge), vec3(ridges.outward, other)):
        return False
    x, node = ways.reference, ridges.node
    reach = _reach_of(ridges, ways, edge) + _reach_of(ridges, ways, other)
    reach += CONTACT_REACH * ways.node_size
    a, b = vec3(x, node[edge, 0]), vec3(x, node[edge, 1])
    c, d = vec3(x, node[other, 0]), vec3(x, node[other, 1])
    return bool(distance_of_edges(Edges(a, b, c, d)) <= reach)


@kernel
def outward_at(ridges: Ridges, x: FloatArray, edge: int) -> Vec3:
    """Return a vector out of the body at a ridge: the sum of the unit normals of its two faces."""
    a, b = vec3(x, ridges.node[edge, 0]), vec3(x, ridges.node[edge, 1])
    along = sub(b, a)
    own = cross(along, sub(vec3(x, ridges.tip[edge, 0]), a))
    across = cross(sub(vec3(x, ridges.tip[edge, 1]), a), along)
    size, other_size = norm(own), norm(across)
    if not (size > 0.0 and other_size > 0.0):
        return Vec3(0.0, 0.0, 0.0)
    if ridges.tip[edge, 0] == ridges.tip[edge, 1]:
        return scale(1.0 / size, own)
    return add(scale(1.0 / size, own), scale(1.0 / other_size, across))
