"""Whether two edges touch, where, and in which direction they are pushed.

They do where they cross, and the direction across both points out of the body at either: between
the normals of the two faces there. Any other direction is one of a node and a face.

Most tested pairs are too far apart, or do not cross: a prefilter takes eight at a time. Its
bounds are a little wider than in the test of one pair, so that rounding does not change what
touches.
"""

from typing import NamedTuple

from tissue.contact.geometry.edges import (
    Crossing,
    Edges,
    crossing_of,
    distance_of_edges,
    is_inner,
    separation,
)
from tissue.contact.geometry.eight_contacts import (
    WIDER,
    crossing_bits,
    points_of_contacts,
    squared_distances,
)
from tissue.contact.geometry.faces import has_inverted
from tissue.contact.narrow.node_face import ENTRY, OVERLAP_DEPTH, REST_REACH, TIME_AHEAD
from tissue.contact.search.edge_pairs import NOT_LISTED, EdgePairs, outward_at
from tissue.contact.search.feature_edges import FeatureEdges
from tissue.contact.search.near_pairs import CONTACT_REACH
from tissue.contact.search.search_state import SearchState
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes, filled, lanes, square_root, store_lanes
from tissue.core.simd_rows import larger, larger_bits, where_larger
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, sub, vec3
from tissue.mesh.body import Body

_PARALLEL = 0.1
"""Sine of the angle up to which edges count as parallel: they touch with their nodes. Smaller: the
direction of the force turns by a right angle as edges turn by a degree."""

_BEYOND, _HELD_BEYOND = 0.02, 0.1
"""Sine of the angle by which a direction may lie beyond the normals of the faces; the second where
the edges are in contact. Without a difference contacts at a limit come and go."""

LEAST_SLACK = 0.01
"""Path of the nodes, per node size, before edges that are near and do not touch are tested
again. Larger: they overlap before they are seen; smaller: they are tested in each time step."""

_TINY = 1e-300
"""Stands for 0 where it divides."""

_WIDER = 1e-6
"""Margin of the sines of angles over those in the test of one pair."""


class EdgeTouch(NamedTuple):
    """Two edges."""

    is_touching: bool
    slack: float
    """Sum of the paths of the four nodes up to which the pair needs no other test [m]."""
    s: float
    """Where along the first, as a fraction."""
    t: float
    """Where along the second, as a fraction."""
    normal: Vec3
    """Unit vector in which the first is pushed."""


@kernel
def edge_touch_of(search: SearchState, body: Body, k: int) -> EdgeTouch:
    """Find whether the edges of pair `k` touch.

    Args:
        search: The pairs and their edges, and where nodes were in the last search.
        body: Where the nodes are.
        k: The pair.
    """
    found, edges, size = search.edge_pairs, search.edges, search.motion.node_size
    one, other = found.edge[k, 0], found.edge[k, 1]
    is_held = found.contact[k] != NOT_LISTED
    apart = _no_touch(LEAST_SLACK * size)
    now = _edges(edges, body.positions, one, other)
    distance = distance_of_edges(now)
    ahead = TIME_AHEAD * (_speed(edges, body, one) + _speed(edges, body, other))
    if distance > CONTACT_REACH * size + ahead:
        return _no_touch(max(0.5 * (distance - CONTACT_REACH * size), apart.slack))
    crossing = crossing_of(now)
    if not (
        crossing.is_feature and _is_steep(now) and is_inner(crossing.s) and is_inner(crossing.t)
    ):
        return apart
    beyond = _HELD_BEYOND if is_held else _BEYOND
    normal = _pushing(edges, body.positions, other, crossing)
    if not (
        _points_out(edges, body.positions, other, normal, beyond)
        and _points_out(edges, body.positions, one, scale(-1.0, normal), beyond)
    ):
        return apart
    gap = dot(normal, separation(now, crossing.s, crossing.t))
    moving = separation(_edges(edges, body.velocities, one, other), crossing.s, crossing.t)
    if gap > CONTACT_REACH * size + TIME_AHEAD * max(-dot(normal, moving), 0.0):
        return apart
    if gap < -OVERLAP_DEPTH * size:
        return apart
    a, b = edges.node[one, 0], edges.node[one, 1]
    c, d = edges.node[other, 0], edges.node[other, 1]
    if has_inverted(search.inverted_step, search.step, (a, b, c, d)):
        return apart
    before = _edges(edges, search.motion.before, one, other)
    gap_before = dot(normal, separation(before, crossing.s, crossing.t))
    if not (
        is_held
        or gap_before >= -ENTRY * size
        or _lost_contact(edges, body, one, other, crossing, size)
    ):
        return apart
    return EdgeTouch(True, apart.slack, crossing.s, crossing.t, normal)


@kernel
def _lost_contact(
    edges: FeatureEdges, body: Body, one: int, other: int, crossing: Crossing, size: float
) -> bool:
    """Return whether two edges that overlap have lost their contact: they do not at rest.

    A cut that divides an edge makes two of it, of which no contact is known. Edges that lie the
    wrong side out in the body at rest are those on two sides of a thin piece of tissue.

    Args:
        edges: The edges.
        body: The body at rest.
        one: The first edge.
        other: The second.
        crossing: Where they cross now.
        size: Mean node size [m].
    """
    rest = _edges(edges, body.rest, one, other)
    across = cross(sub(rest.b, rest.a), sub(rest.d, rest.c))
    apart = separation(rest, crossing.s, crossing.t)
    towards = 1.0 if dot(across, outward_at(edges, body.rest, other)) > 0.0 else -1.0
    is_behind = towards * dot(across, apart) < -1e-3 * size * norm(across)
    return not (is_behind and norm(apart) < REST_REACH * size)


@kernel
def _no_touch(slack: float) -> EdgeTouch:
    """Return a pair that does not touch, and needs no test before paths add up to that."""
    return EdgeTouch(False, slack, 0.0, 0.0, Vec3(0.0, 0.0, 0.0))


@kernel
def _edges(edges: FeatureEdges, values: FloatArray, one: int, other: int) -> Edges:
    """Return the values at the ends of two edges."""
    return Edges(
        vec3(values, edges.node[one, 0]),
        vec3(values, edges.node[one, 1]),
        vec3(values, edges.node[other, 0]),
        vec3(values, edges.node[other, 1]),
    )


@kernel
def _speed(edges: FeatureEdges, body: Body, edge: int) -> float:
    """Return the speed of the faster end of an edge [m/s]."""
    v = body.velocities
    return max(norm(vec3(v, edges.node[edge, 0])), norm(vec3(v, edges.node[edge, 1])))


@kernel
def _is_steep(at: Edges) -> bool:
    """Whether two edges are far from parallel."""
    u, v = sub(at.b, at.a), sub(at.d, at.c)
    return bool(norm(cross(u, v)) > _PARALLEL * norm(u) * norm(v))


@kernel
def _pushing(edges: FeatureEdges, x: FloatArray, other: int, crossing: Crossing) -> Vec3:
    """Return the direction across two edges that points out of the body at the second."""
    towards = dot(crossing.normal, outward_at(edges, x, other))
    return scale(1.0 if towards > 0.0 else -1.0, crossing.normal)


@kernel
def _points_out(
    edges: FeatureEdges, x: FloatArray, edge: int, direction: Vec3, beyond: float
) -> bool:
    """Whether a direction across an edge lies between the normals of its faces.

    Args:
        edges: The edges.
        x: Positions of the nodes [m].
        edge: The edge.
        direction: Unit vector.
        beyond: Sine of the angle by which it may lie beyond them.
    """
    if not dot(direction, outward_at(edges, x, edge)) > 0.0:
        return False
    a = vec3(x, edges.node[edge, 0])
    along = sub(vec3(x, edges.node[edge, 1]), a)
    square = dot(along, along)
    for side in range(2):
        inwards = sub(vec3(x, edges.tip[edge, side]), a)
        inwards = axpy(-dot(inwards, along) / square, along, inwards)
        if dot(direction, inwards) > beyond * norm(inwards):
            return False
    return True


@kernel
def note_ends(found: EdgePairs, edges: FeatureEdges, n: int) -> None:
    """Write the ends of the first `n` pairs of `due`, and fill up to whole eights."""
    _note_nodes(found, edges.node, found.end, n)


@kernel
def note_tips(found: EdgePairs, edges: FeatureEdges, n: int) -> None:
    """Write the tips of the faces next to the first `n` pairs of `due` as `note_ends` does."""
    _note_nodes(found, edges.tip, found.tip, n)


@inlined
def _note_nodes(found: EdgePairs, node: IntArray, of_due: IntArray, n: int) -> None:
    """Write two nodes of either edge."""
    for i in range(filled(n)):
        k = found.due[min(i, n - 1)]
        one, other = found.edge[k, 0], found.edge[k, 1]
        of_due[i, 0], of_due[i, 1] = node[one, 0], node[one, 1]
        of_due[i, 2], of_due[i, 3] = node[other, 0], node[other, 1]


@kernel
def crossing_pairs(found: EdgePairs, body: Body, size: float, i: int) -> int:
    """Return bits for the pairs from row `i` of `due` on that may be near and cross.

    Args:
        found: `end` is written for `due`. `slack` is written: that of the others.
        body: Where the nodes are.
        size: Mean node size [m].
        i: First of eight rows.
    """
    at = points_of_contacts(found.end, body.positions, i)
    distance = square_root(squared_distances(at))
    v = points_of_contacts(found.end, body.velocities, i)
    speed = _faster(v.a, v.b) + _faster(v.c, v.d)
    reach, least = CONTACT_REACH * size, lanes(LEAST_SLACK * size)
    furthest = lanes(1.0 + WIDER) * (lanes(reach) + lanes(TIME_AHEAD) * speed)
    far = larger(lanes(0.5) * (distance - lanes(reach)), least)
    store_lanes(found.slack, 0, where_larger(distance, furthest, far, least))
    return crossing_bits(at, _PARALLEL) & ~larger_bits(distance, furthest)


@inlined
def _faster(v: Vec3, w: Vec3) -> Lanes:
    """Return the speed of the faster of two ends [m/s]."""
    return square_root(larger(dot(v, v), dot(w, w)))


@kernel
def pushing_pairs(found: EdgePairs, body: Body, i: int) -> int:
    """Return bits for the pairs from row `i` of `due` on between whose faces a direction may be.

    Args:
        found: `end` and `tip` are written for `due`.
        body: Where the nodes are.
        i: First of eight rows.
    """
    x = body.positions
    at, tip = points_of_contacts(found.end, x, i), points_of_contacts(found.tip, x, i)
    u, v = sub(at.b, at.a), sub(at.d, at.c)
    across = cross(u, v)
    across = scale(lanes(1.0) / _length(across), across)
    p, q, r, s = sub(tip.a, at.a), sub(tip.b, at.a), sub(tip.c, at.c), sub(tip.d, at.c)
    out, other_out = dot(across, _outward(u, p, q)), dot(across, _outward(v, r, s))
    pushed = scale(where_larger(other_out, lanes(0.0), lanes(1.0), lanes(-1.0)), across)
    back = scale(lanes(-1.0), pushed)
    most = larger(
        larger(_sine(back, u, p), _sine(back, u, q)),
        larger(_sine(pushed, v, r), _sine(pushed, v, s)),
    )
    is_unclear = larger_bits(lanes(_WIDER), other_out * other_out)
    is_between = larger_bits(lanes(_WIDER), out * other_out)
    return is_unclear | (is_between & ~larger_bits(most, lanes(_HELD_BEYOND + _WIDER)))


@inlined
def _outward(along: Vec3, to_tip: Vec3, to_other: Vec3) -> Vec3:
    """Return vectors out of the body at edges, see `outward_at`."""
    own, second = cross(along, to_tip), cross(to_other, along)
    apart = sub(to_tip, to_other)
    is_second = where_larger(dot(apart, apart), lanes(0.0), lanes(1.0), lanes(0.0))
    return axpy(is_second / _length(second), second, scale(lanes(1.0) / _length(own), own))


@inlined
def _sine(direction: Vec3, along: Vec3, to_tip: Vec3) -> Lanes:
    """Return the sines of the angles by which directions lie beyond the normals of faces."""
    square = larger(dot(along, along), lanes(_TINY))
    inwards = axpy(lanes(0.0) - dot(to_tip, along) / square, along, to_tip)
    return dot(direction, inwards) / _length(inwards)


@inlined
def _length(a: Vec3) -> Lanes:
    """Return the lengths of vectors, for dividing by: a little above 0."""
    return square_root(larger(dot(a, a), lanes(_TINY)))
