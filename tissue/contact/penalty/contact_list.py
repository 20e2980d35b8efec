"""The list of contacts: a node gets one for each direction in which it is pushed, at most three.

A node that lies on the other lip meets all faces around the nodes there, and they all say the same:
only the nearest foot in each direction counts. What a node has is sought again once it or what is
near it has moved by as much as can matter; the others keep their contacts as they are.
"""

import math

from tissue.contact.penalty.contact_forces import PenaltyForces
from tissue.contact.penalty.contact_rows import (
    SAME_DIRECTION,
    begin_contact,
    copy_contact,
    take_over,
)
from tissue.contact.penalty.early_rejection import reject_early
from tissue.contact.penalty.near_pairs import CONTACT_REACH, know_motion, sort_by_faces
from tissue.contact.penalty.ridge_contacts import list_ridge_contacts
from tissue.contact.penalty.search_state import SearchState, are_many_moving
from tissue.contact.penalty.touch import STILL, TIME_AHEAD, Touch, look_closely, touch_of
from tissue.core.jit import kernel
from tissue.core.simd_gather import natural
from tissue.core.vec3 import Vec3, dot, store, sub, vec3
from tissue.mesh.body import Body

DIRECTIONS = 3
"""Contacts of a node with faces at most: more than three directions do not hold it any firmer."""

_NODES_AT_A_TIME = 32
"""Nodes whose pairs are looked at together. Larger: what is noted of them fills the cache; smaller:
more eights have empty lanes."""


@kernel
def find_due(search: SearchState, is_anew: bool) -> int:
    """Find the nodes whose contacts are to be sought; return how many.

    Args:
        search: `is_due` is written.
        is_anew: Whether pairs have just been updated.
    """
    pairs, ways, n = search.pairs, search.ways, 0
    is_quiet = not is_anew and ways.n_moving == 0
    if is_quiet and search.n_due == 0 and ways.quiet_way < search.all_calm_until:
        return 0
    all_calm_until, asks_all = math.inf, is_anew or are_many_moving(search)
    if not asks_all:
        _note_moving_faces(search)
    for i in range(pairs.n_nodes):
        node = natural(pairs.nodes[i])
        search.is_due[node] = 0
        is_calm = not asks_all and ways.quiet_way < search.calm_until[node]
        is_moving = ways.moved_at[node] == ways.frame or pairs.face_moved_at[node] == ways.frame
        if is_calm and not is_moving:
            all_calm_until = min(all_calm_until, search.calm_until[node])
            continue
        slack = _least_slack(search, node)
        has_lost = is_anew and pairs.lost_at[node] == pairs.n_updates
        if slack < 0.0 or has_lost:
            search.is_due[node] = 1
            n += 1
        search.calm_until[node] = ways.quiet_way + slack
        all_calm_until = min(all_calm_until, search.calm_until[node])
    search.n_due = n
    search.all_calm_until = all_calm_until
    return n


@kernel
def _note_moving_faces(search: SearchState) -> None:
    """Note at nodes which of them are paired with a face of which a corner has moved much."""
    pairs, moved_at, now = search.pairs, search.ways.moved_at, search.ways.frame
    if search.ways.n_moving == 0:
        return
    # Faces that a cut has just made may be more than there is room for; they are in no pair.
    n = min(search.faces.n_places, len(pairs.is_active))
    sort_by_faces(pairs, n)
    for at in range(n):
        if pairs.is_active[at] == 0:
            continue
        a, b, c = pairs.triangle[at, 0], pairs.triangle[at, 1], pairs.triangle[at, 2]
        if moved_at[a] == now or moved_at[b] == now or moved_at[c] == now:
            for i in range(pairs.face_begin[at], pairs.face_begin[at + 1]):
                pairs.face_moved_at[pairs.of_face[i]] = now


@kernel
def _least_slack(search: SearchState, node: int) -> float:
    """Return how much way is left before a pair of a node is to be looked at [m]; negative: now."""
    pairs, ways = search.pairs, search.ways
    still, least, own_way = STILL * ways.node_size, math.inf, ways.way[node]
    own = vec3(ways.displacement, node)
    for k in range(natural(pairs.begin[node]), natural(pairs.end[node])):
        face = natural(pairs.face[k])
        know_motion(pairs, ways, face)
        left = pairs.wake[k] - own_way - pairs.way[face]
        if pairs.is_near[k] == 1:
            relative = sub(own, vec3(pairs.displacement, face))
            moved = sub(relative, vec3(pairs.relative, k))
            left = min(left, still - math.sqrt(dot(moved, moved)))
        if left < 0.0:
            return float(left)
        least = min(least, left)
    return least


@kernel
def floor_changes(search: SearchState, body: Body) -> bool:
    """Whether a node came near the floor or left it."""
    if search.floor == -math.inf:
        return False
    for node in range(body.n_nodes):
        is_listed = search.floor_listed_at[node] == search.n_listings
        if _is_near_floor(search, body, node, is_listed) != is_listed:
            return True
    return False


@kernel
def list_contacts(search: SearchState, forces: PenaltyForces, body: Body) -> None:
    """Seek the contacts of nodes that are due, and list all.

    Room: DIRECTIONS for each node of a face, one for each node that may be on the floor, one for
    each pair of ridges that touch, and one for each contact of the last list.
    """
    pairs, now = search.pairs, search.n_listings + 1
    to, n = len(forces.push) // 2 - forces.first, 0
    for i in range(pairs.n_nodes):
        if i % _NODES_AT_A_TIME == 0:
            end = min(i + _NODES_AT_A_TIME, pairs.n_nodes)
            reject_early(search, forces, body, i, end)
            look_closely(search, body)
        node = pairs.nodes[i]
        was_listed = search.listed_at[node] == search.n_listings
        n_before = search.n_contacts[node] if was_listed else 0
        first, n_own = search.contact[node], n_before
        if search.is_due[node] == 1:
            n_own = _seek(search, forces, body, node, to + n)
            take_over(forces, body, (first, n_before), (to + n, n_own))
        else:
            for q in range(n_before):
                copy_contact(forces, first + q, to + n + q)
        search.listed_at[node] = now
        search.contact[node] = to + n
        search.n_contacts[node] = n_own
        n += n_own
    n = _list_floor_contacts(search, forces, body, to, n)
    n = list_ridge_contacts(search, forces, body, to, n)
    search.n_listings = now
    _list_fading_contacts(search, forces, body, to, n)
    forces.first = to


@kernel
def _list_fading_contacts(
    search: SearchState, forces: PenaltyForces, body: Body, to: int, n: int
) -> None:
    """List, behind the `n` others, what pressed in the last list and is no longer found.

    A node that has been pushed out on another side, or slid off a face, would snap back if the
    force that holds it ended at once.
    """
    first, end = forces.first, forces.first + forces.n_contacts
    n_fading = 0
    for c in range(first, end):
        if c >= end - forces.n_fading:
            _hand_to_node(search, forces, body, c)
        if forces.push[c] > 0.0:
            copy_contact(forces, c, to + n + n_fading)
            n_fading += 1
    forces.n_contacts, forces.n_fading = n + n_fading, n_fading


@kernel
def _hand_to_node(search: SearchState, forces: PenaltyForces, body: Body, c: int) -> None:
    """Let a contact of its node that has just begun go on with the force of fading contact `c`."""
    node = forces.node[c, 0]
    if forces.weight[c, 0] == 1.0 and search.listed_at[node] == search.n_listings:
        take_over(forces, body, (c, 1), (search.contact[node], search.n_contacts[node]))


@kernel
def _seek(search: SearchState, forces: PenaltyForces, body: Body, node: int, to: int) -> int:
    """Write the contacts of a node with faces from row `to` on; return how many."""
    pairs, looks, ways, n = search.pairs, search.pairs.looks, search.ways, 0
    least = search.calm_until[node] - ways.quiet_way
    while looks.next < looks.n and looks.nodes[looks.next, 0] == node:
        least = min(least, looks.left[looks.next])
        looks.next += 1
    search.calm_until[node] = ways.quiet_way + least
    own = vec3(ways.displacement, node)
    while looks.next_close < looks.n_close and looks.close_nodes[looks.next_close, 0] == node:
        i = looks.next_close
        looks.next_close += 1
        k = looks.pair[looks.close[i]]
        store(pairs.relative, k, sub(own, vec3(pairs.displacement, pairs.face[k])))
        touch = touch_of(search, forces, body, i)
        if touch.is_touching:
            n = _place(search, forces, (node, pairs.face[k]), touch, to, n)
    return n


@kernel
def _place(
    search: SearchState,
    forces: PenaltyForces,
    pair: tuple[int, int],
    touch: Touch,
    to: int,
    n: int,
) -> int:
    """Write a touch as a contact, unless one in its direction is nearer; return how many there are.

    Args:
        search: The nodes of faces.
        forces: Written.
        pair: Node and face.
        touch: Where they touch.
        to: Row of the first contact of this node.
        n: How many it has so far.
    """
    q = 0
    while q < n and dot(vec3(forces.normal, to + q), touch.normal) <= SAME_DIRECTION:
        q += 1
    if q == DIRECTIONS or (q < n and search.distance[q] <= touch.distance_squared):
        return n
    node, face = pair
    c, b = to + q, touch.b
    search.distance[q] = touch.distance_squared
    forces.node[c, 0] = node
    for corner in range(3):
        forces.node[c, 1 + corner] = search.pairs.triangle[face, corner]
    forces.weight[c, 0] = 1.0
    forces.weight[c, 1] = -b.x
    forces.weight[c, 2] = -b.y
    forces.weight[c, 3] = -b.z
    store(forces.normal, c, touch.normal)
    begin_contact(forces, c, 0.0)
    return max(n, q + 1)


@kernel
def _list_floor_contacts(
    search: SearchState, forces: PenaltyForces, body: Body, to: int, n: int
) -> int:
    """List the contacts with the floor behind the `n` others; return how many there are."""
    if search.floor == -math.inf:
        return n
    now = search.n_listings + 1
    for node in range(body.n_nodes):
        is_listed = search.floor_listed_at[node] == search.n_listings
        if not _is_near_floor(search, body, node, is_listed):
            continue
        c = to + n
        if is_listed:
            copy_contact(forces, search.floor_contact[node], c)
        else:
            for q in range(4):
                forces.node[c, q] = node
                forces.weight[c, q] = 1.0 if q == 0 else 0.0
            store(forces.normal, c, Vec3(0.0, 0.0, 1.0))
            begin_contact(forces, c, search.floor)
        search.floor_contact[node] = c
        search.floor_listed_at[node] = now
        n += 1
    return n


@kernel
def _is_near_floor(search: SearchState, body: Body, node: int, is_listed: bool) -> bool:
    """Whether a node is so near the floor that it needs a contact; a little longer, if it has."""
    if body.fixed[node]:
        return False
    falling = max(-body.velocities[node, 2], 0.0)
    reach = CONTACT_REACH * search.ways.node_size + TIME_AHEAD * falling
    return bool(body.positions[node, 2] - search.floor < (2.0 * reach if is_listed else reach))
