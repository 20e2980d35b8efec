"""Contact after a Runge-Kutta step: detect interpenetration, correct positions and velocities."""

from tissue.contact.candidate_update import (
    LARGEST_MOVE,
    moves_are_plausible,
    update_candidates,
)
from tissue.contact.candidates import clear_candidates
from tissue.contact.constraints import (
    Contacts,
    Manifold,
    carry_over,
    gap,
    is_on_floor,
    rebuild_table,
    set_slop,
    update_manifold,
    warm_start,
)
from tissue.contact.edge_edge import Edges, crossing_of, is_inner
from tissue.contact.narrow_phase import find_contacts, update_motion
from tissue.contact.node_normals import has_inverted, update_normals
from tissue.contact.pairs import nodes_of
from tissue.contact.point_triangle import Corners, is_within, project_to_plane
from tissue.contact.solver import solve_positions, solve_velocities
from tissue.contact.state import REBUILD, UP_TO_DATE, ContactState
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, scale, store, vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import Body

RETEST_SHARE = 1.0 / 16.0
"""Share of new contacts above which pairs are tested once more: a correction can push a node into a
triangle that it had not met. What few new contacts push into, or the second test leaves, is found
in the next step."""


@kernel
def note_all_positions(contact: ContactState, body: Body) -> None:
    """Note where all nodes are, before a Runge-Kutta step."""
    for i in range(body.n_nodes):
        store(contact.start, i, vec3(body.positions, i))


@kernel
def resolve(contact: ContactState, body: Body, seconds: float) -> bool:
    """Detect interpenetration in a Runge-Kutta step, and correct positions and velocities.

    Args:
        contact: Written.
        body: Positions and velocities are written.
        seconds: Length of the step [s].

    Returns:
        Whether there was room. Make room if not, and call again: it continues where it stopped.
    """
    contacts = contact.contacts
    if contact.has_begun == 0:
        contact.step += 1
        contact.motion.step += 1
        update_normals(contact.faces, body, contact.normal, contact.inverted_step, contact.step)
        _carry_contacts_over(contact, body, seconds)
        contact.has_begun = 1
    if not _update_candidates(contact, body):
        return False
    contact.has_begun = 0
    rebuild_table(contacts)
    contact.tested_at = -1
    contact.n_pressing = 0
    n = contacts.n_contacts
    find_contacts(contact, body)
    if contacts.n_contacts > 0:
        solve_positions(contacts, body, contact.start, contact.friction, contact.tolerance)
    if contacts.n_contacts - n > RETEST_SHARE * contacts.n_contacts:
        update_motion(contact, body)
        find_contacts(contact, body)
        solve_positions(contacts, body, contact.start, contact.friction, contact.tolerance)
    if contacts.n_contacts > 0:
        solve_velocities(contacts, body, contact.friction, seconds, contact.tolerance)
        _note_depths(contact, body)
        _add_totals(contact)
    return True


@kernel
def _update_candidates(contact: ContactState, body: Body) -> bool:
    """Bring the candidates up to date; return False if there is no room."""
    candidates, start = contact.candidates, contact.start
    move = update_motion(contact, body)
    if contact.stale == REBUILD or not move <= LARGEST_MOVE:
        clear_candidates(candidates)
        contact.stale = REBUILD
    has_changed = contact.stale != UP_TO_DATE
    if has_changed and not moves_are_plausible(body, start):
        clear_candidates(candidates)
        contact.stale = REBUILD
        return True
    faces, motion = contact.faces, contact.motion
    if not update_candidates(
        candidates, motion, faces, body, start, move, has_changed, contact.margin
    ):
        contact.stale = REBUILD
        return False
    contact.stale = UP_TO_DATE
    return True


@kernel
def _carry_contacts_over(contact: ContactState, body: Body, seconds: float) -> None:
    """Keep the contacts that pressed in the last step, where their nodes now are.

    Contacts that slid off are dropped, and contacts of faces that are gone or inverted.
    """
    contacts = contact.contacts
    ratio = seconds / contacts.seconds
    contacts.seconds = seconds
    n = 0
    for k in range(contacts.n_contacts):
        is_idle = contacts.impulse[k] == 0.0 and contacts.position_impulse[k] == 0.0
        if is_idle or _is_gone(contact, k):
            continue
        carry_over(contacts, k, n, ratio)
        if _update_contact(contacts, body, n):
            set_slop(contacts, n, contact.start)
            n += 1
    contacts.n_contacts = n
    for k in range(n):
        warm_start(contacts, body, k)


@kernel
def _is_gone(contact: ContactState, k: int) -> bool:
    """Whether a face of contact `k` is gone or inverted."""
    contacts, generation = contact.contacts, contact.faces.generation
    first, second = contacts.face[k, 0], contacts.face[k, 1]
    if first >= 0 and contacts.generation[k] != generation[first] + generation[second]:
        return True
    return has_inverted(contact.inverted_step, contact.step, nodes_of(contacts.node, k))


@kernel
def _update_contact(contacts: Contacts, body: Body, k: int) -> bool:
    """Move a contact of the last step to where its nodes now are; False if it slid off them."""
    x = body.positions
    a = vec3(x, contacts.node[k, 0])
    b = vec3(x, contacts.node[k, 1])
    c = vec3(x, contacts.node[k, 2])
    d = vec3(x, contacts.node[k, 3])
    if is_on_floor(contacts, k):
        weights = Weights(1.0, 0.0, 0.0, 0.0)
        update_manifold(contacts, body, k, Manifold(weights, vec3(contacts.normal, k)))
        return True
    if contacts.weight[k, 0] == 1.0:  # a node and a triangle
        below = project_to_plane(Corners(a, b, c, d))
        if not is_within(below.b, below.c):
            return False
        weights = Weights(1.0, below.b + below.c - 1.0, -below.b, -below.c)
        update_manifold(contacts, body, k, Manifold(weights, below.normal))
        return True
    now = crossing_of(Edges(a, b, c, d))
    if not (now.is_one and is_inner(now.s) and is_inner(now.t)):
        return False
    sign = 1.0 if dot(now.normal, vec3(contacts.normal, k)) > 0.0 else -1.0
    weights = Weights(1.0 - now.s, now.s, now.t - 1.0, -now.t)
    update_manifold(contacts, body, k, Manifold(weights, scale(sign, now.normal)))
    return True


@kernel
def _note_depths(contact: ContactState, body: Body) -> None:
    """Note how deep nodes are left in what they touch: so they are found again."""
    contacts, step = contact.contacts, contact.step
    for k in range(contacts.n_contacts):
        left = max(-gap(contacts, body.positions, k), 0.0)
        contact.penetration = max(contact.penetration, left)
        for q in range(4):
            node = contacts.node[k, q]
            if contact.depth_step[node] != step:
                contact.depth_step[node] = step
                contact.depth[node] = 0.0
            contact.depth[node] = max(contact.depth[node], left)


@kernel
def _add_totals(contact: ContactState) -> None:
    """Add up impulses, and count the contacts that press."""
    contacts, of_floor = contact.contacts, contact.floor_impulse
    for k in range(contacts.n_contacts):
        if contacts.impulse[k] > 0.0:
            contact.n_pressing += 1
            if is_on_floor(contacts, k):
                of_floor[0] += contacts.friction[k, 0]
                of_floor[1] += contacts.friction[k, 1]
                of_floor[2] += contacts.impulse[k]
            else:
                contact.pressure_impulse += contacts.impulse[k]
