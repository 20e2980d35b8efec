"""Contacts of feature edges: which pairs are tested in a time step, and their rows in the list."""

import math

from tissue.contact.narrow.edge_edge import (
    LEAST_SLACK,
    crossing_pairs,
    edge_touch_of,
    note_ends,
    note_tips,
    pushing_pairs,
)
from tissue.contact.response.contacts import PenaltyForces, begin_contact, copy_contact, take_over
from tissue.contact.search.edge_pairs import NOT_LISTED, sort_by_edges
from tissue.contact.search.search_state import SearchState, are_many_moving
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH
from tissue.core.vec3 import store, vec3
from tissue.mesh.body import Body


@kernel
def find_touching_edges(search: SearchState, forces: PenaltyForces, body: Body) -> bool:
    """Test the edges that moved enough; return whether any touch, or did.

    Args:
        search: The pairs of edges are written.
        forces: The contacts as they are.
        body: Where the nodes are.
    """
    found, motion, n = search.edge_pairs, search.motion, 0
    is_resting = motion.quiet_path < found.resting_until
    if not is_resting or are_many_moving(search):
        _measure_edges(search)
        if search.is_pairing == 1:
            _sort_contacts(search, forces)
        n = _list_due(search)
    elif motion.n_moving > 0:
        _measure_edges(search)
        n = _list_due_of_moving(search)
    has_changed = n > 0 and _test_due(search, forces, body, n)
    return has_changed or bool(found.n_touching < found.n_contacts)


@kernel
def _measure_edges(search: SearchState) -> None:
    """Add up the paths of the ends of all edges."""
    edges, path = search.edges, search.motion.path
    for i in range(edges.n_edges):
        edge = edges.listed[i]
        edges.path[edge] = path[edges.node[edge, 0]] + path[edges.node[edge, 1]]


@kernel
def _list_due(search: SearchState) -> int:
    """List the pairs whose nodes moved enough; return how many."""
    found, n, least = search.edge_pairs, 0, math.inf
    for k in range(found.n_pairs):
        left = found.wake[k] - _path_of(search, k)
        found.due[n] = k
        n += 1 if left < 0.0 else 0
        least = min(least, left if left >= 0.0 else math.inf)
    found.resting_until = search.motion.quiet_path + least
    return n


@kernel
def _list_due_of_moving(search: SearchState) -> int:
    """List the pairs of edges of which an end moved much as `_list_due` does."""
    found, edges, n = search.edge_pairs, search.edges, 0
    sort_by_edges(found, edges)
    for i in range(edges.n_edges):
        edge = edges.listed[i]
        if not _is_moving(search, edge):
            continue
        for e in range(edges.first_pair[edge], edges.first_pair[edge + 1]):
            k = found.of_edge[e]
            if found.edge[k, 1] == edge and _is_moving(search, found.edge[k, 0]):
                continue  # listed with its other edge
            left = found.wake[k] - _path_of(search, k)
            if left < 0.0:
                found.due[n] = k
                n += 1
            else:
                found.resting_until = min(found.resting_until, search.motion.quiet_path + left)
    return n


@inlined
def _is_moving(search: SearchState, edge: int) -> bool:
    """Whether an end of an edge moved much since the last search."""
    node, moved_at, now = search.edges.node, search.motion.moved_at, search.motion.frame
    return bool(moved_at[node[edge, 0]] == now or moved_at[node[edge, 1]] == now)


@inlined
def _path_of(search: SearchState, k: int) -> float:
    """Return the sum of the paths of the nodes of pair `k` [m]."""
    found, path = search.edge_pairs, search.edges.path
    return float(path[found.edge[k, 0]] + path[found.edge[k, 1]])


@kernel
def _test_due(search: SearchState, forces: PenaltyForces, body: Body, n: int) -> bool:
    """Test the first `n` pairs of `due`; return whether any touch, or did.

    Args:
        search: The pairs are written.
        forces: The contacts as they are.
        body: Where the nodes are.
        n: How many.
    """
    found, size, has_changed, n_near = search.edge_pairs, search.motion.node_size, False, 0
    note_ends(found, search.edges, n)
    for first in range(0, n, WIDTH):
        may_touch = crossing_pairs(found, body, size, first)
        for q in range(min(WIDTH, n - first)):
            k = found.due[first + q]
            if may_touch >> q & 1 == 1:
                found.due[n_near] = k
                n_near += 1
            else:
                has_changed = _mark_apart(search, k, found.slack[q]) or has_changed
    note_ends(found, search.edges, n_near)
    note_tips(found, search.edges, n_near)
    for first in range(0, n_near, WIDTH):
        may_touch = pushing_pairs(found, body, first)
        for q in range(min(WIDTH, n_near - first)):
            k = found.due[first + q]
            if may_touch >> q & 1 == 1:
                has_changed = _test_pair(search, forces, body, k) or has_changed
            else:
                has_changed = _mark_apart(search, k, LEAST_SLACK * size) or has_changed
    return has_changed


@inlined
def _mark_apart(search: SearchState, k: int, slack: float) -> bool:
    """Mark pair `k` as apart; return whether it did.

    Args:
        search: The pair is written.
        k: The pair.
        slack: By how much the paths of its nodes may add up before it needs another test [m].
    """
    found = search.edge_pairs
    did_touch = found.is_touching[k]
    found.is_touching[k] = 0
    found.n_touching -= did_touch
    _defer(search, k, slack)
    return bool(did_touch == 1)


@inlined
def _defer(search: SearchState, k: int, slack: float) -> None:
    """Defer the test of pair `k` until the paths of its nodes have added up to `slack` [m]."""
    found, path = search.edge_pairs, _path_of(search, k)
    found.wake[k] = path + slack
    resting_until = search.motion.quiet_path + (found.wake[k] - path)
    found.resting_until = min(found.resting_until, resting_until)


@kernel
def _test_pair(search: SearchState, forces: PenaltyForces, body: Body, k: int) -> bool:
    """Test a pair of edges; return whether it touches, or did.

    Args:
        search: The pair is written.
        forces: The contacts as they are.
        body: Where the nodes are.
        k: The pair.
    """
    found = search.edge_pairs
    if found.wake[k] < 0.0:
        found.contact[k] = _contact_of(search, forces, k)
    touch, did_touch = edge_touch_of(search, body, k), found.is_touching[k]
    found.is_touching[k] = 1 if touch.is_touching else 0
    found.n_touching += found.is_touching[k] - did_touch
    found.is_tested[k] = 1
    found.place[k, 0], found.place[k, 1] = touch.s, touch.t
    store(found.normal, k, touch.normal)
    _defer(search, k, touch.slack)
    return touch.is_touching or bool(did_touch == 1)


@kernel
def _sort_contacts(search: SearchState, forces: PenaltyForces) -> None:
    """Link the contacts of edges that begin with the same node."""
    found, last, now = search.edge_pairs, search.edge_contact, search.motion.frame
    for i in range(found.n_contacts):
        node = forces.node[found.first + i, 0]
        is_first = search.edge_contact_at[node] != now
        found.before[i] = NOT_LISTED if is_first else last[node]
        search.edge_contact_at[node], last[node] = now, i


@kernel
def _contact_of(search: SearchState, forces: PenaltyForces, k: int) -> int:
    """Return the contact that a pair had before it was paired again, or NOT_LISTED."""
    found, edges = search.edge_pairs, search.edges
    one, other = found.edge[k, 0], found.edge[k, 1]
    node = edges.node[one, 0]
    if search.edge_contact_at[node] != search.motion.frame:
        return NOT_LISTED
    i = search.edge_contact[node]
    while i != NOT_LISTED:
        c = found.first + i
        if (
            forces.node[c, 1] == edges.node[one, 1]
            and forces.node[c, 2] == edges.node[other, 0]
            and forces.node[c, 3] == edges.node[other, 1]
        ):
            return int(c)
        i = found.before[i]
    return NOT_LISTED


@kernel
def list_edge_contacts(
    search: SearchState, forces: PenaltyForces, body: Body, to: int, n: int
) -> int:
    """List the contacts of edges behind the `n` others; return how many there are.

    Args:
        search: The pairs of edges are written.
        forces: Written. Room: one contact for each pair that touches.
        body: Where the nodes are.
        to: First row of the list.
        n: How many contacts it has so far.
    """
    found, edges = search.edge_pairs, search.edges
    first = to + n
    for k in range(found.n_pairs):
        before = found.contact[k]
        found.contact[k] = NOT_LISTED
        if found.is_touching[k] == 0:
            continue
        c = to + n
        if found.is_tested[k] == 0 and before != NOT_LISTED:
            copy_contact(forces, before, c)
        else:
            s, t = found.place[k, 0], found.place[k, 1]
            one, other = found.edge[k, 0], found.edge[k, 1]
            forces.node[c, 0], forces.node[c, 1] = edges.node[one, 0], edges.node[one, 1]
            forces.node[c, 2], forces.node[c, 3] = edges.node[other, 0], edges.node[other, 1]
            forces.weight[c, 0], forces.weight[c, 1] = 1.0 - s, s
            forces.weight[c, 2], forces.weight[c, 3] = t - 1.0, -t
            store(forces.normal, c, vec3(found.normal, k))
            begin_contact(forces, c, 0.0)
            if before != NOT_LISTED:
                take_over(forces, body, (before, 1), (c, 1))
        found.contact[k] = c
        found.is_tested[k] = 0
        n += 1
    found.first, found.n_contacts = first, to + n - first
    return n
