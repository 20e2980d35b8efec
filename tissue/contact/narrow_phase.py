"""Narrow phase: which of the candidates went through each other in a Runge-Kutta step.

First all that did are found, with every node where it is; then they are taken one by one, in the
order of their nodes, looked at once more and pushed apart. So what is found does not depend on the
order of the search; and of several pairs that say the same, where node meets node, only the first
is taken.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.candidates import (
    N_NODES,
    Candidates,
    is_dead_edge,
    is_dead_point,
    rim_of,
)
from tissue.contact.constraints import add_contact, have_moved_since
from tissue.contact.contact_table import is_known
from tissue.contact.distance import distance_of_edges, distance_to_triangle
from tissue.contact.edge_edge import (
    EdgeEdge,
    Edges,
    do_overlap,
    edge_edge,
    face_the_same_way,
)
from tissue.contact.faces import N_FACES, NONE
from tissue.contact.motion_bounds import (
    N_NEW,
    STEPS_NEAR,
    can_touch,
    horizon,
    is_near,
    measure_motion,
    note_distance,
    wake_restless,
    whose_turn,
)
from tissue.contact.pairs import (
    N_NEAR,
    N_PAIRS,
    Hits,
    Nodes,
    Pairs,
    add_hit,
    drop_pair,
    make_far,
    make_near,
    nodes_of,
    nodes_of_pair,
    sort_hits,
)
from tissue.contact.point_triangle import Corners, PointTriangle, point_triangle
from tissue.contact.simd_prefilter import (
    look_at_edges,
    look_at_points,
    may_be_crossed,
    may_be_under,
)
from tissue.contact.state import EPOCH, ContactState
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, add, cross, dot, store, sub, vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import Body

_POINTS, _EDGES = 0, 1
"""Kinds of pairs."""


class Meeting(NamedTuple):
    """Whether one side of a pair went through the other, and where they meet."""

    is_one: bool
    weights: Weights
    normal: Vec3


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
    """Add the contacts that are not among them yet, each pushed apart at once. `measure` first."""
    candidates, x = contact.candidates, body.positions
    last = contact.looked[0]
    contact.looked[0] = contact.contacts.clock[0]
    points, edges = candidates.point_triangle, candidates.edge_edge
    look_at_points(points, x, contact.signs)
    _find(contact, x, _POINTS, points, contact.point_hits, last)
    look_at_edges(edges, x, contact.normal, contact.signs)
    _find(contact, x, _EDGES, edges, contact.edge_hits, last)
    _add_hits(contact, body, _POINTS, contact.point_hits)
    _add_hits(contact, body, _EDGES, contact.edge_hits)
    if contact.floor > -np.inf:
        _find_on_floor(contact, body)


@kernel
def measure(contact: ContactState, body: Body) -> float:
    """Measure how far nodes have moved; return how far in this step at most [m]."""
    candidates, motion = contact.candidates, contact.motion
    n = candidates.counts[N_NODES]
    most = measure_motion(motion, body, contact.start, candidates.node, n)
    if motion.number[N_NEW] > 0:
        wake_restless(motion, candidates.point_triangle)
        wake_restless(motion, candidates.edge_edge)
    return most


@kernel
def _find(
    contact: ContactState, x: FloatArray, kind: int, pairs: Pairs, hits: Hits, last: int
) -> None:
    """Note the pairs of which one side went through the other, and that are no contacts yet.

    Args:
        contact: Pairs sleep, wake, and are dropped where they are out of date.
        x: Where the nodes are [m].
        kind: POINTS or EDGES.
        pairs: Those of that kind.
        hits: Written.
        last: When pairs were looked at before in this step, by `Contacts.clock`, or -1.
    """
    motion, signs, touch = contact.motion, contact.signs, contact.touch
    slack = contact.slack + 2.0 * touch
    hits.count[0] = 0
    for k in range(pairs.counts[N_NEAR]):
        if may_be_under(signs, k, touch) if kind == _POINTS else may_be_crossed(signs, k):
            _look_at(contact, x, kind, pairs, k, hits, last)
    _let_sleep(contact, x, kind, pairs)
    k = pairs.counts[N_NEAR]
    until = horizon(motion, slack)
    while k < pairs.counts[N_PAIRS]:
        if pairs.wake[k] > until:
            k += 1
            continue
        if _is_dead(contact.candidates, kind, k):
            drop_pair(pairs, k)
            continue
        nodes = nodes_of_pair(pairs, k)
        if can_touch(motion, pairs, k, slack) and _is_due(contact, nodes, last):
            _look_at(contact, x, kind, pairs, k, hits, last)
            apart = _apart(x, kind, nodes)
            note_distance(motion, pairs, k, apart)
            if is_near(motion, apart):
                make_near(pairs, k)
        k += 1


@kernel
def _look_at(
    contact: ContactState,
    x: FloatArray,
    kind: int,
    pairs: Pairs,
    k: int,
    hits: Hits,
    last: int,
) -> None:
    """Note pair `k` if one side went through the other, and it is no contact yet."""
    contacts, nodes = contact.contacts, nodes_of_pair(pairs, k)
    if (
        is_known(contacts.known, contacts.node, nodes)
        or _is_dead(contact.candidates, kind, k)
        or not _is_due(contact, nodes, last)
    ):
        return
    if _meeting(contact, x, kind, nodes).is_one:
        first, second = pairs.item[k, 0], pairs.item[k, 1]
        if kind == _POINTS:
            add_hit(hits, nodes, second, second)
        else:
            add_hit(hits, nodes, first // 3, second // 3)


@kernel
def _is_due(contact: ContactState, nodes: Nodes, last: int) -> bool:
    """Whether nodes have moved since a look in this step, or there was none."""
    return last < 0 or have_moved_since(contact.contacts, nodes, last)


@kernel
def _is_dead(candidates: Candidates, kind: int, k: int) -> bool:
    """Whether pair `k` of that kind is out of date."""
    return is_dead_point(candidates, k) if kind == _POINTS else is_dead_edge(candidates, k)


@kernel
def _let_sleep(contact: ContactState, x: FloatArray, kind: int, pairs: Pairs) -> None:
    """Find out how far near pairs are apart whose turn it is, and let sleep those that are far."""
    motion = contact.motion
    turn, n = whose_turn(motion), pairs.counts[N_NEAR]
    k = turn + (n - 1 - turn) // STEPS_NEAR * STEPS_NEAR
    while k >= 0:  # backwards: another takes a place behind
        if _is_dead(contact.candidates, kind, k):
            drop_pair(pairs, k)
        else:
            apart = _apart(x, kind, nodes_of_pair(pairs, k))
            if not is_near(motion, apart):
                note_distance(motion, pairs, k, apart)
                make_far(pairs, k)
        k -= STEPS_NEAR


@kernel
def _add_hits(contact: ContactState, body: Body, kind: int, hits: Hits) -> None:
    """Look at the hits once more, in the order of their nodes, and push them apart."""
    contacts, generation = contact.contacts, contact.faces.generation
    sort_hits(hits)
    for i in range(hits.count[0]):
        nodes = nodes_of(hits.node, i)
        met = _meeting(contact, body.positions, kind, nodes)
        if not met.is_one:
            continue
        if add_contact(contacts, body, nodes, met.weights, met.normal, 0.0, contact.start):
            k, first, second = contacts.count[0] - 1, hits.face[i, 0], hits.face[i, 1]
            contacts.face[k, 0] = first
            contacts.face[k, 1] = second
            contacts.generation[k] = generation[first] + generation[second]


@kernel
def _apart(x: FloatArray, kind: int, nodes: Nodes) -> float:
    """How far a node is from where it would meet a triangle, or an edge from another [m]."""
    if kind == _EDGES:
        return distance_of_edges(_edges(x, nodes))
    at = _corners(x, nodes)
    return distance_to_triangle(at) - rim_of(at.a, at.b, at.c)


@kernel
def _meeting(contact: ContactState, x: FloatArray, kind: int, nodes: Nodes) -> Meeting:
    """Whether one side went through the other in this step."""
    if kind == _POINTS:
        under = _point_triangle(contact, _corners(x, nodes), nodes)
        weights = Weights(1.0, under.b + under.c - 1.0, -under.b, -under.c)
        return Meeting(under.is_through, weights, under.normal)
    crossed = _edge_edge(contact, _edges(x, nodes), nodes)
    weights = Weights(1.0 - crossed.s, crossed.s, crossed.t - 1.0, -crossed.t)
    return Meeting(crossed.is_through, weights, crossed.normal)


@inlined
def _corners(x: FloatArray, nodes: Nodes) -> Corners:
    return Corners(vec3(x, nodes[0]), vec3(x, nodes[1]), vec3(x, nodes[2]), vec3(x, nodes[3]))


@inlined
def _edges(x: FloatArray, nodes: Nodes) -> Edges:
    return Edges(vec3(x, nodes[0]), vec3(x, nodes[1]), vec3(x, nodes[2]), vec3(x, nodes[3]))


@kernel
def _point_triangle(contact: ContactState, now: Corners, nodes: Nodes) -> PointTriangle:
    """Whether the node went through the triangle and neither is inside out."""
    before = _corners(contact.start, nodes)
    met = point_triangle(before, now, _slack(contact, nodes), contact.touch)
    is_through = met.is_through and not is_tangled(contact, nodes)
    return PointTriangle(is_through, met.normal, met.b, met.c)


@kernel
def _edge_edge(contact: ContactState, now: Edges, nodes: Nodes) -> EdgeEdge:
    """Whether one edge went through the other and neither is inside out."""
    normal = contact.normal
    outward = add(vec3(normal, nodes[0]), vec3(normal, nodes[1]))
    other_outward = add(vec3(normal, nodes[2]), vec3(normal, nodes[3]))
    if (
        not do_overlap(now, outward, other_outward)
        or face_the_same_way(outward, other_outward)
        or is_tangled(contact, nodes)
    ):
        return EdgeEdge(False, outward, 0.0, 0.0)
    before, slack = _edges(contact.start, nodes), _slack(contact, nodes)
    return edge_edge(before, now, outward, other_outward, slack, contact.touch)


@kernel
def _find_on_floor(contact: ContactState, body: Body) -> None:
    for node in range(body.n_nodes):
        if body.positions[node, 2] < contact.floor - contact.touch:
            nodes, weights = (node, node, node, node), Weights(1.0, 0.0, 0.0, 0.0)
            up = Vec3(0.0, 0.0, 1.0)
            add_contact(contact.contacts, body, nodes, weights, up, contact.floor, contact.start)


@kernel
def is_tangled(contact: ContactState, nodes: Nodes) -> bool:
    """Whether one of the nodes is of a tetrahedron that is inside out."""
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
    return min(slack, contact.slack) + contact.touch
