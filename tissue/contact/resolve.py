"""Contact after a Runge-Kutta step: find what went through what, and set it right."""

import numpy as np

from tissue.arrays import Arrays
from tissue.body import NODES, Body
from tissue.contact.candidates import (
    N_EDGE_EDGE,
    N_POINT_TRIANGLE,
    Candidates,
    find_candidates,
    have_moved,
)
from tissue.contact.edge_edge import Edges, edge_edge
from tissue.contact.faces import Faces
from tissue.contact.impulses import Contacts, add_contact, gap, push_apart, push_last, stop_approach
from tissue.contact.point_triangle import Corners, point_triangle
from tissue.jit import kernel
from tissue.types import FloatArray, IntArray
from tissue.vec3 import Vec3, add, vec3

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
def remember_start(contact: ContactState, body: Body) -> None:
    """Note where the nodes are before a Runge-Kutta step."""
    for i in range(body.counts[NODES]):
        for x in range(3):
            contact.start[i, x] = body.positions[i, x]


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
    contacts.count[0] = 0
    found = _find(contact, body)
    for _ in range(PASSES):
        if not found:
            break
        push_apart(contacts, body, contact.start, contact.friction, contact.touch)
        found = _find(contact, body)
    contact.totals[N_TOUCHING] = 0.0
    if contacts.count[0] > 0:
        stop_approach(contacts, body, contact.friction, contact.touch / seconds)
        _remember_depths(contact, body)
        _count(contact)
    return True


@kernel
def _find(contact: ContactState, body: Body) -> bool:
    """Add the contacts that are not among them yet; return whether there are any.

    Each is pushed apart at once, so that of several pairs that say the same, where node meets node,
    only the first is taken.
    """
    before = contact.contacts.count[0]
    _find_points(contact, body)
    _find_edges(contact, body)
    if contact.floor > -np.inf:
        _find_on_floor(contact, body)
    return contact.contacts.count[0] > before


@kernel
def _find_points(contact: ContactState, body: Body) -> None:
    candidates, start, x = contact.candidates, contact.start, body.positions
    for k in range(candidates.counts[N_POINT_TRIANGLE]):
        if contact.found[k] == contact.state[EPOCH]:
            continue
        node = candidates.point_triangle[k, 0]
        row = candidates.point_triangle[k, 1]
        a = candidates.triangle[row, 0]
        b = candidates.triangle[row, 1]
        c = candidates.triangle[row, 2]
        t0 = Corners(vec3(start, node), vec3(start, a), vec3(start, b), vec3(start, c))
        t1 = Corners(vec3(x, node), vec3(x, a), vec3(x, b), vec3(x, c))
        slack = _slack(contact, node, a, b, c)
        met = point_triangle(t0, t1, slack, contact.touch)
        if met.is_through:
            contact.found[k] = contact.state[EPOCH]
            weights = (1.0, met.b + met.c - 1.0, -met.b, -met.c)
            add_contact(contact.contacts, body, (node, a, b, c), weights, met.normal, 0.0)
            push_last(contact.contacts, body)


@kernel
def _find_edges(contact: ContactState, body: Body) -> None:
    candidates, start, x = contact.candidates, contact.start, body.positions
    normal = candidates.normal
    first = candidates.counts[N_POINT_TRIANGLE]
    for k in range(candidates.counts[N_EDGE_EDGE]):
        if contact.found[first + k] == contact.state[EPOCH]:
            continue
        row = candidates.edge_edge[k, 0]
        other = candidates.edge_edge[k, 1]
        a = candidates.edge[row, 0]
        b = candidates.edge[row, 1]
        c = candidates.edge[other, 0]
        d = candidates.edge[other, 1]
        t0 = Edges(vec3(start, a), vec3(start, b), vec3(start, c), vec3(start, d))
        t1 = Edges(vec3(x, a), vec3(x, b), vec3(x, c), vec3(x, d))
        outward = add(vec3(normal, a), vec3(normal, b))
        other_outward = add(vec3(normal, c), vec3(normal, d))
        slack = _slack(contact, a, b, c, d)
        met = edge_edge(t0, t1, outward, other_outward, slack, contact.touch)
        if met.is_through:
            contact.found[first + k] = contact.state[EPOCH]
            weights = (1.0 - met.s, met.s, met.t - 1.0, -met.t)
            add_contact(contact.contacts, body, (a, b, c, d), weights, met.normal, 0.0)
            push_last(contact.contacts, body)


@kernel
def _find_on_floor(contact: ContactState, body: Body) -> None:
    first = contact.candidates.counts[N_POINT_TRIANGLE] + contact.candidates.counts[N_EDGE_EDGE]
    for node in range(body.counts[NODES]):
        below = body.positions[node, 2] < contact.floor - contact.touch
        if below and contact.found[first + node] != contact.state[EPOCH]:
            contact.found[first + node] = contact.state[EPOCH]
            nodes, weights = (node, node, node, node), (1.0, 0.0, 0.0, 0.0)
            up = Vec3(0.0, 0.0, 1.0)
            add_contact(contact.contacts, body, nodes, weights, up, contact.floor)
            push_last(contact.contacts, body)


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
