"""Narrow phase: which of the candidates went through each other in a Runge-Kutta step.

First all that did are found, with every node where it is; then they are taken one by one, in the
order of their nodes, looked at once more and pushed apart. So what is found does not depend on the
order of the search; and of several pairs that say the same, where node meets node, only the first
is taken.
"""

import numpy as np

from tissue.body import NODES, Body
from tissue.contact.candidates import (
    N_NODES,
    is_dead_edge,
    is_dead_point,
    rim_of,
)
from tissue.contact.distance import distance_of_edges, distance_to_triangle
from tissue.contact.edge_edge import (
    EdgeEdge,
    Edges,
    do_overlap,
    edge_edge,
    face_the_same_way,
)
from tissue.contact.faces import N_FACES, NONE
from tissue.contact.impulses import add_contact, have_moved_since
from tissue.contact.known_contacts import is_known
from tissue.contact.motion import (
    N_NEW,
    can_touch,
    horizon,
    is_its_turn,
    is_near,
    measure_motion,
    note_distance,
    wake_restless,
)
from tissue.contact.pairs import (
    N_NEAR,
    N_PAIRS,
    Nodes,
    add_hit,
    drop_pair,
    make_far,
    make_near,
    nodes_of,
    sort_hits,
)
from tissue.contact.point_triangle import Corners, PointTriangle, is_under, point_triangle
from tissue.contact.state import EPOCH, ContactState
from tissue.geometry import Weights
from tissue.jit import inlined, kernel
from tissue.types import FloatArray
from tissue.vec3 import Vec3, add, cross, dot, store, sub, vec3

POINTS, EDGES = 0, 1
"""Places in `ContactState.looked`."""


@kernel
def look_at_faces(contact: ContactState, body: Body) -> None:
    """Write the normals of nodes, and mark the nodes of tetrahedra that are inside out."""
    faces, normal, x = contact.faces, contact.normal, body.positions
    outward = contact.candidates.outward
    nothing = Vec3(0.0, 0.0, 0.0)
    for at in range(faces.counts[N_FACES]):
        if faces.face[at] != NONE:
            t, f = faces.face[at] // 4, faces.face[at] % 4
            for k in range(3):
                store(normal, body.tetrahedra[t, outward[f, k]], nothing)
    for at in range(faces.counts[N_FACES]):
        if faces.face[at] == NONE:
            continue
        t, f = faces.face[at] // 4, faces.face[at] % 4
        i = body.tetrahedra[t, outward[f, 0]]
        j = body.tetrahedra[t, outward[f, 1]]
        k = body.tetrahedra[t, outward[f, 2]]
        behind = body.tetrahedra[t, f]
        a = vec3(x, i)
        area = cross(sub(vec3(x, j), a), sub(vec3(x, k), a))
        store(normal, i, add(vec3(normal, i), area))
        store(normal, j, add(vec3(normal, j), area))
        store(normal, k, add(vec3(normal, k), area))
        if not dot(area, sub(a, vec3(x, behind))) > 0.0:
            for node in (i, j, k, behind):
                contact.tangled[node] = contact.state[EPOCH]


@kernel
def find_contacts(contact: ContactState, body: Body) -> None:
    """Add the contacts that are not among them yet, each pushed apart at once."""
    _find_points(contact, body)
    _find_edges(contact, body)
    if contact.floor > -np.inf:
        _find_on_floor(contact, body)


@kernel
def measure(contact: ContactState, body: Body) -> float:
    """Measure how far nodes have moved; return how far in this step at most [m]."""
    candidates, motion = contact.candidates, contact.motion
    most = measure_motion(
        motion,
        body,
        contact.start,
        candidates.node,
        candidates.counts[N_NODES],
        contact.depth,
        contact.depth_epoch,
        contact.state[EPOCH] - 1,
    )
    if motion.number[N_NEW] > 0:
        wake_restless(motion, candidates.point_triangle)
        wake_restless(motion, candidates.edge_edge)
    return most


@kernel
def _look(contact: ContactState, kind: int) -> int:
    """Note that pairs of that kind are looked at now; return when they were last."""
    last = contact.looked[kind]
    contact.looked[kind] = contact.contacts.clock[0]
    return last


@kernel
def _is_due(contact: ContactState, nodes: Nodes, last: int) -> bool:
    """Whether nodes have moved since a look in this step, or there was none."""
    return last < 0 or have_moved_since(contact.contacts, nodes, last)


@kernel
def _find_points(contact: ContactState, body: Body) -> None:
    candidates, motion, hits, x = contact.candidates, contact.motion, contact.hits, body.positions
    pairs, touch = candidates.point_triangle, contact.touch
    last = _look(contact, POINTS)
    hits.count[0] = 0
    measure(contact, body)
    for k in range(pairs.counts[N_NEAR]):
        hits.may_be[k] = is_under(_corners(x, nodes_of(pairs.node, k)))
    for k in range(pairs.counts[N_NEAR] - 1, -1, -1):  # backwards: another takes a place behind
        is_turn = is_its_turn(motion, k)
        if not (hits.may_be[k] or is_turn):
            continue
        if is_dead_point(candidates, k):
            drop_pair(pairs, k)
            continue
        nodes = nodes_of(pairs.node, k)
        now = _corners(x, nodes)
        may_be = hits.may_be[k] and _is_due(contact, nodes, last)
        if may_be and _point_triangle(contact, now, nodes).is_through:
            _note_hit(contact, nodes)
            continue
        if is_turn and not is_near(motion, _apart(now)):
            note_distance(motion, pairs, k, _apart(now))
            make_far(pairs, k)
    k = pairs.counts[N_NEAR]
    until = horizon(motion, touch)
    while k < pairs.counts[N_PAIRS]:
        if pairs.wake[k] > until:
            k += 1
            continue
        if is_dead_point(candidates, k):
            drop_pair(pairs, k)
            continue
        nodes = nodes_of(pairs.node, k)
        if can_touch(motion, pairs, k, touch) and _is_due(contact, nodes, last):
            now = _corners(x, nodes)
            if _point_triangle(contact, now, nodes).is_through:
                _note_hit(contact, nodes)
            apart = _apart(now)
            note_distance(motion, pairs, k, apart)
            if is_near(motion, apart):
                make_near(pairs, k)
        k += 1
    sort_hits(hits)
    for k in range(hits.count[0]):
        nodes = nodes_of(hits.node, k)
        met = _point_triangle(contact, _corners(x, nodes), nodes)
        if met.is_through:
            weights = Weights(1.0, met.b + met.c - 1.0, -met.b, -met.c)
            add_contact(contact.contacts, body, nodes, weights, met.normal, 0.0, contact.start)


@kernel
def _note_hit(contact: ContactState, nodes: Nodes) -> None:
    """Note what went through, unless it is a contact already."""
    contacts = contact.contacts
    if not is_known(contacts.known, contacts.node, nodes):
        add_hit(contact.hits, nodes)


@kernel
def _apart(at: Corners) -> float:
    """How far a node is from where it would meet a triangle [m]."""
    return distance_to_triangle(at) - rim_of(at.a, at.b, at.c)


@inlined
def _corners(x: FloatArray, nodes: Nodes) -> Corners:
    return Corners(vec3(x, nodes[0]), vec3(x, nodes[1]), vec3(x, nodes[2]), vec3(x, nodes[3]))


@kernel
def _point_triangle(contact: ContactState, now: Corners, nodes: Nodes) -> PointTriangle:
    """Whether the node went through the triangle and neither is inside out."""
    before = _corners(contact.start, nodes)
    met = point_triangle(before, now, _slack(contact, nodes), contact.touch)
    is_through = met.is_through and not _is_tangled(contact, nodes)
    return PointTriangle(is_through, met.normal, met.b, met.c)


@kernel
def _find_edges(contact: ContactState, body: Body) -> None:
    candidates, motion, hits, x = contact.candidates, contact.motion, contact.hits, body.positions
    pairs, touch = candidates.edge_edge, contact.touch
    last = _look(contact, EDGES)
    hits.count[0] = 0
    measure(contact, body)
    for k in range(pairs.counts[N_NEAR]):
        nodes = nodes_of(pairs.node, k)
        outward, other_outward = _outward(contact.normal, nodes)
        hits.may_be[k] = do_overlap(_edges(x, nodes), outward, other_outward)
    for k in range(pairs.counts[N_NEAR] - 1, -1, -1):  # backwards: another takes a place behind
        is_turn = is_its_turn(motion, k)
        if not (hits.may_be[k] or is_turn):
            continue
        if is_dead_edge(candidates, k):
            drop_pair(pairs, k)
            continue
        nodes = nodes_of(pairs.node, k)
        now = _edges(x, nodes)
        may_be = hits.may_be[k] and _is_due(contact, nodes, last)
        if may_be and _edge_edge(contact, now, nodes).is_through:
            _note_hit(contact, nodes)
            continue
        if is_turn and not is_near(motion, distance_of_edges(now)):
            note_distance(motion, pairs, k, distance_of_edges(now))
            make_far(pairs, k)
    k = pairs.counts[N_NEAR]
    until = horizon(motion, touch)
    while k < pairs.counts[N_PAIRS]:
        if pairs.wake[k] > until:
            k += 1
            continue
        if is_dead_edge(candidates, k):
            drop_pair(pairs, k)
            continue
        nodes = nodes_of(pairs.node, k)
        if can_touch(motion, pairs, k, touch) and _is_due(contact, nodes, last):
            now = _edges(x, nodes)
            if _edge_edge(contact, now, nodes).is_through:
                _note_hit(contact, nodes)
            apart = distance_of_edges(now)
            note_distance(motion, pairs, k, apart)
            if is_near(motion, apart):
                make_near(pairs, k)
        k += 1
    sort_hits(hits)
    for k in range(hits.count[0]):
        nodes = nodes_of(hits.node, k)
        met = _edge_edge(contact, _edges(x, nodes), nodes)
        if met.is_through:
            weights = Weights(1.0 - met.s, met.s, met.t - 1.0, -met.t)
            add_contact(contact.contacts, body, nodes, weights, met.normal, 0.0, contact.start)


@inlined
def _edges(x: FloatArray, nodes: Nodes) -> Edges:
    return Edges(vec3(x, nodes[0]), vec3(x, nodes[1]), vec3(x, nodes[2]), vec3(x, nodes[3]))


@inlined
def _outward(normal: FloatArray, nodes: Nodes) -> tuple[Vec3, Vec3]:
    """Out of the body at both edges."""
    outward = add(vec3(normal, nodes[0]), vec3(normal, nodes[1]))
    return outward, add(vec3(normal, nodes[2]), vec3(normal, nodes[3]))


@kernel
def _edge_edge(contact: ContactState, now: Edges, nodes: Nodes) -> EdgeEdge:
    """Whether one edge went through the other and neither is inside out."""
    outward, other_outward = _outward(contact.normal, nodes)
    if (
        not do_overlap(now, outward, other_outward)
        or face_the_same_way(outward, other_outward)
        or _is_tangled(contact, nodes)
    ):
        return EdgeEdge(False, outward, 0.0, 0.0)
    before, slack = _edges(contact.start, nodes), _slack(contact, nodes)
    return edge_edge(before, now, outward, other_outward, slack, contact.touch)


@kernel
def _find_on_floor(contact: ContactState, body: Body) -> None:
    for node in range(body.counts[NODES]):
        if body.positions[node, 2] < contact.floor - contact.touch:
            nodes, weights = (node, node, node, node), Weights(1.0, 0.0, 0.0, 0.0)
            up = Vec3(0.0, 0.0, 1.0)
            add_contact(contact.contacts, body, nodes, weights, up, contact.floor, contact.start)


@kernel
def _is_tangled(contact: ContactState, nodes: Nodes) -> bool:
    tangled, epoch = contact.tangled, contact.state[EPOCH]
    a, b, c, d = nodes
    return tangled[a] == epoch or tangled[b] == epoch or tangled[c] == epoch or tangled[d] == epoch


@kernel
def _slack(contact: ContactState, nodes: Nodes) -> float:
    """How deep in each other these nodes may have been before the step [m]."""
    last = contact.state[EPOCH] - 1
    slack = 0.0
    for node in nodes:
        if contact.depth_epoch[node] == last:
            slack = max(slack, contact.depth[node])
    return slack + contact.touch
