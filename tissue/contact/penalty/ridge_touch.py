"""Whether two ridges touch, where, and in which direction they are pushed.

They do where they cross, and the direction across both points out of the body at either: between
the normals of the two faces there. Any other direction is one of a node and a face.
"""

from typing import NamedTuple

from tissue.contact.edge_edge import (
    Crossing,
    Edges,
    crossing_of,
    distance_of_edges,
    is_inner,
    separation,
)
from tissue.contact.node_normals import has_inverted
from tissue.contact.penalty.near_pairs import CONTACT_REACH
from tissue.contact.penalty.ridge_pairs import NOT_LISTED, outward_at
from tissue.contact.penalty.ridges import Ridges
from tissue.contact.penalty.search_state import SearchState
from tissue.contact.penalty.touch import ENTRY, OVERLAP_DEPTH, REST_REACH, TIME_AHEAD
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, sub, vec3
from tissue.mesh.body import Body

PARALLEL = 0.1
"""Sine of the angle up to which ridges count as parallel: they touch with their nodes. Smaller: the
direction of the force turns by a right angle as ridges turn by a degree."""

_BEYOND, HELD_BEYOND = 0.02, 0.1
"""Sine of the angle by which a direction may lie beyond the normals of the faces; the second where
the ridges are in contact. Without a difference contacts at a limit come and go."""

LEAST_SLACK = 0.01
"""Way that the nodes go, per node size, before ridges that are near and do not touch are looked at
again. Larger: they overlap before they are seen; smaller: they are looked at in each time step."""


class RidgeTouch(NamedTuple):
    """Two ridges."""

    is_touching: bool
    slack: float
    """By how much the ways of the four nodes may add up before the pair needs another look [m]."""
    s: float
    """Where along the first, as a fraction."""
    t: float
    """Where along the second, as a fraction."""
    normal: Vec3
    """Unit vector in which the first is pushed."""


@kernel
def ridge_touch_of(search: SearchState, body: Body, k: int) -> RidgeTouch:
    """Find whether the ridges of pair `k` touch.

    Args:
        search: The pairs and their ridges, and where nodes were in the last search.
        body: Where the nodes are.
        k: The pair.
    """
    found, ridges, size = search.ridge_pairs, search.ridges, search.ways.node_size
    one, other = found.ridge[k, 0], found.ridge[k, 1]
    is_held = found.contact[k] != NOT_LISTED
    apart = _no_touch(LEAST_SLACK * size)
    now = _edges(ridges, body.positions, one, other)
    distance = distance_of_edges(now)
    ahead = TIME_AHEAD * (_speed(ridges, body, one) + _speed(ridges, body, other))
    if distance > CONTACT_REACH * size + ahead:
        return _no_touch(max(0.5 * (distance - CONTACT_REACH * size), apart.slack))
    crossing = crossing_of(now)
    if not (crossing.is_one and _is_steep(now) and is_inner(crossing.s) and is_inner(crossing.t)):
        return apart
    beyond = HELD_BEYOND if is_held else _BEYOND
    normal = _pushing(ridges, body.positions, other, crossing)
    if not (
        _points_out(ridges, body.positions, other, normal, beyond)
        and _points_out(ridges, body.positions, one, scale(-1.0, normal), beyond)
    ):
        return apart
    gap = dot(normal, separation(now, crossing.s, crossing.t))
    moving = separation(_edges(ridges, body.velocities, one, other), crossing.s, crossing.t)
    if gap > CONTACT_REACH * size + TIME_AHEAD * max(-dot(normal, moving), 0.0):
        return apart
    if gap < -OVERLAP_DEPTH * size:
        return apart
    a, b = ridges.node[one, 0], ridges.node[one, 1]
    c, d = ridges.node[other, 0], ridges.node[other, 1]
    if has_inverted(search.inverted_step, search.step, (a, b, c, d)):
        return apart
    before = _edges(ridges, search.ways.before, one, other)
    gap_before = dot(normal, separation(before, crossing.s, crossing.t))
    if not (
        is_held
        or gap_before >= -ENTRY * size
        or _lost_contact(ridges, body, one, other, crossing, size)
    ):
        return apart
    return RidgeTouch(True, apart.slack, crossing.s, crossing.t, normal)


@kernel
def _lost_contact(
    ridges: Ridges, body: Body, one: int, other: int, crossing: Crossing, size: float
) -> bool:
    """Return whether two ridges that overlap have lost their contact: they do not at rest.

    A cut that divides a ridge makes two of it, of which no contact is known. Ridges that lie the
    wrong way round in the body at rest are those on two sides of a thin piece of tissue.

    Args:
        ridges: The ridges.
        body: The body at rest.
        one: The first ridge.
        other: The second.
        crossing: Where they cross now.
        size: Mean node size [m].
    """
    rest = _edges(ridges, body.rest, one, other)
    across = cross(sub(rest.b, rest.a), sub(rest.d, rest.c))
    apart = separation(rest, crossing.s, crossing.t)
    towards = 1.0 if dot(across, outward_at(ridges, body.rest, other)) > 0.0 else -1.0
    is_behind = towards * dot(across, apart) < -1e-3 * size * norm(across)
    return not (is_behind and norm(apart) < REST_REACH * size)


@kernel
def _no_touch(slack: float) -> RidgeTouch:
    """Return that a pair does not touch, and need not be looked at before ways add up to that."""
    return RidgeTouch(False, slack, 0.0, 0.0, Vec3(0.0, 0.0, 0.0))


@kernel
def _edges(ridges: Ridges, values: FloatArray, one: int, other: int) -> Edges:
    """Return the values at the ends of two ridges."""
    return Edges(
        vec3(values, ridges.node[one, 0]),
        vec3(values, ridges.node[one, 1]),
        vec3(values, ridges.node[other, 0]),
        vec3(values, ridges.node[other, 1]),
    )


@kernel
def _speed(ridges: Ridges, body: Body, edge: int) -> float:
    """Return the speed of the faster end of a ridge [m/s]."""
    v = body.velocities
    return max(norm(vec3(v, ridges.node[edge, 0])), norm(vec3(v, ridges.node[edge, 1])))


@kernel
def _is_steep(at: Edges) -> bool:
    """Whether two ridges are far from parallel."""
    u, v = sub(at.b, at.a), sub(at.d, at.c)
    return bool(norm(cross(u, v)) > PARALLEL * norm(u) * norm(v))


@kernel
def _pushing(ridges: Ridges, x: FloatArray, other: int, crossing: Crossing) -> Vec3:
    """Return the direction across two ridges that points out of the body at the second."""
    towards = dot(crossing.normal, outward_at(ridges, x, other))
    return scale(1.0 if towards > 0.0 else -1.0, crossing.normal)


@kernel
def _points_out(ridges: Ridges, x: FloatArray, edge: int, direction: Vec3, beyond: float) -> bool:
    """Whether a direction across a ridge lies between the normals of its faces.

    Args:
        ridges: The ridges.
        x: Positions of the nodes [m].
        edge: The ridge.
        direction: Unit vector.
        beyond: Sine of the angle by which it may lie beyond them.
    """
    if not dot(direction, outward_at(ridges, x, edge)) > 0.0:
        return False
    a = vec3(x, ridges.node[edge, 0])
    along = sub(vec3(x, ridges.node[edge, 1]), a)
    square = dot(along, along)
    for side in range(2):
        inwards = sub(vec3(x, ridges.tip[edge, side]), a)
        inwards = axpy(-dot(inwards, along) / square, along, inwards)
        if dot(direction, inwards) > beyond * norm(inwards):
            return False
    return True
