"""Weights that put the force of a contact and its reaction on one line, so that they turn nothing.

A contact is listed once in a time step, and its sides slide past each other meanwhile, rub, and
overlap. A force on a node and the opposite one on the listed point of a face are then on two
parallel lines, and make a torque. So a force acts where its own line meets the face; between two
ridges, where its line meets both.

Eight contacts at a time: each number is a vector of eight.
"""

from tissue.contact.penalty.eight_contacts import Four, FourPoints
from tissue.core.jit import inlined
from tissue.core.simd import WIDTH, Lanes, lanes
from tissue.core.simd_gather import larger, larger_bits, where_larger
from tissue.core.vec3 import Vec3, axpy, cross, dot, sub

_STEEPEST = 0.2
"""Cosine between a force and the normal of the face, or of the plane along both ridges, below which
the line of the force meets them nowhere near. It then acts at the listed points."""

_LARGEST_SHIFT = 0.3
"""By how much a weight may differ from the listed one. More: deep overlaps act far from where they
are; the stable step is that of the listed weights."""

ALL = (1 << WIDTH) - 1
"""Bits of all contacts of eight."""


@inlined
def weights_on_line(x: FourPoints, listed: Four, force: Vec3) -> Four:
    """Return the weights of the nodes for forces that turn nothing.

    Args:
        x: Positions of the nodes [m].
        listed: The weights that the contacts were listed with. The first is 1 for a node and a
            face, and for a node and the floor, whose four nodes are one.
        force: The force on the side of the positive weights [N]; of any length.
    """
    one = lanes(1.0)
    is_ridge = larger_bits(one, listed.a)
    if is_ridge == 0:
        return _if_near(_of_node_and_face(x, force), listed)
    if is_ridge == ALL:
        return _if_near(_of_ridges(x, force), listed)
    faces, ridges = _of_node_and_face(x, force), _of_ridges(x, force)
    found = Four(
        where_larger(one, listed.a, ridges.a, faces.a),
        where_larger(one, listed.a, ridges.b, faces.b),
        where_larger(one, listed.a, ridges.c, faces.c),
        where_larger(one, listed.a, ridges.d, faces.d),
    )
    return _if_near(found, listed)


@inlined
def _if_near(found: Four, listed: Four) -> Four:
    """Return the weights that were found where they differ little from those listed, else these."""
    shift = larger(
        larger(_size(found.a - listed.a), _size(found.b - listed.b)),
        larger(_size(found.c - listed.c), _size(found.d - listed.d)),
    )
    most = lanes(_LARGEST_SHIFT)
    return Four(
        where_larger(most, shift, found.a, listed.a),
        where_larger(most, shift, found.b, listed.b),
        where_larger(most, shift, found.c, listed.c),
        where_larger(most, shift, found.d, listed.d),
    )


@inlined
def _of_node_and_face(x: FourPoints, force: Vec3) -> Four:
    """Return the weights of a node and of the point of a face on a line through the node."""
    ab, ac, from_a = sub(x.c, x.b), sub(x.d, x.b), sub(x.a, x.b)
    area = cross(ab, ac)
    square, along = dot(area, area), dot(area, force)
    # One division for two: it takes as long as ten products.
    per_both = lanes(1.0) / (along * square)
    at = axpy(lanes(0.0) - dot(area, from_a) * square * per_both, force, from_a)
    per_square = along * per_both
    wb, wc = dot(cross(at, ac), area) * per_square, dot(cross(ab, at), area) * per_square
    nowhere = _is_shallow(along, square, force)
    return Four(lanes(1.0), wb + wc - lanes(1.0) + nowhere, lanes(0.0) - wb, lanes(0.0) - wc)


@inlined
def _of_ridges(x: FourPoints, force: Vec3) -> Four:
    """Return the weights of the points of the edges ab and cd on one line along a force."""
    u, v, apart = sub(x.b, x.a), sub(x.d, x.c), sub(x.a, x.c)
    across = cross(u, v)
    along = dot(across, force)
    per_along = lanes(-1.0) / along
    s = dot(apart, cross(v, force)) * per_along
    t = dot(apart, cross(u, force)) * per_along
    nowhere = _is_shallow(along, dot(across, across), force)
    return Four(lanes(1.0) - s, s + nowhere, t - lanes(1.0), lanes(0.0) - t)


@inlined
def _is_shallow(along: Lanes, square: Lanes, force: Vec3) -> Lanes:
    """Return a huge number where the line of a force meets a plane nowhere near, else 0.

    Args:
        along: Product of the force and a normal of the plane.
        square: Squared length of that normal.
        force: The force.
    """
    least = lanes(_STEEPEST * _STEEPEST) * square * dot(force, force)
    return where_larger(along * along, least, lanes(0.0), lanes(1e9))


@inlined
def _size(a: Lanes) -> Lanes:
    """Return the absolute values."""
    return larger(a, lanes(0.0) - a)
