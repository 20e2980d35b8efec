"""The search for contacts in a time step: one kernel, which costs little where nothing touches."""

import math

from tissue.contact.geometry.faces import (
    has_room_for_changed,
    update_changed_faces,
    update_normals,
)
from tissue.contact.narrow.contact_list import (
    DIRECTIONS,
    find_due,
    floor_changes,
    list_contacts,
)
from tissue.contact.narrow.edge_contacts import find_touching_edges
from tissue.contact.narrow.penetrating_nodes import find_penetrating_nodes
from tissue.contact.response.contacts import PenaltyForces, clear_contact_totals
from tissue.contact.response.stiffness import Limits, fade, limit_stiffness, recover, split_masses
from tissue.contact.search.edge_pairs import pair_edges
from tissue.contact.search.node_motion import DIVERGED, IN_BALL, measure_motion, note_places
from tissue.contact.search.pair_update import SKIN_PATH, take_faces, update_pairs
from tissue.contact.search.search_state import SearchState
from tissue.contact.search.self_proximity import find_self_proximity
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.mesh.body import Body
from tissue.mesh.changes import Change

BEGIN, _PAIRS, _LIST = 0, 1, 2
"""Stages of a search: it begins; pairs are updated; contacts are listed."""

DONE, NO_ROOM_FOR_PAIRS, NO_ROOM_FOR_CONTACTS = 0, 1, 2
"""Results of a search."""

NEEDS_SKIN, SEARCH_IS_DUE = 3, 4
"""Results of `wake_contacts`; the first one: skin is near itself, and has no faces yet."""

SEARCHES_TO_NORMALS = 8
"""Searches after which normals are computed again where no pair is updated."""

_SEARCHES_TO_NEW_FACES = 4
"""Searches after which faces that a cut made are paired. Those that are gone still have their
nodes, so that what they hold meanwhile keeps its momentum."""


@kernel
def begin_contacts(search: SearchState, forces: PenaltyForces) -> None:
    """Clear the totals of a time step, and search before its first substep."""
    if search.has_touched == 1:
        clear_contact_totals(forces)
    search.has_touched = 1 if search.n_found > 0 else 0
    search.is_searched = search.is_tested = 0


@kernel
def take_changed_faces(search: SearchState, body: Body, change: Change) -> bool:
    """Take the faces of tetrahedra that a pass of a cut changed; return whether there was room."""
    if not has_room_for_changed(search.faces, change):
        return False
    update_changed_faces(search.faces, body, change)
    search.has_new_faces = search.is_listing_due = 1
    search.is_searched = 0
    if search.faces.n_places > 0:
        search.is_awake = 1
    return True


@kernel
def wake_contacts(search: SearchState, body: Body) -> int:
    """Test once in a time step whether skin is near itself, or the floor near.

    Returns:
        DONE; SEARCH_IS_DUE where anything could touch, and contacts were not searched since the
        step began; or NEEDS_SKIN: call again with faces of skin.
    """
    if search.acts == 1 and search.is_tested == 0:
        is_near = find_self_proximity(search.proximity, search.motion, search.faces, body)
        if is_near and search.faces.has_skin == 0:
            return NEEDS_SKIN
        search.is_tested = 1
        if search.is_awake == 0 and floor_changes(search, body):
            search.is_awake = 1
    return SEARCH_IS_DUE if search.is_awake == 1 and search.is_searched == 0 else DONE


@kernel
def added_frequency(search: SearchState, limits: Limits) -> float:
    """Return the largest part of contact in w^2 of the body [1/s2]."""
    return limits.added if search.n_found > 0 else 0.0


@kernel
def search_contacts(
    search: SearchState,
    forces: PenaltyForces,
    limits: Limits,
    body: Body,
    frequency_squared: FloatArray,
    highest: float,
    room: float,
    seconds: float,
) -> int:
    """Find the contacts of a time step; return DONE, or what needs room, to call again.

    Args:
        search: Written.
        forces: The contacts; written.
        limits: Limits of their stiffness; written.
        body: Where the nodes are.
        frequency_squared: Bound on w^2 of each node without contact [1/s2].
        highest: Bound on w^2 of the body without contact [1/s2].
        room: What may be added to that without another step [1/s2].
        seconds: Length of the time step [s].
    """
    pairs, motion = search.pairs, search.motion
    if search.stage == BEGIN:
        where = measure_motion(motion, body, pairs.nodes, pairs.n_nodes)
        if where == DIVERGED:
            forces.n_contacts = forces.n_fading = 0
            search.n_listings += 1
            search.is_pairing_due = 1
            _note_search(search, forces)
            return DONE
        search.is_pairing = _needs_pairing(search, body, where != IN_BALL)
        _renew_normals(search, body)
        search.stage = _PAIRS
    if search.stage == _PAIRS:
        if search.is_pairing == 1:
            if not update_pairs(pairs, motion, search.edges, search.faces, body, search.normal):
                return NO_ROOM_FOR_PAIRS
            if not pair_edges(search.edge_pairs, search.edges, pairs, motion, search.faces):
                return NO_ROOM_FOR_PAIRS
            search.since_pairing = 0
            search.is_pairing_due = search.has_new_faces = 0
            search.is_listing_due = 1
        search.stage = _LIST
    n_due = find_due(search, search.is_pairing == 1)
    if find_touching_edges(search, forces, body) or n_due > 0 or floor_changes(search, body):
        search.is_listing_due = 1
    if search.is_listing_due == 1:
        if _most_contacts(search, forces, body) > len(forces.push) // 2:
            return NO_ROOM_FOR_CONTACTS
        list_contacts(search, forces, body)
        limit_stiffness(limits, highest, room)
        split_masses(forces, limits, body, frequency_squared, search.share)
        search.is_listing_due = 0
    find_penetrating_nodes(search, body)
    recover(forces, limits, body, search.recovered, seconds)
    if fade(forces, limits, body, seconds):
        search.is_listing_due = 1
    note_places(motion, body)
    search.stage = BEGIN
    _note_search(search, forces)
    return DONE


@kernel
def _note_search(search: SearchState, forces: PenaltyForces) -> None:
    """Note that contacts were searched in this time step, and how many there are."""
    search.is_searched = 1
    search.n_found = forces.n_contacts
    if search.n_found > 0:
        search.has_touched = 1


@kernel
def _needs_pairing(search: SearchState, body: Body, has_left: bool) -> bool:
    """Whether pairs are out of date; `has_left`: a node has left its ball."""
    search.since_pairing += 1
    is_old = search.has_new_faces == 1 and search.since_pairing >= _SEARCHES_TO_NEW_FACES
    if has_left or is_old or search.is_pairing_due == 1:
        return True
    motion = search.motion
    has_skin_moved = (
        search.faces.has_skin == 1 and motion.largest_path > SKIN_PATH * motion.node_size
    )
    # Skin of a piece that falls moves on and on, and mostly there is nothing near it.
    may_take = has_skin_moved and search.faces.n_places <= len(search.pairs.triangle)
    return has_skin_moved and (not may_take or take_faces(search.pairs, motion, search.faces, body))


@kernel
def _renew_normals(search: SearchState, body: Body) -> None:
    """Compute the normals of nodes, now and then."""
    search.since_normals += 1
    if search.is_pairing == 1 or search.since_normals >= SEARCHES_TO_NORMALS:
        search.step += 1
        update_normals(search.faces, body, search.normal, search.inverted_step, search.step)
        search.since_normals = 0


@kernel
def _most_contacts(search: SearchState, forces: PenaltyForces, body: Body) -> int:
    """Return how many contacts there may be at most: new ones, and those that fade."""
    on_floor = 0 if search.floor == -math.inf else body.n_nodes
    n_new = DIRECTIONS * search.pairs.n_nodes + on_floor + search.edge_pairs.n_touching
    return int(n_new + forces.n_contacts)
