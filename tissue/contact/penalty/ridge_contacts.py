"""Contacts of ridges: which are to be sought in a time step, and their rows in the list."""

import math

from tissue.contact.penalty.contact_forces import PenaltyForces
from tissue.contact.penalty.contact_rows import begin_contact, copy_contact, take_over
from tissue.contact.penalty.ridge_pairs import NOT_LISTED, sort_by_ridges
from tissue.contact.penalty.ridge_prefilter import (
    crossing_ridges,
    note_ends,
    note_tips,
    pushing_ridges,
)
from tissue.contact.penalty.ridge_touch import LEAST_SLACK, ridge_touch_of
from tissue.contact.penalty.search_state import SearchState, are_many_moving
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH
from tissue.core.vec3 import store, vec3
from tissue.mesh.body import Body


@kernel
def find_touching_ridges(search: SearchState, forces: PenaltyForces, body: Body) -> bool:
    """Look at the ridges that moved enough; return whether any touch, or did.

    Args:
        search: The pairs of ridges are written.
        forces: The contacts as they are.
        body: Where the nodes are.
    """
    found, ways, n = search.ridge_pairs, search.ways, 0
    is_calm = ways.quiet_way < found.calm_until
    if not is_calm or are_many_moving(search):
        _measure_ridges(search)
        if search.is_anew == 1:
            _sort_contacts(search, forces)
        n = _list_asked(search)
    elif ways.n_moving > 0:
        _measure_ridges(search)
        n = _list_asked_of_moving(search)
    has_changed = n > 0 and _look_at_asked(search, forces, body, n)
    return has_changed or bool(found.n_touching < found.n_contacts)


@kernel
def _measure_ridges(search: SearchState) -> None:
    """Add up the ways of the ends of all ridges."""
    ridges, way = search.ridges, search.ways.way
    for i in range(ridges.n_ridges):
        edge = ridges.listed[i]
        ridges.way[edge] = way[ridges.node[edge, 0]] + way[ridges.node[edge, 1]]


@kernel
def _list_asked(search: SearchState) -> int:
    """List the pairs whose nodes moved enough; return how many."""
    found, n, least = search.ridge_pairs, 0, math.inf
    for k in range(found.n_pairs):
        left = found.wake[k] - _way_of(search, k)
        found.asked[n] = k
        n += 1 if left < 0.0 else 0
        least = min(least, left if left >= 0.0 else math.inf)
    found.calm_until = search.ways.quiet_way + least
    return n


@kernel
def _list_asked_of_moving(search: SearchState) -> int:
    """List the pairs of ridges of which an end moved much as `_list_asked` does."""
    found, ridges, n = search.ridge_pairs, search.ridges, 0
    sort_by_ridges(found, ridges)
    for i in range(ridges.n_ridges):
        edge = ridges.listed[i]
        if not _is_moving(search, edge):
            continue
        for e in range(ridges.first_pair[edge], ridges.first_pair[edge + 1]):
            k = found.of_ridge[e]
            if found.ridge[k, 1] == edge and _is_moving(search, found.ridge[k, 0]):
                continue  # listed with its other ridge
            left = found.wake[k] - _way_of(search, k)
            if left < 0.0:
                found.asked[n] = k
                n += 1
            else:
                found.calm_until = min(found.calm_until, search.ways.quiet_way + left)
    return n


@inlined
def _is_moving(search: SearchState, edge: int) -> bool:
    """Whether an end of a ridge moved much since the last search."""
    node, moved_at, now = search.ridges.node, search.ways.moved_at, search.ways.frame
    return bool(moved_at[node[edge, 0]] == now or moved_at[node[edge, 1]] == now)


@inlined
def _way_of(search: SearchState, k: int) -> float:
    """Return the sum of the ways of the nodes of pair `k` [m]."""
    found, way = search.ridge_pairs, search.ridges.way
    return float(way[found.ridge[k, 0]] + way[found.ridge[k, 1]])


@kernel
def _look_at_asked(search: SearchState, forces: PenaltyForces, body: Body, n: int) -> bool:
    """Look at the first `n` pairs of `asked`; return whether any touch, or did.

    Args:
        search: The pairs are written.
        forces: The contacts as they are.
        body: Where the nodes are.
        n: How many.
    """
    found, size, has_changed, n_near = search.ridge_pairs, search.ways.node_size, False, 0
    note_ends(found, search.ridges, n)
    for first in range(0, n, WIDTH):
        may_touch = crossing_ridges(found, body, size, first)
        for q in range(min(WIDTH, n - first)):
            k = found.asked[first + q]
            if may_touch >> q & 1 == 1:
                found.asked[n_near] = k
                n_near += 1
            else:
                has_changed = _leave(search, k, found.slack[q]) or has_changed
    note_ends(found, search.ridges, n_near)
    note_tips(found, search.ridges, n_near)
    for first in range(0, n_near, WIDTH):
        may_touch = pushing_ridges(found, body, first)
        for q in range(min(WIDTH, n_near - first)):
            k = found.asked[first + q]
            if may_touch >> q & 1 == 1:
                has_changed = _look_at_ridges(search, forces, body, k) or has_changed
            else:
                has_changed = _leave(search, k, LEAST_SLACK * size) or has_changed
    return has_changed


@inlined
def _leave(search: SearchState, k: int, slack: float) -> bool:
    """Note that pair `k` does not touch; return whether it did.

    Args:
        search: The pair is written.
        k: The pair.
        slack: By how much the ways of its nodes may add up before it needs another look [m].
    """
    found = search.ridge_pairs
    did_touch = found.is_touching[k]
    found.is_touching[k] = 0
    found.n_touching -= did_touch
    _sleep(search, k, slack)
    return bool(did_touch == 1)


@inlined
def _sleep(search: SearchState, k: int, slack: float) -> None:
    """Let pair `k` need no look until the ways of its nodes have added up to `slack` [m]."""
    found, way = search.ridge_pairs, _way_of(search, k)
    found.wake[k] = way + slack
    calm_until = search.ways.quiet_way + (found.wake[k] - way)
    found.calm_until = min(found.calm_until, calm_until)


@kernel
def _look_at_ridges(search: SearchState, forces: PenaltyForces, body: Body, k: int) -> bool:
    """Look at a pair of ridges; return whether it touches, or did.

    Args:
        search: The pair is written.
        forces: The contacts as they are.
        body: Where the nodes are.
        k: The pair.
    """
    found = search.ridge_pairs
    if found.wake[k] < 0.0:
        found.contact[k] = _contact_of(search, forces, k)
    touch, did_touch = ridge_touch_of(search, body, k), found.is_touching[k]
    found.is_touching[k] = 1 if touch.is_touching else 0
    found.n_touching += found.is_touching[k] - did_touch
    found.is_sought[k] = 1
    found.place[k, 0], found.place[k, 1] = touch.s, touch.t
    store(found.normal, k, touch.normal)
    _sleep(search, k, touch.slack)
    return touch.is_touching or bool(did_touch == 1)


@kernel
def _sort_contacts(search: SearchState, forces: PenaltyForces) -> None:
    """Link the contacts of ridges that begin with the same node."""
    found, last, now = search.ridge_pairs, search.ridge_contact, search.ways.frame
    for i in range(found.n_contacts):
        node = forces.node[found.first + i, 0]
        is_first = search.ridge_contact_at[node] != now
        found.before[i] = NOT_LISTED if is_first else last[node]
        search.ridge_contact_at[node], last[node] = now, i


@kernel
def _contact_of(search: SearchState, forces: PenaltyForces, k: int) -> int:
    """Return the contact that a pair had before it was paired anew, or NOT_LISTED."""
    found, ridges = search.ridge_pairs, search.ridges
    one, other = found.ridge[k, 0], found.ridge[k, 1]
    node = ridges.node[one, 0]
    if search.ridge_contact_at[node] != search.ways.frame:
        return NOT_LISTED
    i = search.ridge_contact[node]
    while i != NOT_LISTED:
        c = found.first + i
        if (
            forces.node[c, 1] == ridges.node[one, 1]
            and forces.node[c, 2] == ridges.node[other, 0]
            and forces.node[c, 3] == ridges.node[other, 1]
        ):
            return int(c)
        i = found.before[i]
    return NOT_LISTED


@kernel
def list_ridge_contacts(
    search: SearchState, forces: PenaltyForces, body: Body, to: int, n: int
) -> int:
    """List the contacts of ridges behind the `n` others; return how many there are.

    Args:
        search: The pairs of ridges are written.
        forces: Written. Room: one contact for each pair that touches.
        body: Where the nodes are.
        to: First row of the list.
        n: How many contacts it has so far.
    """
    found, ridges = search.ridge_pairs, search.ridges
    first = to + n
    for k in range(found.n_pairs):
        before = found.contact[k]
        found.contact[k] = NOT_LISTED
        if found.is_touching[k] == 0:
            continue
        c = to + n
        if found.is_sought[k] == 0 and before != NOT_LISTED:
            copy_contact(forces, before, c)
        else:
            s, t = found.place[k, 0], found.place[k, 1]
            one, other = found.ridge[k, 0], found.ridge[k, 1]
            forces.node[c, 0], forces.node[c, 1] = ridges.node[one, 0], ridges.node[one, 1]
            forces.node[c, 2], forces.node[c, 3] = ridges.node[other, 0], ridges.node[other, 1]
            forces.weight[c, 0], forces.weight[c, 1] = 1.0 - s, s
            forces.weight[c, 2], forces.weight[c, 3] = t - 1.0, -t
            store(forces.normal, c, vec3(found.normal, k))
            begin_contact(forces, c, 0.0)
            if before != NOT_LISTED:
                take_over(forces, body, (before, 1), (c, 1))
        found.contact[k] = c
        found.is_sought[k] = 0
        n += 1
    found.first, found.n_contacts = first, to + n - first
    return n
