"""Contact after a Runge-Kutta step: find what went through what, and set it right."""

from tissue.contact.candidates import (
    FARTHEST,
    clear,
    moves_as_tissue_does,
    renew_candidates,
)
from tissue.contact.constraints import (
    Contacts,
    bear,
    begin_with_last,
    follow,
    gap,
    keep,
    know_contacts,
    push_apart,
    stop_approach,
)
from tissue.contact.edge_edge import Edges, crossing_of, is_inner
from tissue.contact.motion_bounds import STEP
from tissue.contact.narrow_phase import find_contacts, is_tangled, look_at_faces, measure
from tissue.contact.pairs import nodes_of
from tissue.contact.point_triangle import Corners, is_within, under
from tissue.contact.state import (
    ANEW,
    EPOCH,
    FLOOR_IMPULSE,
    HAS_BEGUN,
    IS_STALE,
    N_TOUCHING,
    PENETRATION,
    PRESSURE_IMPULSE,
    ContactState,
)
from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, scale, store, vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import Body

MANY = 1.0 / 16.0
"""Share of new contacts from which on all is looked at once more: a correction can push a node into
a triangle that it had not met. What few of them push into, or the second look leaves, is found in
the next step."""


@kernel
def prepare(contact: ContactState, body: Body) -> None:
    """Before a Runge-Kutta step: note where the nodes are."""
    for i in range(body.n_nodes):
        store(contact.start, i, vec3(body.positions, i))


@kernel
def note_positions(contact: ContactState, body: Body, nodes: IntArray, n: int) -> None:
    """Note where the first `n` of `nodes` are."""
    for i in range(n):
        store(contact.start, nodes[i], vec3(body.positions, nodes[i]))


@kernel
def resolve(contact: ContactState, body: Body, seconds: float) -> bool:
    """Undo what went through what in a Runge-Kutta step of that length; False if there is no room.

    Make room then, and call again: it goes on from there.
    """
    contacts, state = contact.contacts, contact.state
    if state[HAS_BEGUN] == 0:
        state[EPOCH] += 1
        contact.motion.number[STEP] += 1
        look_at_faces(contact, body)
        _go_on(contact, body, seconds)
        state[HAS_BEGUN] = 1
    if not _renew(contact, body):
        return False
    state[HAS_BEGUN] = 0
    know_contacts(contacts)
    contact.looked[0] = -1
    contact.totals[N_TOUCHING] = 0.0
    n = contacts.count[0]
    find_contacts(contact, body)
    if contacts.count[0] > 0:
        push_apart(contacts, body, contact.start, contact.friction, contact.touch)
    if contacts.count[0] - n > MANY * contacts.count[0]:
        measure(contact, body)
        find_contacts(contact, body)
        push_apart(contacts, body, contact.start, contact.friction, contact.touch)
    if contacts.count[0] > 0:
        stop_approach(contacts, body, contact.friction, seconds, contact.touch)
        _remember_depths(contact, body)
        _count(contact)
    return True


@kernel
def _renew(contact: ContactState, body: Body) -> bool:
    """Bring the candidates up to date; return False if there is no room."""
    state, candidates = contact.state, contact.candidates
    move = measure(contact, body)
    if state[IS_STALE] == ANEW or not move <= FARTHEST:
        clear(candidates)
        state[IS_STALE] = ANEW
    has_changed = state[IS_STALE] != 0
    if has_changed and not moves_as_tissue_does(body, contact.start):
        clear(candidates)
        state[IS_STALE] = ANEW
        return True
    faces, motion, start = contact.faces, contact.motion, contact.start
    if not renew_candidates(
        candidates, motion, faces, body, start, move, has_changed, contact.margin
    ):
        state[IS_STALE] = ANEW
        return False
    state[IS_STALE] = 0
    return True


@kernel
def _go_on(contact: ContactState, body: Body, seconds: float) -> None:
    """Keep the contacts that pressed in the last step, where their nodes now are.

    Those that slid off are left out, and those of faces that are no more or tangled.
    """
    contacts = contact.contacts
    longer = seconds / contacts.seconds[0]
    contacts.seconds[0] = seconds
    n = 0
    for k in range(contacts.count[0]):
        is_idle = contacts.impulse[k] == 0.0 and contacts.shift[k] == 0.0
        if is_idle or _is_gone(contact, k):
            continue
        keep(contacts, k, n, longer)
        if _follow(contacts, body, n):
            bear(contacts, n, contact.start)
            n += 1
    contacts.count[0] = n
    for k in range(n):
        begin_with_last(contacts, body, k)


@kernel
def _is_gone(contact: ContactState, k: int) -> bool:
    """Whether a face of contact `k` is no more, or tangled."""
    contacts, generation = contact.contacts, contact.faces.generation
    first, second = contacts.face[k, 0], contacts.face[k, 1]
    if first >= 0 and contacts.generation[k] != generation[first] + generation[second]:
        return True
    return is_tangled(contact, nodes_of(contacts.node, k))


@kernel
def _follow(contacts: Contacts, body: Body, k: int) -> bool:
    """Let a contact of the last step be where its nodes now are; False if it slid off them."""
    x = body.positions
    a = vec3(x, contacts.node[k, 0])
    b = vec3(x, contacts.node[k, 1])
    c = vec3(x, contacts.node[k, 2])
    d = vec3(x, contacts.node[k, 3])
    if contacts.node[k, 0] == contacts.node[k, 1]:  # on the floor
        weights = Weights(1.0, 0.0, 0.0, 0.0)
        follow(contacts, body, k, weights, vec3(contacts.normal, k))
        return True
    if contacts.weight[k, 0] == 1.0:
        below = under(Corners(a, b, c, d))
        if not is_within(below.b, below.c):
            return False
        weights = Weights(1.0, below.b + below.c - 1.0, -below.b, -below.c)
        follow(contacts, body, k, weights, below.normal)
        return True
    now = crossing_of(Edges(a, b, c, d))
    if not (now.is_one and is_inner(now.s) and is_inner(now.t)):
        return False
    way = 1.0 if dot(now.normal, vec3(contacts.normal, k)) > 0.0 else -1.0
    weights = Weights(1.0 - now.s, now.s, now.t - 1.0, -now.t)
    follow(contacts, body, k, weights, scale(way, now.normal))
    return True


@kernel
def _remember_depths(contact: ContactState, body: Body) -> None:
    """Note how deep nodes are left in what they touch: so they are found again."""
    contacts, epoch = contact.contacts, contact.state[EPOCH]
    for k in range(contacts.count[0]):
        left = max(-gap(contacts, body.positions, k), 0.0)
        contact.totals[PENETRATION] = max(contact.totals[PENETRATION], left)
        for q in range(4):
            node = contacts.node[k, q]
            if contact.depth_epoch[node] != epoch:
                contact.depth_epoch[node] = epoch
                contact.depth[node] = 0.0
            contact.depth[node] = max(contact.depth[node], left)


@kernel
def _count(contact: ContactState) -> None:
    """Count impulses and the contacts that press."""
    contacts, totals = contact.contacts, contact.totals
    for k in range(contacts.count[0]):
        if contacts.impulse[k] > 0.0:
            totals[N_TOUCHING] += 1.0
            if contacts.node[k, 0] == contacts.node[k, 1]:  # on the floor
                totals[FLOOR_IMPULSE] += contacts.friction[k, 0]
                totals[FLOOR_IMPULSE + 1] += contacts.friction[k, 1]
                totals[FLOOR_IMPULSE + 2] += contacts.impulse[k]
            else:
                totals[PRESSURE_IMPULSE] += contacts.impulse[k]
