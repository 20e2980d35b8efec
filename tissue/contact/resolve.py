"""Contact after a Runge-Kutta step: find what went through what, and set it right."""

import numpy as np

from tissue.arrays import Arrays
from tissue.body import NODES, Body
from tissue.contact.candidates import (
    N_EDGE_EDGE,
    N_POINT_TRIANGLE,
    N_TRIANGLES,
    Candidates,
    find_candidates,
    have_moved,
)
from tissue.contact.edge_edge import Edges, crossing_of, edge_edge, is_inner, way_of_overlap
from tissue.contact.faces import Faces
from tissue.contact.impulses import (
    Contacts,
    add_contact,
    follow,
    gap,
    press,
    push_apart,
    stop_approach,
)
from tissue.contact.point_triangle import Corners, is_under, is_within, point_triangle, under
from tissue.geometry import Weights, tetrahedron_volume
from tissue.jit import kernel
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3, add, dot, scale, store, vec3

PASSES = 2
"""Times that positions are corrected and looked at again: a correction can push a node into a
triangle that it had not met. What is left after the last is remembered, and corrected in the next
step."""

IS_AWAKE, IS_STALE, IS_PENDING, EPOCH = 0, 1, 2, 3
"""Places in `ContactState.state`."""

FLOOR_IMPULSE, PRESSURE_IMPULSE, PENETRATION, N_TOUCHING = 0, 3, 4, 5
"""Places in `ContactState.totals`."""
N_TOTALS = 6


class ContactState(Arrays):
    """All that contact reads and writes, beside the body."""

    faces: Faces
    candidates: Candidates
    contacts: Contacts
    start: FloatArray
    """Positions before the Runge-Kutta step [m], shape (node capacity, 3)."""
    depth: FloatArray
    """How deep each node was left in what it touches [m], shape (node capacity,)."""
    depth_epoch: IntArray
    """Runge-Kutta step in which that was, shape (node capacity,)."""
    tangled: IntArray
    """Runge-Kutta step in which a tetrahedron with this node was last seen inside out; shape (node
    capacity,). A blade can drag small ones so. Their faces point into the body, and would hold
    them as they are: they must pass through others to come right again."""
    found: IntArray
    """Runge-Kutta step in which each pair was last found in contact: first nodes with triangles,
    then edges, then nodes with the floor; shape of `Contacts`."""
    state: IntArray
    """Whether anything can touch; whether the candidates are out of date; whether a step is done
    but for contact; number of the Runge-Kutta step. Shape (4,)."""
    totals: FloatArray
    """Since they were cleared: impulse of the floor on the body [N s], three; sum of the impulses
    that press faces together [N s]; greatest penetration left [m]; and the number of contacts that
    pressed in the last step. Shape (N_TOTALS,)."""
    friction: float
    """Coefficient of friction."""
    floor: float
    """Height of the floor [m], or -inf."""
    margin: float
    """Of the candidates [m]."""
    touch: float
    """Distance that is none: rounding and what Gauss-Seidel leaves [m]."""


@kernel
def prepare(contact: ContactState, body: Body) -> None:
    """Before a Runge-Kutta step: note where the nodes are, and press what is pressed."""
    press(contact.contacts, body, contact.tangled, contact.state[EPOCH])
    for i in range(body.counts[NODES]):
        store(contact.start, i, vec3(body.positions, i))


@kernel
def prepare_listed(contact: ContactState, body: Body, nodes: IntArray, n: int) -> None:
    """`prepare` where only the first `n` of `nodes` have moved since the last step."""
    press(contact.contacts, body, contact.tangled, contact.state[EPOCH])
    note_positions(contact, body, nodes, n)


@kernel
def note_positions(contact: ContactState, body: Body, nodes: IntArray, n: int) -> None:
    """Note where the first `n` of `nodes` are."""
    for i in range(n):
        store(contact.start, nodes[i], vec3(body.positions, nodes[i]))


@kernel
def resolve(contact: ContactState, body: Body, seconds: float) -> bool:
    """Undo what went through what in a Runge-Kutta step of that length; False if there is no room.

    Nothing has changed then: make room, and call again.
    """
    state, contacts = contact.state, contact.contacts
    if state[IS_STALE] == 1 or have_moved(contact.candidates, body, contact.margin):
        state[IS_STALE] = 1
        if not find_candidates(
            contact.candidates, contact.faces, body, contact.start, contact.margin
        ):
            return False
        state[IS_STALE] = 0
    state[EPOCH] += 1
    _find_tangled(contact, body)
    for k in range(contacts.count[0]):
        _follow(contacts, body, k)
    for _ in range(PASSES):
        n = contacts.count[0]
        _find(contact, body)
        if contacts.count[0] == 0:
            break
        push_apart(contacts, body, contact.start, contact.friction, contact.touch)
        if contacts.count[0] == n:
            break
    contact.totals[N_TOUCHING] = 0.0
    if contacts.count[0] > 0:
        stop_approach(contacts, body, contact.friction, seconds, contact.touch)
        _remember_depths(contact, body)
        _count(contact)
    return True


@kernel
def _follow(contacts: Contacts, body: Body, k: int) -> None:
    """Let a contact of the last step be where its nodes now are, unless it slid off them."""
    x = body.positions
    a = vec3(x, contacts.node[k, 0])
    b = vec3(x, contacts.node[k, 1])
    c = vec3(x, contacts.node[k, 2])
    d = vec3(x, contacts.node[k, 3])
    if contacts.node[k, 0] == contacts.node[k, 1]:  # on the floor
        return
    if contacts.weight[k, 0] == 1.0:
        below = under(Corners(a, b, c, d))
        if is_within(below.b, below.c):
            weights = Weights(1.0, below.b + below.c - 1.0, -below.b, -below.c)
            follow(contacts, body, k, weights, below.normal)
    else:
        now = crossing_of(Edges(a, b, c, d))
        if now.is_one and is_inner(now.s) and is_inner(now.t):
            way = 1.0 if dot(now.normal, vec3(contacts.normal, k)) > 0.0 else -1.0
            weights = Weights(1.0 - now.s, now.s, now.t - 1.0, -now.t)
            follow(contacts, body, k, weights, scale(way, now.normal))


@kernel
def _find(contact: ContactState, body: Body) -> None:
    """Add the contacts that are not among them yet.

    Each is pushed apart at once, so that of several pairs that say the same, where node meets node,
    only the first is taken.
    """
    _find_points(contact, body)
    _find_edges(contact, body)
    if contact.floor > -np.inf:
        _find_on_floor(contact, body)


@kernel
def _find_points(contact: ContactState, body: Body) -> None:
    candidates, start, x = contact.candidates, contact.start, body.positions
    for k in range(candidates.counts[N_POINT_TRIANGLE]):
        node = candidates.point_triangle[k, 0]
        row = candidates.point_triangle[k, 1]
        a = candidates.triangle[row, 0]
        b = candidates.triangle[row, 1]
        c = candidates.triangle[row, 2]
        t1 = Corners(vec3(x, node), vec3(x, a), vec3(x, b), vec3(x, c))
        if not is_under(t1):  # most pairs; all that follows reads memory that they do not need
            continue
        if contact.found[k] == contact.state[EPOCH] or _is_tangled(contact, node, a, b, c):
            continue
        t0 = Corners(vec3(start, node), vec3(start, a), vec3(start, b), vec3(start, c))
        met = point_triangle(t0, t1, _slack(contact, node, a, b, c), contact.touch)
        if met.is_through:
            contact.found[k] = contact.state[EPOCH]
            weights = Weights(1.0, met.b + met.c - 1.0, -met.b, -met.c)
            add_contact(contact.contacts, body, (node, a, b, c), weights, met.normal, 0.0)


@kernel
def _find_edges(contact: ContactState, body: Body) -> None:
    candidates, start, x = contact.candidates, contact.start, body.positions
    normal = candidates.normal
    first = candidates.counts[N_POINT_TRIANGLE]
    for k in range(candidates.counts[N_EDGE_EDGE]):
        row = candidates.edge_edge[k, 0]
        other = candidates.edge_edge[k, 1]
        a = candidates.edge[row, 0]
        b = candidates.edge[row, 1]
        c = candidates.edge[other, 0]
        d = candidates.edge[other, 1]
        t1 = Edges(vec3(x, a), vec3(x, b), vec3(x, c), vec3(x, d))
        outward = add(vec3(normal, a), vec3(normal, b))
        other_outward = add(vec3(normal, c), vec3(normal, d))
        if way_of_overlap(t1, outward, other_outward) == 0.0:
            continue
        if contact.found[first + k] == contact.state[EPOCH] or _is_tangled(contact, a, b, c, d):
            continue
        t0 = Edges(vec3(start, a), vec3(start, b), vec3(start, c), vec3(start, d))
        slack = _slack(contact, a, b, c, d)
        met = edge_edge(t0, t1, outward, other_outward, slack, contact.touch)
        if met.is_through:
            contact.found[first + k] = contact.state[EPOCH]
            weights = Weights(1.0 - met.s, met.s, met.t - 1.0, -met.t)
            add_contact(contact.contacts, body, (a, b, c, d), weights, met.normal, 0.0)


@kernel
def _find_on_floor(contact: ContactState, body: Body) -> None:
    first = contact.candidates.counts[N_POINT_TRIANGLE] + contact.candidates.counts[N_EDGE_EDGE]
    for node in range(body.counts[NODES]):
        below = body.positions[node, 2] < contact.floor - contact.touch
        if below and contact.found[first + node] != contact.state[EPOCH]:
            contact.found[first + node] = contact.state[EPOCH]
            nodes, weights = (node, node, node, node), Weights(1.0, 0.0, 0.0, 0.0)
            up = Vec3(0.0, 0.0, 1.0)
            add_contact(contact.contacts, body, nodes, weights, up, contact.floor)


@kernel
def _find_tangled(contact: ContactState, body: Body) -> None:
    """Mark the nodes of the tetrahedra behind triangles that are inside out."""
    candidates = contact.candidates
    for row in range(candidates.counts[N_TRIANGLES]):
        t = candidates.behind[row]
        if not tetrahedron_volume(body.positions, body.tetrahedra, t) > 0.0:
            for q in range(4):
                contact.tangled[body.tetrahedra[t, q]] = contact.state[EPOCH]


@kernel
def _is_tangled(contact: ContactState, a: int, b: int, c: int, d: int) -> bool:
    tangled, epoch = contact.tangled, contact.state[EPOCH]
    return tangled[a] == epoch or tangled[b] == epoch or tangled[c] == epoch or tangled[d] == epoch


@kernel
def _slack(contact: ContactState, a: int, b: int, c: int, d: int) -> float:
    """How deep in each other these nodes may have been before the step [m]."""
    last = contact.state[EPOCH] - 1
    slack = 0.0
    for node in (a, b, c, d):
        if contact.depth_epoch[node] == last:
            slack = max(slack, contact.depth[node])
    return slack + contact.touch


@kernel
def _remember_depths(contact: ContactState, body: Body) -> None:
    """Note how deep nodes are left in what they touch: so they are found again."""
    contacts, epoch = contact.contacts, contact.state[EPOCH]
    for k in range(contacts.count[0]):
        left = max(-gap(contacts, body, k), 0.0)
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
