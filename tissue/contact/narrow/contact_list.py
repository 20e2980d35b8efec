"""The list of contacts: a node gets one for each direction in which it is pushed, at most three.

A node that lies on the other lip meets all faces around the nodes there, and they all say the same:
only the nearest foot in each direction counts. What a node has is sought again once it or what is
near it has moved by as much as can matter; the others keep their contacts as they are.
"""

import math
from typing import NamedTuple

from tissue.contact.geometry.faces import area_at_rest, has_inverted
from tissue.contact.narrow.edge_contacts import list_edge_contacts
from tissue.contact.narrow.node_face import (
    ENTRY,
    REST_REACH,
    STILL,
    TIME_AHEAD,
    measure_close_pairs,
    reject_early,
)
from tissue.contact.response.contacts import (
    SAME_DIRECTION,
    PenaltyForces,
    begin_contact,
    copy_contact,
    take_over,
    weighted_sum,
)
from tissue.contact.search.near_pairs import CONTACT_REACH, PairTests, know_motion, sort_by_faces
from tissue.contact.search.search_state import SearchState, are_many_moving
from tissue.core.jit import inlined, kernel
from tissue.core.simd_rows import natural
from tissue.core.vec3 import Vec3, dot, norm, store, sub, vec3
from tissue.mesh.body import Body

DIRECTIONS = 3
"""Contacts of a node with faces at most: more than three directions do not hold it any firmer."""

_NODES_AT_A_TIME = 32
"""Nodes whose pairs are tested together. Larger: what is recorded of them fills the cache; smaller:
more eights have empty lanes."""

_HELD_SHARE = 0.7
"""Share of its squared distance with which a face counts that the node has a contact with. Larger:
a node in a corner goes to and fro between two faces and trembles; smaller: it keeps one that it
left."""

_CAUGHT = 1.5
"""Depth of a node over that of its last contact up to which the overlap is the same."""

_RECAPTURED = 0.08
"""Overlap up to which a node without a contact is taken for one that lost it, per node size, unless
it lies behind that face in the body at rest. 0: what has lost its contact sinks in for good."""


class Touch(NamedTuple):
    """A node and a face."""

    is_touching: bool
    b: Vec3
    """Barycentric weights of the foot in the triangle."""
    normal: Vec3
    """Unit vector in which the node is pushed."""
    distance_squared: float
    """Squared distance of the node from the foot, less where it has that contact already [m2]."""


_NOTHING = Touch(False, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), 0.0)


@kernel
def find_due(search: SearchState, is_pairing: bool) -> int:
    """Find the nodes whose contacts are to be sought; return how many.

    Args:
        search: `is_due` is written.
        is_pairing: Whether pairs have just been updated.
    """
    pairs, motion, n = search.pairs, search.motion, 0
    is_quiet = not is_pairing and motion.n_moving == 0
    if is_quiet and search.n_due == 0 and motion.quiet_path < search.all_resting_until:
        return 0
    all_resting_until, tests_all = math.inf, is_pairing or are_many_moving(search)
    if not tests_all:
        _note_moving_faces(search)
    for i in range(pairs.n_nodes):
        node = natural(pairs.nodes[i])
        search.is_due[node] = 0
        is_resting = not tests_all and motion.quiet_path < search.resting_until[node]
        is_moving = (
            motion.moved_at[node] == motion.frame or pairs.face_moved_at[node] == motion.frame
        )
        if is_resting and not is_moving:
            all_resting_until = min(all_resting_until, search.resting_until[node])
            continue
        slack = _least_slack(search, node)
        was_unpaired = is_pairing and pairs.unpaired_at[node] == pairs.n_updates
        if slack < 0.0 or was_unpaired:
            search.is_due[node] = 1
            n += 1
        search.resting_until[node] = motion.quiet_path + slack
        all_resting_until = min(all_resting_until, search.resting_until[node])
    search.n_due = n
    search.all_resting_until = all_resting_until
    return n


@kernel
def _note_moving_faces(search: SearchState) -> None:
    """Record at nodes which of them are paired with a face of which a corner has moved much."""
    pairs, moved_at, now = search.pairs, search.motion.moved_at, search.motion.frame
    if search.motion.n_moving == 0:
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
    """Return how much path is left before a pair of a node is to be tested [m]; negative: now."""
    pairs, motion = search.pairs, search.motion
    still, least, own_path = STILL * motion.node_size, math.inf, motion.path[node]
    own = vec3(motion.displacement, node)
    for k in range(natural(pairs.begin[node]), natural(pairs.end[node])):
        face = natural(pairs.face[k])
        know_motion(pairs, motion, face)
        left = pairs.wake[k] - own_path - pairs.path[face]
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
    each pair of feature edges that touch, and one for each contact of the last list.
    """
    pairs, now = search.pairs, search.n_listings + 1
    to, n = len(forces.push) // 2 - forces.first, 0
    for i in range(pairs.n_nodes):
        if i % _NODES_AT_A_TIME == 0:
            end = min(i + _NODES_AT_A_TIME, pairs.n_nodes)
            reject_early(search, forces, body, i, end)
            measure_close_pairs(search, body)
        node = pairs.nodes[i]
        was_listed = search.listed_at[node] == search.n_listings
        n_before = search.n_contacts[node] if was_listed else 0
        first, n_own = search.contact[node], n_before
        if search.is_due[node] == 1:
            n_own = _find_contacts(search, forces, body, node, to + n)
            take_over(forces, body, (first, n_before), (to + n, n_own))
        else:
            for q in range(n_before):
                copy_contact(forces, first + q, to + n + q)
        search.listed_at[node] = now
        search.contact[node] = to + n
        search.n_contacts[node] = n_own
        n += n_own
    n = _list_floor_contacts(search, forces, body, to, n)
    n = list_edge_contacts(search, forces, body, to, n)
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
    """Give the force of fading contact `c` to a contact of its node that has just begun."""
    node = forces.node[c, 0]
    if forces.weight[c, 0] == 1.0 and search.listed_at[node] == search.n_listings:
        take_over(forces, body, (c, 1), (search.contact[node], search.n_contacts[node]))


@kernel
def _find_contacts(
    search: SearchState, forces: PenaltyForces, body: Body, node: int, to: int
) -> int:
    """Write the contacts of a node with faces from row `to` on; return how many."""
    pairs, tests, motion, n = search.pairs, search.pairs.tests, search.motion, 0
    least = search.resting_until[node] - motion.quiet_path
    while tests.next < tests.n and tests.nodes[tests.next, 0] == node:
        least = min(least, tests.left[tests.next])
        tests.next += 1
    search.resting_until[node] = motion.quiet_path + least
    own = vec3(motion.displacement, node)
    while tests.next_close < tests.n_close and tests.close_nodes[tests.next_close, 0] == node:
        i = tests.next_close
        tests.next_close += 1
        k = tests.pair[tests.close[i]]
        store(pairs.relative, k, sub(own, vec3(pairs.displacement, pairs.face[k])))
        touch = _touch_of(search, forces, body, i)
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
def _touch_of(search: SearchState, forces: PenaltyForces, body: Body, i: int) -> Touch:
    """Return whether the node of a close pair touches the face.

    Args:
        search: The contacts that the node has, and where it was.
        forces: The contacts as they are.
        body: Where the nodes are.
        i: The close pair.
    """
    tests = search.pairs.tests
    distance = tests.distance[i]
    if not distance >= 0.0:
        return _NOTHING
    nodes = tests.close_nodes
    four = (nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3])
    if has_inverted(search.inverted_step, search.step, four):
        return _NOTHING
    if not _came_from_outside(search, forces, body, i):
        return _NOTHING
    foot = Vec3(tests.foot[i, 0], tests.foot[i, 1], tests.foot[i, 2])
    share = _HELD_SHARE if tests.is_held[tests.close[i]] == 1.0 else 1.0
    return Touch(True, foot, _push(tests, i), share * distance)


@inlined
def _push(tests: PairTests, i: int) -> Vec3:
    """Return the unit vector in which a close pair would push its node."""
    return Vec3(tests.push[i, 0], tests.push[i, 1], tests.push[i, 2])


@inlined
def _came_from_outside(search: SearchState, forces: PenaltyForces, body: Body, i: int) -> bool:
    """Whether a node was outside a face in the last search, or in contact there, or lost contact.

    The body at rest does not overlap itself: a node that is behind a face there is on the other
    side of a thin piece of tissue.
    """
    pairs, tests, size = search.pairs, search.pairs.tests, search.motion.node_size
    nodes, gap, gap_before = tests.close_nodes, tests.push[i, 3], tests.foot[i, 3]
    node = nodes[i, 0]
    if gap_before >= -(ENTRY * size):
        return True
    deepest = ENTRY * size + _CAUGHT * _depth_before(search, forces, node, _push(tests, i))
    if gap_before >= -deepest:
        return True
    if pairs.is_penetrating[node] == 0 and gap < -_RECAPTURED * size:
        return False
    rest = body.rest
    area = area_at_rest(body, nodes[i, 1], nodes[i, 2], nodes[i, 3])
    from_corner = sub(vec3(rest, node), vec3(rest, nodes[i, 1]))
    behind = dot(area, from_corner) < -1e-3 * size * norm(area)
    reach = REST_REACH * size
    return not (behind and dot(from_corner, from_corner) < reach * reach)


@kernel
def _depth_before(search: SearchState, forces: PenaltyForces, node: int, normal: Vec3) -> float:
    """Return how deep the contacts of a node in about that direction were in the last search."""
    if search.listed_at[node] != search.n_listings:
        return 0.0
    deepest = 0.0
    for c in range(search.contact[node], search.contact[node] + search.n_contacts[node]):
        if dot(vec3(forces.normal, c), normal) > 0.5:
            gap = dot(vec3(forces.normal, c), weighted_sum(forces, c, search.motion.before))
            deepest = max(deepest, forces.height[c] - gap)
    return deepest


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
    reach = CONTACT_REACH * search.motion.node_size + TIME_AHEAD * falling
    return bool(body.positions[node, 2] - search.floor < (2.0 * reach if is_listed else reach))
