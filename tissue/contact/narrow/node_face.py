"""Whether a node touches a face, where, and in which direction it is pushed.

The normal is continuous over the other lip: at each corner it is that of the node there where the
lip is smooth, that of the face at feature edges and rims, and in between a blend; and between the
corners it is interpolated. So it does not matter which of the faces around a corner a node touches,
and nothing jumps as it slides.

Eight pairs at a time: first those that do not touch are rejected, since most pairs that are due are
far apart; then what is left is measured closely.
"""

import math
from typing import NamedTuple

from tissue.contact.geometry.eight_contacts import points_of_contacts
from tissue.contact.response.contacts import PenaltyForces
from tissue.contact.search.near_pairs import CONTACT_REACH, know_motion
from tissue.contact.search.search_state import SearchState
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes, load_lanes, square_root, store_lanes, unfused
from tissue.core.simd_rows import larger, larger_bits, natural, store_rows_of_four, where_larger
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, sub, vec3
from tissue.mesh.body import Body

_PATH_NEAR = 0.2
"""Sum of the paths of its nodes after which a near pair is tested even if they moved together, per
node size: as they turn."""

_AHEAD = 0.1
"""Speed [m/s] that a node is taken to have at least."""

TIME_AHEAD = 1.5e-3
"""Time [s] for which contacts are kept ready: a time step of 1 ms, with something to spare. A node
that comes nearer than that is not seen before it overlaps."""

STILL = 0.02
"""Motion of a node against a face after which their contact is sought again, per node size. Larger:
cheaper, and normals are out of date; smaller: all is sought in every time step."""

_FACING = -0.1
"""Cosine between the normals of node and face up to which they face each other."""

OVERLAP_DEPTH = 0.5
"""Depth below a face from which on a node is not tested, per node size."""

_DEPTH_OF_PENETRATING = 1.0
"""Depth of the same kind for a node that is known to be inside another part. Larger: it is pushed
out on the far side of thin parts; smaller: it stays where it is."""

_RIM_OF_TOUCH = 0.15
"""Barycentric weight outside a triangle up to which a node still touches it. Larger: contacts
reach beyond rims; 0: a node on a feature edge slips between the two faces."""

_HELD_RIM, _HELD_FACING = 0.3, 0.1
"""Rim and cosine where the node has a contact with that face. Without a difference contacts at a
limit come and go, and the node trembles."""

_SMOOTH, _STEEPNESS = 0.7, 4.0
"""Cosine between the normals of a corner and its face from which on the corner's counts, and how
fast: it counts alone from 0.95 on. Without the blend nodes flutter at the switch."""

ENTRY = 0.01
"""Overlap before the time step up to which a node counts as outside, per node size."""

REST_REACH = 2.0
"""Distance at rest up to which a node behind a face is on the other side of one thin piece of
tissue, per node size; further off it has nothing to do with it."""


class NodesAndCorners(NamedTuple):
    """A vector for the node and for each corner of its face, of eight tests."""

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


@kernel
def reject_early(
    search: SearchState, forces: PenaltyForces, body: Body, begin: int, end: int
) -> None:
    """List the pairs that are due of some of the nodes, and write which of them do not touch.

    Args:
        search: Tests are written.
        forces: The contacts as they are.
        body: Where the nodes are.
        begin: The first, a place in `NearPairs.nodes`.
        end: The place behind the last.
    """
    tests = search.pairs.tests
    tests.n = tests.n_close = tests.next = tests.next_close = 0
    for i in range(begin, end):
        node = search.pairs.nodes[i]
        if search.is_due[node] == 1:
            _list_due(search, forces, body, node)
    for j in range(0, tests.n, WIDTH):
        _reject_eight(search, body, j)


@kernel
def _list_due(search: SearchState, forces: PenaltyForces, body: Body, node: int) -> None:
    """List the pairs of a node that are due, and up to where each may touch."""
    pairs, motion, tests = search.pairs, search.motion, search.pairs.tests
    first = natural(tests.n)
    n, least, own_path = first, math.inf, motion.path[node]
    # Which are due cannot be foretold: branches would take longer than what they skip.
    for k in range(natural(pairs.begin[node]), natural(pairs.end[node])):
        face = natural(pairs.face[k])
        know_motion(pairs, motion, face)
        path = own_path + pairs.path[face]
        left = pairs.wake[k] - path
        is_due = (pairs.is_near[k] == 1) | (left < 0.0)
        tests.pair[n], tests.path[n] = k, path
        n += 1 if is_due else 0
        least = min(least, math.inf if is_due else left)
    tests.n = n
    search.resting_until[node] = motion.quiet_path + least
    _note_limits(search, body, node, first)
    _note_faces(search, forces, node, first)


@inlined
def _note_limits(search: SearchState, body: Body, node: int, first: int) -> None:
    """Record up to where a node may touch, for its tests from `first` on and to the next eight."""
    tests, size = search.pairs.tests, search.motion.node_size
    ahead = TIME_AHEAD * (norm(vec3(body.velocities, node)) + _AHEAD)
    highest = lanes(CONTACT_REACH * size + ahead)
    depth = _DEPTH_OF_PENETRATING if search.pairs.is_penetrating[node] == 1 else OVERLAP_DEPTH
    deepest, size_of_normal = lanes(depth * size), lanes(norm(vec3(search.normal, node)))
    for j in range(first, tests.n, WIDTH):
        store_lanes(tests.highest, j, highest)
        store_lanes(tests.deepest, j, deepest)
        store_lanes(tests.size_of_normal, j, size_of_normal)


@inlined
def _note_faces(search: SearchState, forces: PenaltyForces, node: int, first: int) -> None:
    """Record the nodes of the tests of a node from `first` on, and which it has contacts with."""
    pairs, tests = search.pairs, search.pairs.tests
    n = search.n_contacts[node] if search.listed_at[node] == search.n_listings else 0
    one = _corners(search, forces, node, 0, n)
    two, three = _corners(search, forces, node, 1, n), _corners(search, forces, node, 2, n)
    for j in range(first, natural(tests.n)):
        face = natural(pairs.face[natural(tests.pair[j])])
        a, b, c = pairs.triangle[face, 0], pairs.triangle[face, 1], pairs.triangle[face, 2]
        is_held = (
            (((a ^ one[0]) | (b ^ one[1]) | (c ^ one[2])) == 0)
            | (((a ^ two[0]) | (b ^ two[1]) | (c ^ two[2])) == 0)
            | (((a ^ three[0]) | (b ^ three[1]) | (c ^ three[2])) == 0)
        )
        tests.nodes[j, 0], tests.nodes[j, 1], tests.nodes[j, 2], tests.nodes[j, 3] = node, a, b, c
        tests.is_held[j] = 1.0 if is_held else 0.0


@inlined
def _corners(
    search: SearchState, forces: PenaltyForces, node: int, q: int, n: int
) -> tuple[int, int, int]:
    """Return the corners of the face of contact `q` of the `n` of a node; -1 behind the last."""
    if q >= n:
        return -1, -1, -1
    c = search.contact[node] + q
    return forces.node[c, 1], forces.node[c, 2], forces.node[c, 3]


@inlined
def _reject_eight(search: SearchState, body: Body, j: int) -> None:
    """Write up to where eight pairs need no other test, and list those that are close."""
    tests, size, zero = search.pairs.tests, search.motion.node_size, everywhere(0.0)
    over = over_faces(points_of_tests(body.positions, tests.nodes, j))
    own = points_of_tests(search.normal, tests.nodes, j).p
    highest, deepest = unfused(load_lanes(tests.highest, j)), unfused(load_lanes(tests.deepest, j))
    is_held = unfused(load_lanes(tests.is_held, j))
    facing = where_larger(is_held, zero, everywhere(_HELD_FACING), everywhere(_FACING))
    rim = where_larger(is_held, zero, everywhere(_HELD_RIM), everywhere(_RIM_OF_TOUCH))
    w, height = over.weights, over.height
    least = where_larger(w.y, w.z, w.z, w.y)
    outside = zero - rim - where_larger(w.x, least, least, w.x)
    slack = everywhere(0.3) * outside * square_root(over.length)
    slack = where_larger(outside, zero, slack, everywhere(-1.0))
    along, most = dot(own, over.outward), facing * unfused(load_lanes(tests.size_of_normal, j))
    slack = where_larger(along, most, everywhere(0.2 * CONTACT_REACH * size), slack)
    below = zero - height
    slack = where_larger(below, deepest, below - deepest, slack)
    above = everywhere(0.5) * (height - everywhere(CONTACT_REACH * size))
    slack = where_larger(height, highest, above, slack)
    path, still = unfused(load_lanes(tests.path, j)), everywhere(STILL * size)
    far = where_larger(slack, still, slack, still)
    wake = path + where_larger(zero, slack, everywhere(_PATH_NEAR * size), far)
    store_lanes(tests.wake, j, wake)
    store_lanes(tests.left, j, where_larger(zero, slack, still, wake - path))
    _note_result(search, j, larger_bits(zero, slack))


@inlined
def _note_result(search: SearchState, j: int, is_close: int) -> None:
    """Record which of eight pairs are close, and list those; `is_close`: a bit for each."""
    pairs, tests = search.pairs, search.pairs.tests
    n = natural(tests.n_close)
    for q in range(min(WIDTH, tests.n - j)):
        k, bit = natural(tests.pair[j + q]), is_close >> q & 1
        pairs.wake[k] = tests.wake[j + q]
        pairs.is_near[k] = bit
        tests.close[n] = j + q
        for corner in range(4):
            tests.close_nodes[n, corner] = tests.nodes[j + q, corner]
        n += bit
    tests.n_close = n


@inlined
def points_of_tests(values: FloatArray, nodes: IntArray, i: int) -> NodesAndCorners:
    """Return nodal values at the nodes of eight tests."""
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
def measure_close_pairs(search: SearchState, body: Body) -> None:
    """Find where close nodes would touch their faces."""
    for i in range(0, search.pairs.tests.n_close, WIDTH):
        _measure_eight(search, body, i)


@inlined
def _measure_eight(search: SearchState, body: Body, i: int) -> None:
    """Find where eight close nodes would touch their faces."""
    tests, size, zero = search.pairs.tests, search.motion.node_size, everywhere(0.0)
    nodes, x = tests.close_nodes, points_of_tests(body.positions, tests.close_nodes, i)
    over = over_faces(x)
    foot = _clamped(over.weights)
    normal = _interpolated(points_of_tests(search.normal, nodes, i), foot, over.outward)
    d = _apart(x, foot)
    gap = dot(normal, d)
    velocities = points_of_tests(body.velocities, nodes, i)
    closing = larger(zero - dot(normal, _apart(velocities, foot)), zero)
    reach = everywhere(CONTACT_REACH * size) + everywhere(TIME_AHEAD) * closing
    distance = where_larger(gap, reach, everywhere(-1.0), dot(d, d))
    distance = where_larger(over.square, zero, distance, everywhere(-1.0))
    before = points_of_tests(search.motion.before, nodes, i)
    area = cross(sub(before.b, before.a), sub(before.c, before.a))
    length = _norm_of_eight(area)
    gap_before = dot(area, _apart(before, foot)) / length
    gap_before = where_larger(length, zero, gap_before, zero)
    store_rows_of_four(tests.foot, i, foot.x, foot.y, foot.z, gap_before)
    store_rows_of_four(tests.push, i, normal.x, normal.y, normal.z, gap)
    store_lanes(tests.distance, i, distance)


@inlined
def _norm_of_eight(a: Vec3) -> Lanes:
    """Return the lengths of eight vectors."""
    return square_root(dot(a, a))


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
    return scale(everywhere(1.0) / _norm_of_eight(total), total)


@inlined
def _corner_normal(of_node: Vec3, outward: Vec3) -> Vec3:
    """Blend the normals of nodes, of any length, with those of faces."""
    zero, one, size = everywhere(0.0), everywhere(1.0), _norm_of_eight(of_node)
    steep = everywhere(_STEEPNESS) * (dot(of_node, outward) / size - everywhere(_SMOOTH))
    share = larger(steep, zero)
    share = where_larger(one, share, share, one)
    blend = axpy(share / size, of_node, scale(one - share, outward))
    return Vec3(
        where_larger(size, zero, blend.x, outward.x),
        where_larger(size, zero, blend.y, outward.y),
        where_larger(size, zero, blend.z, outward.z),
    )
