"""Rejection of pairs that do not touch, eight at a time: most pairs that are due are far apart.

What is left is looked at closely (`touch`).
"""

import math

from tissue.contact.penalty.contact_forces import PenaltyForces
from tissue.contact.penalty.near_pairs import CONTACT_REACH, know_motion
from tissue.contact.penalty.search_state import SearchState
from tissue.contact.penalty.touch import (
    DEPTH_OF_LOST,
    FACING,
    HELD_FACING,
    HELD_RIM,
    OVERLAP_DEPTH,
    RIM_OF_TOUCH,
    STILL,
    TIME_AHEAD,
    everywhere,
    over_faces,
    points_of_looks,
)
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, lanes, load_lanes, square_root, store_lanes, unfused
from tissue.core.simd_gather import larger_bits, natural, where_larger
from tissue.core.vec3 import dot, norm, vec3
from tissue.mesh.body import Body

_WAY_NEAR = 0.2
"""Sum of the ways of its nodes after which a near pair is looked at even if they moved alike, per
node size: as they turn."""

_AHEAD = 0.1
"""Speed [m/s] that a node is taken to have at least."""


@kernel
def reject_early(
    search: SearchState, forces: PenaltyForces, body: Body, begin: int, end: int
) -> None:
    """List the pairs that are due of some of the nodes, and write which of them do not touch.

    Args:
        search: Looks are written.
        forces: The contacts as they are.
        body: Where the nodes are.
        begin: The first, a place in `NearPairs.nodes`.
        end: The place behind the last.
    """
    looks = search.pairs.looks
    looks.n = looks.n_close = looks.next = looks.next_close = 0
    for i in range(begin, end):
        node = search.pairs.nodes[i]
        if search.is_due[node] == 1:
            _list_due(search, forces, body, node)
    for j in range(0, looks.n, WIDTH):
        _reject_eight(search, body, j)


@kernel
def _list_due(search: SearchState, forces: PenaltyForces, body: Body, node: int) -> None:
    """List the pairs of a node that are due, and up to where each may touch."""
    pairs, ways, looks = search.pairs, search.ways, search.pairs.looks
    first = natural(looks.n)
    n, least, own_way = first, math.inf, ways.way[node]
    # Which are due cannot be foretold: branches would take longer than what they skip.
    for k in range(natural(pairs.begin[node]), natural(pairs.end[node])):
        face = natural(pairs.face[k])
        know_motion(pairs, ways, face)
        way = own_way + pairs.way[face]
        left = pairs.wake[k] - way
        is_looked_at = (pairs.is_near[k] == 1) | (left < 0.0)
        looks.pair[n], looks.way[n] = k, way
        n += 1 if is_looked_at else 0
        least = min(least, math.inf if is_looked_at else left)
    looks.n = n
    search.calm_until[node] = ways.quiet_way + least
    _note_limits(search, body, node, first)
    _note_faces(search, forces, node, first)


@inlined
def _note_limits(search: SearchState, body: Body, node: int, first: int) -> None:
    """Note up to where a node may touch, for its looks from `first` on and to the next eight."""
    looks, size = search.pairs.looks, search.ways.node_size
    ahead = TIME_AHEAD * (norm(vec3(body.velocities, node)) + _AHEAD)
    highest = lanes(CONTACT_REACH * size + ahead)
    depth = DEPTH_OF_LOST if search.pairs.is_lost[node] == 1 else OVERLAP_DEPTH
    deepest, size_of_normal = lanes(depth * size), lanes(norm(vec3(search.normal, node)))
    for j in range(first, looks.n, WIDTH):
        store_lanes(looks.highest, j, highest)
        store_lanes(looks.deepest, j, deepest)
        store_lanes(looks.size_of_normal, j, size_of_normal)


@inlined
def _note_faces(search: SearchState, forces: PenaltyForces, node: int, first: int) -> None:
    """Note the nodes of the looks of a node from `first` on, and which it has contacts with."""
    pairs, looks = search.pairs, search.pairs.looks
    n = search.n_contacts[node] if search.listed_at[node] == search.n_listings else 0
    one = _corners(search, forces, node, 0, n)
    two, three = _corners(search, forces, node, 1, n), _corners(search, forces, node, 2, n)
    for j in range(first, natural(looks.n)):
        face = natural(pairs.face[natural(looks.pair[j])])
        a, b, c = pairs.triangle[face, 0], pairs.triangle[face, 1], pairs.triangle[face, 2]
        is_held = (
            (((a ^ one[0]) | (b ^ one[1]) | (c ^ one[2])) == 0)
            | (((a ^ two[0]) | (b ^ two[1]) | (c ^ two[2])) == 0)
            | (((a ^ three[0]) | (b ^ three[1]) | (c ^ three[2])) == 0)
        )
        looks.nodes[j, 0], looks.nodes[j, 1], looks.nodes[j, 2], looks.nodes[j, 3] = node, a, b, c
        looks.is_held[j] = 1.0 if is_held else 0.0


@inlined
def _corners(
    search: SearchState, forces: PenaltyForces, node: int, q: int, n: int
) -> tuple[int, int, int]:
    """Return the corners of the face of contact `q` of the `n` of a node; -1 behind the last."""
    if q >= n:
        return -1, -1, -1
    c = search.contact[node] + q
    return forces.node[c, 1], forces.node[c, 2], forces.node[c, 3]


@inlined
def _reject_eight(search: SearchState, body: Body, j: int) -> None:
    """Write up to where eight pairs need no other look, and list those that are close."""
    looks, size, zero = search.pairs.looks, search.ways.node_size, everywhere(0.0)
    over = over_faces(points_of_looks(body.positions, looks.nodes, j))
    own = points_of_looks(search.normal, looks.nodes, j).p
    highest, deepest = unfused(load_lanes(looks.highest, j)), unfused(load_lanes(looks.deepest, j))
    is_held = unfused(load_lanes(looks.is_held, j))
    facing = where_larger(is_held, zero, everywhere(HELD_FACING), everywhere(FACING))
    rim = where_larger(is_held, zero, everywhere(HELD_RIM), everywhere(RIM_OF_TOUCH))
    w, height = over.weights, over.height
    least = where_larger(w.y, w.z, w.z, w.y)
    outside = zero - rim - where_larger(w.x, least, least, w.x)
    slack = everywhere(0.3) * outside * square_root(over.length)
    slack = where_larger(outside, zero, slack, everywhere(-1.0))
    alike, most = dot(own, over.outward), facing * unfused(load_lanes(looks.size_of_normal, j))
    slack = where_larger(alike, most, everywhere(0.2 * CONTACT_REACH * size), slack)
    below = zero - height
    slack = where_larger(below, deepest, below - deepest, slack)
    above = everywhere(0.5) * (height - everywhere(CONTACT_REACH * size))
    slack = where_larger(height, highest, above, slack)
    way, still = unfused(load_lanes(looks.way, j)), everywhere(STILL * size)
    far = where_larger(slack, still, slack, still)
    wake = way + where_larger(zero, slack, everywhere(_WAY_NEAR * size), far)
    store_lanes(looks.wake, j, wake)
    store_lanes(looks.left, j, where_larger(zero, slack, still, wake - way))
    _note_result(search, j, larger_bits(zero, slack))


@inlined
def _note_result(search: SearchState, j: int, is_close: int) -> None:
    """Note of eight pairs which are close, and list those; `is_close`: a bit for each."""
    pairs, looks = search.pairs, search.pairs.looks
    n = natural(looks.n_close)
    for q in range(min(WIDTH, looks.n - j)):
        k, bit = natural(looks.pair[j + q]), is_close >> q & 1
        pairs.wake[k] = looks.wake[j + q]
        pairs.is_near[k] = bit
        looks.close[n] = j + q
        for corner in range(4):
            looks.close_nodes[n, corner] = looks.nodes[j + q, corner]
        n += bit
    looks.n_close = n
