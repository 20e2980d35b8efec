"""Whether a node touches a face, where, and in which direction it is pushed.

The normal is continuous over the other lip: at each corner it is that of the node there where the
lip is smooth, that of the face at ridges and rims, and in between a blend; and between the corners
it is interpolated. So it does not matter which of the faces around a corner a node touches, and
nothing jumps as it slides.
"""

from typing import NamedTuple

from tissue.contact.node_normals import has_inverted
from tissue.contact.penalty.contact_forces import PenaltyForces, weighted_sum
from tissue.contact.penalty.eight_contacts import points_of_contacts
from tissue.contact.penalty.looks import Looks
from tissue.contact.penalty.near_pairs import CONTACT_REACH
from tissue.contact.penalty.search_state import SearchState
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes, square_root, store_lanes, unfused
from tissue.core.simd_gather import larger, where_larger
from tissue.core.simd_rows import store_rows_of_four
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, sub, vec3
from tissue.mesh.body import Body

TIME_AHEAD = 1.5e-3
"""Time [s] for which contacts are kept ready: a time step of 1 ms, with something to spare. A node
that comes nearer than that is not seen before it overlaps."""

STILL = 0.02
"""Motion of a node against a face after which their contact is sought again, per node size. Larger:
cheaper, and normals are out of date; smaller: all is sought in every time step."""

FACING = -0.1
"""Cosine between the normals of node and face up to which they face each other."""

OVERLAP_DEPTH = 0.5
"""Depth below a face from which on a node is not looked at, per node size."""

DEPTH_OF_LOST = 1.0
"""The same for a node that is known to be inside another part. Larger: it is pushed out on the far
side of thin parts; smaller: it stays where it is."""

RIM_OF_TOUCH = 0.15
"""How far outside a triangle a node still touches it, as a barycentric weight. Larger: contacts
reach beyond rims; 0: a node on a ridge slips between the two faces."""

HELD_RIM, HELD_FACING = 0.3, 0.1
"""The same two where the node has a contact with that face. Without a difference contacts at a
limit come and go, and the node trembles."""

_HELD_SHARE = 0.7
"""Share of its squared distance with which a face counts that the node has a contact with. Larger:
a node in a corner goes to and fro between two faces and trembles; smaller: it keeps one that it
left."""

_SMOOTH, _STEEPNESS = 0.7, 4.0
"""Cosine between the normals of a corner and its face from which on the corner's counts, and how
fast: it counts alone from 0.95 on. Without the blend nodes flutter at the switch."""

ENTRY = 0.01
"""Overlap before the time step up to which a node counts as outside, per node size."""

_CAUGHT = 1.5
"""How much deeper than its last contact a node may have been to count as the same overlap."""

_RECAPTURED = 0.08
"""Overlap up to which a node without a contact is taken for one that lost it, per node size, unless
it lies behind that face in the body at rest. 0: what is lost once sinks in for good."""

REST_REACH = 2.0
"""Distance at rest up to which a node behind a face is on the other side of one thin piece of
tissue, per node size; further off it has nothing to do with it."""


class NodesAndCorners(NamedTuple):
    """A vector for the node and for each corner of its face, of eight looks."""

    p: Vec3
    a: Vec3
    b: Vec3
    c: Vec3


class OverFaces(NamedTuple):
    """Eight nodes, seen from a face each."""

    square: Lanes
    """Square of twice the area of the face [m4]."""
    length: Lanes
    """Twice the area [m2]."""
    outward: Vec3
    """Unit normal of the face."""
    height: Lanes
    """Height of the node over its plane [m]."""
    weights: Vec3
    """Barycentric weights of the foot in the plane."""


class Touch(NamedTuple):
    """A node and a face."""

    is_touching: bool
    b: Vec3
    """Barycentric weights of the foot in the triangle."""
    normal: Vec3
    """Unit vector in which the node is pushed."""
    distance_squared: float
    """Squared distance of the node from the foot, less where it has that contact already [m2]."""


_NOTHING = Touch(False, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), 0.0)


@inlined
def points_of_looks(values: FloatArray, nodes: IntArray, i: int) -> NodesAndCorners:
    """Return nodal values at the nodes of eight looks."""
    at = points_of_contacts(nodes, values, i)
    return NodesAndCorners(_unfused(at.a), _unfused(at.b), _unfused(at.c), _unfused(at.d))


@inlined
def _unfused(a: Vec3) -> Vec3:
    """Return the same vectors, for arithmetic with the bits of scalars."""
    return Vec3(unfused(a.x), unfused(a.y), unfused(a.z))


@inlined
def everywhere(value: float) -> Lanes:
    """Return eight times the same number, with the bits of scalars."""
    return unfused(lanes(value))


@inlined
def over_faces(x: NodesAndCorners) -> OverFaces:
    """Return where eight nodes are, seen from a face each."""
    ab, ac, ap = sub(x.b, x.a), sub(x.c, x.a), sub(x.p, x.a)
    area = cross(ab, ac)
    square = dot(area, area)
    length = square_root(square)
    outward = scale(everywhere(1.0) / length, area)
    wb, wc = dot(cross(ap, ac), area) / square, dot(cross(ab, ap), area) / square
    weights = Vec3(everywhere(1.0) - wb - wc, wb, wc)
    return OverFaces(square, length, outward, dot(ap, outward), weights)


@kernel
def look_closely(search: SearchState, body: Body) -> None:
    """Find where close nodes would touch their faces."""
    for i in range(0, search.pairs.looks.n_close, WIDTH):
        _look_at_eight(search, body, i)


@inlined
def _look_at_eight(search: SearchState, body: Body, i: int) -> None:
    """Find where eight close nodes would touch their faces."""
    looks, size, zero = search.pairs.looks, search.ways.node_size, everywhere(0.0)
    nodes, x = looks.close_nodes, points_of_looks(body.positions, looks.close_nodes, i)
    over = over_faces(x)
    foot = _clamped(over.weights)
    normal = _interpolated(points_of_looks(search.normal, nodes, i), foot, over.outward)
    d = _apart(x, foot)
    gap = dot(normal, d)
    velocities = points_of_looks(body.velocities, nodes, i)
    closing = larger(zero - dot(normal, _apart(velocities, foot)), zero)
    reach = everywhere(CONTACT_REACH * size) + everywhere(TIME_AHEAD) * closing
    distance = where_larger(gap, reach, everywhere(-1.0), dot(d, d))
    distance = where_larger(over.square, zero, distance, everywhere(-1.0))
    before = points_of_looks(search.ways.before, nodes, i)
    area = cross(sub(before.b, before.a), sub(before.c, before.a))
    length = norm_of_eight(area)
    gap_before = dot(area, _apart(before, foot)) / length
    gap_before = where_larger(length, zero, gap_before, zero)
    store_rows_of_four(looks.foot, i, foot.x, foot.y, foot.z, gap_before)
    store_rows_of_four(looks.push, i, normal.x, normal.y, normal.z, gap)
    store_lanes(looks.distance, i, distance)


@inlined
def norm_of_eight(a: Vec3) -> Lanes:
    """Return the lengths of eight vectors."""
    return square_root(dot(a, a))


@kernel
def touch_of(search: SearchState, forces: PenaltyForces, body: Body, i: int) -> Touch:
    """Return whether the node of a close look touches the face.

    Args:
        search: The contacts that the node has, and where it was.
        forces: The contacts as they are.
        body: Where the nodes are.
        i: The close look.
    """
    looks = search.pairs.looks
    distance = looks.distance[i]
    if not distance >= 0.0:
        return _NOTHING
    nodes = looks.close_nodes
    four = (nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3])
    if has_inverted(search.inverted_step, search.step, four):
        return _NOTHING
    if not _came_from_outside(search, forces, body, i):
        return _NOTHING
    foot = Vec3(looks.foot[i, 0], looks.foot[i, 1], looks.foot[i, 2])
    share = _HELD_SHARE if looks.is_held[looks.close[i]] == 1.0 else 1.0
    return Touch(True, foot, _push(looks, i), share * distance)


@inlined
def _push(looks: Looks, i: int) -> Vec3:
    """Return the unit vector in which a close look would push its node."""
    return Vec3(looks.push[i, 0], looks.push[i, 1], looks.push[i, 2])


@inlined
def _clamped(weights: Vec3) -> Vec3:
    """Return barycentric weights, those below zero set to zero."""
    zero = everywhere(0.0)
    a = where_larger(zero, weights.x, zero, weights.x)
    b = where_larger(zero, weights.y, zero, weights.y)
    c = where_larger(zero, weights.z, zero, weights.z)
    return scale(everywhere(1.0) / (a + b + c), Vec3(a, b, c))


@inlined
def _apart(values: NodesAndCorners, foot: Vec3) -> Vec3:
    """Return the values at nodes less those at feet in their faces."""
    at = axpy(foot.x, values.a, scale(foot.y, values.b))
    return sub(values.p, axpy(foot.z, values.c, at))


@inlined
def _interpolated(normals: NodesAndCorners, foot: Vec3, outward: Vec3) -> Vec3:
    """Return the unit normals at feet in faces whose own are `outward`."""
    total = scale(foot.x, _corner_normal(normals.a, outward))
    total = axpy(foot.y, _corner_normal(normals.b, outward), total)
    total = axpy(foot.z, _corner_normal(normals.c, outward), total)
    return scale(everywhere(1.0) / norm_of_eight(total), total)


@inlined
def _corner_normal(of_node: Vec3, outward: Vec3) -> Vec3:
    """Blend the normals of nodes, of any length, with those of faces."""
    zero, one, size = everywhere(0.0), everywhere(1.0), norm_of_eight(of_node)
    steep = everywhere(_STEEPNESS) * (dot(of_node, outward) / size - everywhere(_SMOOTH))
    share = larger(steep, zero)
    share = where_larger(one, share, share, one)
    blend = axpy(share / size, of_node, scale(one - share, outward))
    return Vec3(
        where_larger(size, zero, blend.x, outward.x),
        where_larger(size, zero, blend.y, outward.y),
        where_larger(size, zero, blend.z, outward.z),
    )


@inlined
def _came_from_outside(search: SearchState, forces: PenaltyForces, body: Body, i: int) -> bool:
    """Whether a node was outside a face in the last search, or in contact there, or lost contact.

    The body at rest does not overlap itself: a node that is behind a face there is on the other
    side of a thin piece of tissue.
    """
    pairs, looks, size = search.pairs, search.pairs.looks, search.ways.node_size
    nodes, gap, gap_before = looks.close_nodes, looks.push[i, 3], looks.foot[i, 3]
    node = nodes[i, 0]
    if gap_before >= -(ENTRY * size):
        return True
    deepest = ENTRY * size + _CAUGHT * _depth_before(search, forces, node, _push(looks, i))
    if gap_before >= -deepest:
        return True
    if pairs.is_lost[node] == 0 and gap < -_RECAPTURED * size:
        return False
    rest = body.rest
    corner = vec3(rest, nodes[i, 1])
    area = cross(sub(vec3(rest, nodes[i, 2]), corner), sub(vec3(rest, nodes[i, 3]), corner))
    from_corner = sub(vec3(rest, node), corner)
    behind = dot(area, from_corner) < -1e-3 * size * norm(area)
    reach = REST_REACH * size
    return not (behind and dot(from_corner, from_corner) < reach * reach)


@kernel
def _depth_before(search: SearchState, forces: PenaltyForces, node: int, normal: Vec3) -> float:
    """Return how deep the contacts of a node in about that direction were in the last search."""
    if search.listed_at[node] != search.n_listings:
        return 0.0
    deepest = 0.0
    for c in range(search.contact[node], search.contact[node] + search.n_contacts[node]):
        if dot(vec3(forces.normal, c), normal) > 0.5:
            gap = dot(vec3(forces.normal, c), weighted_sum(forces, c, search.ways.before))
            deepest = max(deepest, forces.height[c] - gap)
    return deepest
