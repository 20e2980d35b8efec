"""Weights that put the force of a contact and its reaction on one line, so that they turn nothing.

A contact is listed once in a time step, and its sides slide past each other meanwhile, rub, and
overlap. A force on a node and the opposite one on the listed point of a face are then on two
parallel lines, and make a torque. So a force acts where its own line meets the face; between two
ridges, where its line meets both.

The line of a force that is nearly along the face, or of a deep overlap beside a small face, meets
it far away or nowhere. So a weight leaves the listed one by `_LARGEST_SHIFT` at most: what asks for
n times that shift gets 1 / n of it, and nothing jumps where the line meets no face. The torque that
is left is taken by a couple (`couples.py`).

Eight contacts at a time: each number is a vector of eight.
"""

from typing import NamedTuple

from tissue.contact.penalty.eight_contacts import TINY, Four, FourPoints, combined
from tissue.core.jit import inlined
from tissue.core.simd import Lanes, lanes
from tissue.core.simd_gather import larger, larger_bits, where_larger
from tissue.core.vec3 import Vec3, axpy, cross, dot, scale, sub

_LARGEST_SHIFT = 0.3
"""By how much a weight may differ from the listed one. More: deep overlaps act far from where they
are; the stable step is that of the listed weights. Less: more is left to couples."""


class _Shift(NamedTuple):
    """How far the points of a contact are from the line of its force: `p / per` and `q / per`."""

    p: Lanes
    """Shift of the second weight of a face, or of the point on the first ridge; times `per`."""
    q: Lanes
    """Shift of the third weight of a face, or of the point on the second ridge; times `per`."""
    per: Lanes


class OnLine(NamedTuple):
    """Where the forces of eight contacts act."""

    weights: Four
    """Weights of the nodes; those of each contact add up to what the listed ones do."""
    turning: int
    """Bits for the contacts whose force and reaction are still on two lines."""


@inlined
def weights_on_line(x: FourPoints, listed: Four, force: Vec3) -> OnLine:
    """Return the weights of the nodes for forces that turn nothing, as far as there are any.

    Args:
        x: Positions of the nodes [m].
        listed: The weights that the contacts were listed with. The first is 1 for a node and a
            face, and for a node and the floor, whose four nodes are one.
        force: The force on the side of the positive weights [N]; of any length.
    """
    zero, one = lanes(0.0), lanes(1.0)
    across = combined(listed, x)
    is_ridge = larger_bits(one, listed.a)
    shift = _to_line_on_face(x, across, force)
    if is_ridge != 0:
        other = _to_line_of_ridges(x, across, force)
        shift = _Shift(
            where_larger(one, listed.a, other.p, shift.p),
            where_larger(one, listed.a, other.q, shift.q),
            where_larger(one, listed.a, other.per, shift.per),
        )
    most = larger(larger(_size(shift.p), _size(shift.q)), _size(shift.p + shift.q))
    longest, square = lanes(1.0 / _LARGEST_SHIFT) * most, shift.per * shift.per
    share = shift.per / larger(larger(square, longest * longest), lanes(TINY))
    p, q = share * shift.p, share * shift.q
    on_face = Four(zero, p + q, zero - p, zero - q)
    moved = Four(
        where_larger(one, listed.a, zero - p, on_face.a),
        where_larger(one, listed.a, p, on_face.b),
        where_larger(one, listed.a, q, on_face.c),
        where_larger(one, listed.a, zero - q, on_face.d),
    )
    weights = Four(listed.a + moved.a, listed.b + moved.b, listed.c + moved.c, listed.d + moved.d)
    # The floor is no node: it gives no reaction, and the weights add up to 1.
    has_reaction = larger_bits(lanes(0.5), listed.a + listed.b + listed.c + listed.d)
    return OnLine(weights, has_reaction & ~larger_bits(square, longest * longest))


@inlined
def _to_line_on_face(x: FourPoints, across: Vec3, force: Vec3) -> _Shift:
    """Return the way along the face to where the line of a force through the node meets it.

    Args:
        x: Positions of the node and the corners [m].
        across: From the listed point of the face to the node [m].
        force: The force [N].
    """
    ab, ac = sub(x.c, x.b), sub(x.d, x.b)
    area = cross(ab, ac)
    along = dot(area, force)
    way = axpy(lanes(0.0) - dot(area, across), force, scale(along, across))
    p, q = dot(cross(way, ac), area), dot(cross(ab, way), area)
    return _Shift(p, q, along * dot(area, area))


@inlined
def _to_line_of_ridges(x: FourPoints, across: Vec3, force: Vec3) -> _Shift:
    """Return the ways along the edges ab and cd to where one line along a force meets both.

    Args:
        x: Positions of the ends of the edges [m].
        across: From the listed point of the second edge to that of the first [m].
        force: The force [N].
    """
    u, v, zero = sub(x.b, x.a), sub(x.d, x.c), lanes(0.0)
    p, q = dot(across, cross(v, force)), dot(across, cross(u, force))
    return _Shift(zero - p, zero - q, dot(cross(u, v), force))


@inlined
def _size(a: Lanes) -> Lanes:
    """Return the absolute values."""
    return larger(a, lanes(0.0) - a)
