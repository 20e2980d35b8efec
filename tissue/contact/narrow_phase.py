"""Narrow phase: which of the candidates went through each other in a Runge-Kutta step.

First all that did are found, with every node where it is; then they are taken one by one, in the
order of their nodes, tested once more and corrected. So the result does not depend on the order of
the search; and of several pairs that describe one contact, where node meets node, only the first
is taken.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.candidates import Candidates, is_stale_edge, is_stale_point
from tissue.contact.constraints import Manifold
from tissue.contact.contact_table import has_contact
from tissue.contact.distance import distance_of_edges, distance_to_triangle
from tissue.contact.edge_edge import (
    EdgeEdge,
    Edges,
    edge_edge,
    face_the_same_side,
    lines_overlap,
)
from tissue.contact.hits import Hits, add_hit, sort_hits
from tissue.contact.motion_bounds import (
    STEPS_NEAR,
    can_touch,
    first_scheduled,
    horizon,
    is_near,
    measure_motion,
    note_distance,
    wake_fast_pairs,
)
from tissue.contact.node_normals import has_inverted
from tissue.contact.pairs import (
    Nodes,
    Pairs,
    drop_pair,
    make_far,
    make_near,
    nodes_of,
    nodes_of_pair,
)
from tissue.contact.point_triangle import Corners, PointTriangle, point_triangle, rim_width
from tissue.contact.simd_prefilter import (
    may_be_crossed,
    may_be_under,
    prefilter_edges,
    prefilter_points,
)
from tissue.contact.solver import add_contact, have_moved_since
from tissue.contact.state import ContactState
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, add, vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import Body

_POINTS, _EDGES = 0, 1
"""Types of pairs: node and triangle, edge and edge."""


class _PairTest(NamedTuple):
    """Whether one side of a pair went through the other, and where they meet."""

    is_through: bool
    manifold: Manifold


@kernel
def update_motion(contact: ContactState, body: Body) -> float:
    """Measure how far nodes have moved; return the largest displacement in this step [m]."""
    candidates, motion = contact.candidates, contact.motion
    most = measure_motion(motion, body, contact.start, candidates.node, candidates.n_nodes)
    if motion.n_newly_fast > 0:
        wake_fast_pairs(motion, candidates.point_triangle)
        wake_fast_pairs(motion, candidates.edge_edge)
    return most


@kernel
def find_contacts(contact: ContactState, body: Body) -> None:
    """Add the contacts that are not there yet, each corrected at once. `update_motion` first."""
    candidates, x = contact.candidates, body.positions
    last = contact.tested_at
    contact.tested_at = contact.contacts.clock
    points, edges = candidates.point_triangle, candidates.edge_edge
    prefilter_points(points, x, contact.signs)
    _find_hits(contact, x, _POINTS, points, contact.point_hits, last)
    prefilter_edges(edges, x, contact.normal, contact.signs)
    _find_hits(contact, x, _EDGES, edges, contact.edge_hits, last)
    _add_hits(contact, body, _POINTS, contact.point_hits)
    _add_hits(contact, body, _EDGES, contact.edge_hits)
    if contact.floor > -np.inf:
        _find_on_floor(contact, body)


@kernel
def _find_hits(
    contact: ContactState, x: FloatArray, pair_type: int, pairs: Pairs, hits: Hits, last: int
) -> None:
    """Note the pairs of which one side went through the other, and that are no contacts yet.

    Args:
        contact: Pairs sleep, wake, and are dropped where they are out of date.
        x: Where the nodes are [m].
        pair_type: _POINTS or _EDGES.
        pairs: The pairs of that type.
        hits: Written.
        last: When pairs were tested before in this step, by `Contacts.clock`, or -1.
    """
    motion, signs, tolerance = contact.motion, contact.signs, contact.tolerance
    residual = contact.largest_residual + 2.0 * tolerance
    hits.n_hits = 0
    for k in range(pairs.n_near):
        if may_be_under(signs, k, tolerance) if pair_type == _POINTS else may_be_crossed(signs, k):
            _test_pair(contact, x, pair_type, pairs, k, hits, last)
    _schedule_near(contact, x, pair_type, pairs)
    k = pairs.n_near
    until = horizon(motion, residual)
    while k < pairs.n_pairs:
        if pairs.wake[k] > until:
            k += 1
            continue
        if _is_stale(contact.candidates, pair_type, k):
            drop_pair(pairs, k)
            continue
        nodes = nodes_of_pair(pairs, k)
        if can_touch(motion, pairs, k, residual) and _is_due(contact, nodes, last):
            _test_pair(contact, x, pair_type, pairs, k, hits, last)
            distance = _distance(x, pair_type, nodes)
            note_distance(motion, pairs, k, distance)
            if is_near(motion, distance):
                make_near(pairs, k)
        k += 1


@kernel
def _test_pair(
    contact: ContactState,
    x: FloatArray,
    pair_type: int,
    pairs: Pairs,
    k: int,
    hits: Hits,
    last: int,
) -> None:
    """Note pair `k` if one side went through the other, and it is no contact yet."""
    contacts, nodes = contact.contacts, nodes_of_pair(pairs, k)
    if (
        has_contact(contacts.table, contacts.node, nodes)
        or _is_stale(contact.candidates, pair_type, k)
        or not _is_due(contact, nodes, last)
    ):
        return
    if _tested(contact, x, pair_type, nodes).is_through:
        first, second = pairs.item[k, 0], pairs.item[k, 1]
        if pair_type == _POINTS:
            add_hit(hits, nodes, second, second)
        else:
            add_hit(hits, nodes, first // 3, second // 3)


@kernel
def _is_due(contact: ContactState, nodes: Nodes, last: int) -> bool:
    """Whether nodes have moved since pairs were tested in this step, or none was tested yet."""
    return last < 0 or have_moved_since(contact.contacts, nodes, last)


@kernel
def _is_stale(candidates: Candidates, pair_type: int, k: int) -> bool:
    """Whether pair `k` of that type is out of date."""
    return is_stale_point(candidates, k) if pair_type == _POINTS else is_stale_edge(candidates, k)


@kernel
def _schedule_near(contact: ContactState, x: FloatArray, pair_type: int, pairs: Pairs) -> None:
    """Compute the distances of the near pairs scheduled for this step; far ones go to sleep."""
    motion = contact.motion
    first, n = first_scheduled(motion), pairs.n_near
    k = first + (n - 1 - first) // STEPS_NEAR * STEPS_NEAR
    while k >= 0:  # backwards: another takes a place behind
        if _is_stale(contact.candidates, pair_type, k):
            drop_pair(pairs, k)
        else:
            distance = _distance(x, pair_type, nodes_of_pair(pairs, k))
            if not is_near(motion, distance):
                note_distance(motion, pairs, k, distance)
                make_far(pairs, k)
        k -= STEPS_NEAR


@kernel
def _add_hits(contact: ContactState, body: Body, pair_type: int, hits: Hits) -> None:
    """Test the hits once more, in the order of their nodes, and correct positions."""
    contacts, generation = contact.contacts, contact.faces.generation
    sort_hits(hits)
    for i in range(hits.n_hits):
        nodes = nodes_of(hits.node, i)
        test = _tested(contact, body.positions, pair_type, nodes)
        if not test.is_through:
            continue
        if add_contact(contacts, body, nodes, test.manifold, 0.0, contact.start):
            k, first, second = contacts.n_contacts - 1, hits.face[i, 0], hits.face[i, 1]
            contacts.face[k, 0] = first
            contacts.face[k, 1] = second
            contacts.generation[k] = generation[first] + generation[second]


@kernel
def _find_on_floor(contact: ContactState, body: Body) -> None:
    """Add contacts of the nodes that are under the floor."""
    manifold = Manifold(Weights(1.0, 0.0, 0.0, 0.0), Vec3(0.0, 0.0, 1.0))
    for node in range(body.n_nodes):
        if body.positions[node, 2] < contact.floor - contact.tolerance:
            nodes = (node, node, node, node)
            add_contact(contact.contacts, body, nodes, manifold, contact.floor, contact.start)


@kernel
def _distance(x: FloatArray, pair_type: int, nodes: Nodes) -> float:
    """Return how far a node is from where it would meet a triangle, or an edge another [m]."""
    if pair_type == _EDGES:
        return distance_of_edges(_edges(x, nodes))
    at = _corners(x, nodes)
    return distance_to_triangle(at) - rim_width(at.a, at.b, at.c)


@kernel
def _tested(contact: ContactState, x: FloatArray, pair_type: int, nodes: Nodes) -> _PairTest:
    """Test whether one side of a pair went through the other in this step."""
    if pair_type == _POINTS:
        under = _point_triangle(contact, _corners(x, nodes), nodes)
        weights = Weights(1.0, under.b + under.c - 1.0, -under.b, -under.c)
        return _PairTest(under.is_through, Manifold(weights, under.normal))
    crossed = _edge_edge(contact, _edges(x, nodes), nodes)
    weights = Weights(1.0 - crossed.s, crossed.s, crossed.t - 1.0, -crossed.t)
    return _PairTest(crossed.is_through, Manifold(weights, crossed.normal))


@inlined
def _corners(x: FloatArray, nodes: Nodes) -> Corners:
    return Corners(vec3(x, nodes[0]), vec3(x, nodes[1]), vec3(x, nodes[2]), vec3(x, nodes[3]))


@inlined
def _edges(x: FloatArray, nodes: Nodes) -> Edges:
    return Edges(vec3(x, nodes[0]), vec3(x, nodes[1]), vec3(x, nodes[2]), vec3(x, nodes[3]))


@kernel
def _point_triangle(contact: ContactState, now: Corners, nodes: Nodes) -> PointTriangle:
    """Test whether the node went through the triangle and neither is inverted."""
    before = _corners(contact.start, nodes)
    test = point_triangle(before, now, _residual(contact, nodes), contact.tolerance)
    is_through = test.is_through and not has_inverted(contact.inverted_step, contact.step, nodes)
    return PointTriangle(is_through, test.normal, test.b, test.c)


@kernel
def _edge_edge(contact: ContactState, now: Edges, nodes: Nodes) -> EdgeEdge:
    """Test whether one edge went through the other and neither is inverted."""
    normal = contact.normal
    outward = add(vec3(normal, nodes[0]), vec3(normal, nodes[1]))
    other_outward = add(vec3(normal, nodes[2]), vec3(normal, nodes[3]))
    if (
        not lines_overlap(now, outward, other_outward)
        or face_the_same_side(outward, other_outward)
        or has_inverted(contact.inverted_step, contact.step, nodes)
    ):
        return EdgeEdge(False, outward, 0.0, 0.0)
    before, residual = _edges(contact.start, nodes), _residual(contact, nodes)
    return edge_edge(before, now, outward, other_outward, residual, contact.tolerance)


@kernel
def _residual(contact: ContactState, nodes: Nodes) -> float:
    """Return how deep in each other these nodes may have been before the step [m]."""
    last = contact.step - 1
    residual = 0.0
    for node in nodes:
        if contact.depth_step[node] == last:
            residual = max(residual, contact.depth[node])
    return min(residual, contact.largest_residual) + contact.tolerance
