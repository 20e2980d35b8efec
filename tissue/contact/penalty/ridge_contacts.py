"""Contacts of ridges: which are to be sought in a time step, and their rows in the list."""

import math

from tissue.contact.penalty.contact_forces import PenaltyForces
from tissue.contact.penalty.contact_rows import begin_contact, copy_contact, take_over
from tissue.contact.penalty.ridge_pairs import NOT_LISTED, sort_by_ridges
from tissue.contact.penalty.ridge_touch import ridge_touch_of
from tissue.contact.penalty.search_state import SearchState, are_many_moving
from tissue.core.jit import kernel
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
    found, ways, has_changed = search.ridge_pairs, search.ways, False
    is_calm = ways.quiet_way < found.calm_until
    if not is_calm or are_many_moving(search):
        _measure_ridges(search)
        if search.is_anew == 1:
            _sort_contacts(search, forces)
        found.calm_until = math.inf
        for k in range(found.n_pairs):
            has_changed = _look_if_moved(search, forces, body, k) or has_changed
    elif ways.n_moving > 0:
        has_changed = _look_at_moving_ridges(search, forces, body)
    return has_changed or bool(found.n_touching < found.n_contacts)


@kernel
def _measure_ridges(search: SearchState) -> None:
    """Add up the ways of the ends of all ridges."""
    ridges, way = search.ridges, search.ways.way
    for i in range(ridges.n_ridges):
        edge = ridges.listed[i]
        ridges.way[edge] = way[ridges.node[edge, 0]] + way[ridges.node[edge, 1]]


@kernel
def _look_at_moving_ridges(search: SearchState, forces: PenaltyForces, body: Body) -> bool:
    """Look at the pairs of ridges of which an end moved much; see `find_touching_ridges`."""
    found, ridges, ways, has_changed = search.ridge_pairs, search.ridges, search.ways, False
    _measure_ridges(search)
    sort_by_ridges(found, ridges)
    for i in range(ridges.n_ridges):
        edge = ridges.listed[i]
        a, b = ridges.node[edge, 0], ridges.node[edge, 1]
        if ways.moved_at[a] != ways.frame and ways.moved_at[b] != ways.frame:
            continue
        for e in range(ridges.first_pair[edge], ridges.first_pair[edge + 1]):
            k = found.of_ridge[e]
            has_changed = _look_if_moved(search, forces, body, k) or has_changed
    return has_changed


@kernel
def _look_if_moved(search: SearchState, forces: PenaltyForces, body: Body, k: int) -> bool:
    """Look at pair `k` if its nodes moved enough; return whether it was, and touches, or did."""
    found, way = search.ridge_pairs, search.ridges.way
    moved = way[found.ridge[k, 0]] + way[found.ridge[k, 1]]
    has_changed = moved > found.wake[k] and _look_at_ridges(search, forces, body, k, moved)
    calm_until = search.ways.quiet_way + (found.wake[k] - moved)
    found.calm_until = min(found.calm_until, calm_until)
    return has_changed


@kernel
def _look_at_ridges(
    search: SearchState, forces: PenaltyForces, body: Body, k: int, way: float
) -> bool:
    """Look at a pair of ridges; return whether it touches, or did.

    Args:
        search: The pair is written.
        forces: The contacts as they are.
        body: Where the nodes are.
        k: The pair.
        way: Sum of the ways of its nodes [m].
    """
    found = search.ridge_pairs
    if found.wake[k] < 0.0:
        found.contact[k] = _contact_of(search, forces, k)
    touch, did_touch = ridge_touch_of(search, body, k), found.is_touching[k]
    found.wake[k] = way + touch.slack
    found.is_touching[k] = 1 if touch.is_touching else 0
    found.n_touching += found.is_touching[k] - did_touch
    found.is_sought[k] = 1
    found.place[k, 0], found.place[k, 1] = touch.s, touch.t
    store(found.normal, k, touch.normal)
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
