"""Prefilter of pairs of ridges, eight at a time: which may touch.

Most pairs that are looked at are too far apart, or do not cross. Bounds are a little wider than in
the test of one pair (`ridge_touch`), so that rounding makes no difference to what touches.
"""

from tissue.contact.penalty.eight_contacts import points_of_contacts
from tissue.contact.penalty.eight_edges import WIDER, crossing_bits, squared_distances
from tissue.contact.penalty.near_pairs import CONTACT_REACH
from tissue.contact.penalty.ridge_pairs import RidgePairs
from tissue.contact.penalty.ridge_touch import HELD_BEYOND, LEAST_SLACK, PARALLEL
from tissue.contact.penalty.ridges import Ridges
from tissue.contact.penalty.touch import TIME_AHEAD
from tissue.core.array_types import IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes, filled, lanes, square_root, store_lanes
from tissue.core.simd_gather import larger, larger_bits, where_larger
from tissue.core.vec3 import Vec3, axpy, cross, dot, scale, sub
from tissue.mesh.body import Body

_TINY = 1e-300
"""Stands for 0 where it divides."""

_WIDER = 1e-6
"""By how much the sines of angles are wider than in the test of one pair."""


@kernel
def note_ends(found: RidgePairs, ridges: Ridges, n: int) -> None:
    """Write the ends of the first `n` pairs of `asked`, and fill up to whole eights."""
    _note_nodes(found, ridges.node, found.end, n)


@kernel
def note_tips(found: RidgePairs, ridges: Ridges, n: int) -> None:
    """Write the tips of the faces beside the first `n` pairs of `asked` as `note_ends` does."""
    _note_nodes(found, ridges.tip, found.tip, n)


@inlined
def _note_nodes(found: RidgePairs, node: IntArray, of_asked: IntArray, n: int) -> None:
    """Write two nodes of either ridge."""
    for i in range(filled(n)):
        k = found.asked[min(i, n - 1)]
        one, other = found.ridge[k, 0], found.ridge[k, 1]
        of_asked[i, 0], of_asked[i, 1] = node[one, 0], node[one, 1]
        of_asked[i, 2], of_asked[i, 3] = node[other, 0], node[other, 1]


@kernel
def crossing_ridges(found: RidgePairs, body: Body, size: float, i: int) -> int:
    """Return bits for the pairs from row `i` of `asked` on that may be near and cross.

    Args:
        found: `end` is written for `asked`. `slack` is written: that of the others.
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
    return crossing_bits(at, PARALLEL) & ~larger_bits(distance, furthest)


@inlined
def _faster(v: Vec3, w: Vec3) -> Lanes:
    """Return the speed of the faster of two ends [m/s]."""
    return square_root(larger(dot(v, v), dot(w, w)))


@kernel
def pushing_ridges(found: RidgePairs, body: Body, i: int) -> int:
    """Return bits for the pairs from row `i` of `asked` on between whose faces a direction may be.

    Args:
        found: `end` and `tip` are written for `asked`.
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
    return is_unclear | (is_between & ~larger_bits(most, lanes(HELD_BEYOND + _WIDER)))


@inlined
def _outward(along: Vec3, to_tip: Vec3, to_other: Vec3) -> Vec3:
    """Return vectors out of the body at ridges, see `outward_at`."""
    own, beside = cross(along, to_tip), cross(to_other, along)
    apart = sub(to_tip, to_other)
    is_beside = where_larger(dot(apart, apart), lanes(0.0), lanes(1.0), lanes(0.0))
    return axpy(is_beside / _length(beside), beside, scale(lanes(1.0) / _length(own), own))


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
