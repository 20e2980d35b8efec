"""Whether a node touches a face, where, and in which direction it is pushed.

The normal is continuous over the other lip: at each corner it is that of the node there where the
lip is smooth, that of the face at ridges and rims, and in between a blend; and between the corners
it is interpolated. So it does not matter which of the faces around a corner a node touches, and
nothing jumps as it slides.
"""

import math
from typing import NamedTuple

from tissue.contact.node_normals import has_inverted
from tissue.contact.penalty.contact_forces import PenaltyForces, weighted_sum
from tissue.contact.penalty.near_pairs import CONTACT_REACH, NearPairs
from tissue.contact.penalty.search_state import SearchState
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, sub, vec3
from tissue.mesh.body import Body

TIME_AHEAD = 1.5e-3
"""Time [s] for which contacts are kept ready: a time step of 1 ms, with something to spare. A node
that comes nearer than that is not seen before it overlaps."""

FACING = -0.1
"""Cosine between the normals of node and face up to which they face each other."""

OVERLAP_DEPTH = 0.5
"""Depth below a face from which on a node is not looked at, per node size."""

_DEPTH_OF_LOST = 1.0
"""The same for a node that is known to be inside another part. Larger: it is pushed out on the far
side of thin parts; smaller: it stays where it is."""

_RIM = 0.15
"""How far outside a triangle a node still touches it, as a barycentric weight. Larger: contacts
reach beyond rims; 0: a node on a ridge slips between the two faces."""

_HELD_RIM, _HELD_FACING = 0.3, 0.1
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


class Touch(NamedTuple):
    """A node and a face."""

    is_touching: bool
    slack: float
    """By how much the ways of the four nodes may add up before the pair needs another look [m];
    0 if that depends on how they move against each other."""
    b: Vec3
    """Barycentric weights of the foot in the triangle."""
    normal: Vec3
    """Unit vector in which the node is pushed."""
    distance_squared: float
    """Squared distance of the node from the foot, less where it has that contact already [m2]."""


@kernel
def nothing(slack: float) -> Touch:
    """Return that a pair does not touch, and need not be looked at before ways add up to that."""
    return Touch(False, slack, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), 0.0)


@kernel
def touch_of(search: SearchState, forces: PenaltyForces, body: Body, node: int, face: int) -> Touch:
    """Find whether a node touches the face in a place of `NearPairs`.

    Args:
        search: Normals, ways, and the contacts that the node has.
        forces: The contacts as they are.
        body: Where the nodes are.
        node: The node.
        face: The face.
    """
    pairs, x, size = search.pairs, body.positions, search.ways.node_size
    a, b, c = pairs.triangle[face, 0], pairs.triangle[face, 1], pairs.triangle[face, 2]
    i = vec3(x, a)
    ab, ac, ap = sub(vec3(x, b), i), sub(vec3(x, c), i), sub(vec3(x, node), i)
    area = cross(ab, ac)
    square = dot(area, area)
    if not square > 0.0:
        return nothing(0.0)
    outward = scale(1.0 / math.sqrt(square), area)
    height = dot(ap, outward)
    ahead = TIME_AHEAD * (norm(vec3(body.velocities, node)) + 0.1)
    if height > CONTACT_REACH * size + ahead:
        return nothing(0.5 * (height - CONTACT_REACH * size))
    deepest = (_DEPTH_OF_LOST if pairs.is_lost[node] == 1 else OVERLAP_DEPTH) * size
    if height < -deepest:
        return nothing(-height - deepest)
    own, is_held = vec3(search.normal, node), _has_contact(search, forces, node, face)
    if dot(own, outward) > (_HELD_FACING if is_held else FACING) * norm(own):
        return nothing(0.2 * CONTACT_REACH * size)
    wb, wc = dot(cross(ap, ac), area) / square, dot(cross(ab, ap), area) / square
    rim = _HELD_RIM if is_held else _RIM
    outside = -rim - min(1.0 - wb - wc, min(wb, wc))
    if outside > 0.0:
        return nothing(0.3 * outside * math.sqrt(math.sqrt(square)))
    foot = _clamped(wb, wc)
    normal = _interpolated(search.normal, pairs, face, foot, outward)
    d = _apart(x, pairs, node, face, foot)
    gap = dot(normal, d)
    closing = max(-dot(normal, _apart(body.velocities, pairs, node, face, foot)), 0.0)
    if gap > CONTACT_REACH * size + TIME_AHEAD * closing:
        return nothing(0.0)
    if has_inverted(search.inverted_step, search.step, (node, a, b, c)):
        return nothing(0.0)
    if not _came_from_outside(search, forces, body, node, face, foot, normal, gap):
        return nothing(0.0)
    return Touch(True, 0.0, foot, normal, (_HELD_SHARE if is_held else 1.0) * dot(d, d))


@kernel
def _has_contact(search: SearchState, forces: PenaltyForces, node: int, face: int) -> bool:
    """Whether a node is in contact with a face since the last search."""
    if search.listed_at[node] != search.n_listings:
        return False
    triangle = search.pairs.triangle
    for c in range(search.contact[node], search.contact[node] + search.n_contacts[node]):
        if (
            forces.node[c, 1] == triangle[face, 0]
            and forces.node[c, 2] == triangle[face, 1]
            and forces.node[c, 3] == triangle[face, 2]
        ):
            return True
    return False


@kernel
def _clamped(wb: float, wc: float) -> Vec3:
    """Return barycentric weights, those below zero set to zero."""
    a, b, c = max(1.0 - wb - wc, 0.0), max(wb, 0.0), max(wc, 0.0)
    return scale(1.0 / (a + b + c), Vec3(a, b, c))


@kernel
def _apart(values: FloatArray, pairs: NearPairs, node: int, face: int, foot: Vec3) -> Vec3:
    """Return the value at a node less that at a foot in a face, of values at the nodes."""
    a, b, c = pairs.triangle[face, 0], pairs.triangle[face, 1], pairs.triangle[face, 2]
    at = axpy(foot.x, vec3(values, a), scale(foot.y, vec3(values, b)))
    return sub(vec3(values, node), axpy(foot.z, vec3(values, c), at))


@kernel
def _interpolated(
    normal: FloatArray, pairs: NearPairs, face: int, foot: Vec3, outward: Vec3
) -> Vec3:
    """Return the unit normal at a foot in a face whose own is `outward`."""
    a, b, c = pairs.triangle[face, 0], pairs.triangle[face, 1], pairs.triangle[face, 2]
    total = scale(foot.x, _corner_normal(vec3(normal, a), outward))
    total = axpy(foot.y, _corner_normal(vec3(normal, b), outward), total)
    total = axpy(foot.z, _corner_normal(vec3(normal, c), outward), total)
    return scale(1.0 / norm(total), total)


@kernel
def _corner_normal(of_node: Vec3, outward: Vec3) -> Vec3:
    """Blend the normal of a node, of any length, with that of a face."""
    size = norm(of_node)
    if not size > 0.0:
        return outward
    cosine = dot(of_node, outward) / size
    share = min(max(_STEEPNESS * (cosine - _SMOOTH), 0.0), 1.0)
    return axpy(share / size, of_node, scale(1.0 - share, outward))


@kernel
def _came_from_outside(
    search: SearchState,
    forces: PenaltyForces,
    body: Body,
    node: int,
    face: int,
    foot: Vec3,
    normal: Vec3,
    gap: float,
) -> bool:
    """Whether a node was outside a face in the last search, or in contact there, or lost contact.

    The body at rest does not overlap itself: a node that is behind a face there is on the other
    side of a thin piece of tissue.
    """
    pairs, size, before = search.pairs, search.ways.node_size, search.ways.before
    a, b, c = pairs.triangle[face, 0], pairs.triangle[face, 1], pairs.triangle[face, 2]
    i = vec3(before, a)
    area = cross(sub(vec3(before, b), i), sub(vec3(before, c), i))
    length = norm(area)
    gap_before = 0.0
    if length > 0.0:
        gap_before = dot(area, _apart(before, pairs, node, face, foot)) / length
    deepest = ENTRY * size + _CAUGHT * _depth_before(search, forces, node, normal)
    if gap_before >= -deepest:
        return True
    if pairs.is_lost[node] == 0 and gap < -_RECAPTURED * size:
        return False
    rest = body.rest
    i = vec3(rest, a)
    area = cross(sub(vec3(rest, b), i), sub(vec3(rest, c), i))
    from_corner = sub(vec3(rest, node), i)
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
