"""Vectors of eight contacts, and of eight pairs of edges, inside kernels.

Distances and crossings of eight pairs of edges are rounded otherwise than those of one pair
(`edges`): a caller leaves what is close to a bound to the functions of one pair.
"""

from typing import NamedTuple

from tissue.contact.geometry.edges import EDGE_END
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined
from tissue.core.simd import Lanes, lanes, square_root
from tissue.core.simd_rows import (
    larger,
    larger_bits,
    points_of_column,
    rows_of_four,
    rows_of_three,
    where_larger,
)
from tissue.core.vec3 import Vec3, axpy, cross, dot, scale, sub

TINY = 1e-300
"""Stands for 0 where it divides."""

WIDER = 1e-9
"""Share by which bounds are wider here than in the functions of one pair."""


class Four(NamedTuple):
    """A number for each of the four nodes of a contact, of eight contacts."""

    a: Lanes
    b: Lanes
    c: Lanes
    d: Lanes


class FourPoints(NamedTuple):
    """A vector for each of the four nodes of a contact, of eight contacts."""

    a: Vec3
    b: Vec3
    c: Vec3
    d: Vec3


@inlined
def three_of(rows: FloatArray, c: int) -> Vec3:
    """Return rows of three of eight contacts."""
    x, y, z = rows_of_three(rows, c)
    return Vec3(x, y, z)


@inlined
def four_of(rows: FloatArray, first: int) -> Four:
    """Return rows of four of eight contacts."""
    a, b, c, d = rows_of_four(rows, first)
    return Four(a, b, c, d)


@inlined
def _of_column(values: FloatArray, node: IntArray, c: int, q: int) -> Vec3:
    """Return nodal values at node `q` of eight contacts."""
    x, y, z = points_of_column(values, node, c, q)
    return Vec3(x, y, z)


@inlined
def points_of_contacts(node: IntArray, values: FloatArray, c: int) -> FourPoints:
    """Return nodal values at the nodes of eight contacts."""
    return FourPoints(
        _of_column(values, node, c, 0),
        _of_column(values, node, c, 1),
        _of_column(values, node, c, 2),
        _of_column(values, node, c, 3),
    )


@inlined
def combined(w: Four, x: FourPoints) -> Vec3:
    """Return sums over the four nodes, weighted."""
    return axpy(w.d, x.d, axpy(w.c, x.c, axpy(w.b, x.b, scale(w.a, x.a))))


@inlined
def where_positive(a: Lanes, this: Four, other: Four) -> Four:
    """Return `this` where `a` is positive, and `other` elsewhere."""
    zero = lanes(0.0)
    return Four(
        where_larger(a, zero, this.a, other.a),
        where_larger(a, zero, this.b, other.b),
        where_larger(a, zero, this.c, other.c),
        where_larger(a, zero, this.d, other.d),
    )


@inlined
def vectors_where_positive(a: Lanes, this: Vec3, other: Vec3) -> Vec3:
    """Return `this` where `a` is positive, and `other` elsewhere."""
    zero = lanes(0.0)
    return Vec3(
        where_larger(a, zero, this.x, other.x),
        where_larger(a, zero, this.y, other.y),
        where_larger(a, zero, this.z, other.z),
    )


@inlined
def smaller(a: Lanes, b: Lanes) -> Lanes:
    """Return the smaller of two numbers."""
    return where_larger(a, b, b, a)


@inlined
def share_within(longest: Lanes, a: Vec3) -> Lanes:
    """Return how much of a vector is within a length: 1 where it is no longer."""
    square, one = dot(a, a), lanes(1.0)
    if larger_bits(square, longest * longest) == 0:
        return one
    size = square_root(square)
    return where_larger(size, longest, longest / larger(size, lanes(TINY)), one)


@inlined
def squared_distances(at: FourPoints) -> Lanes:
    """Return the squared distances of the segments ab and cd [m2], see `distance_of_edges`."""
    u, v, r = sub(at.b, at.a), sub(at.d, at.c), sub(at.a, at.c)
    uu, vv, uv = larger(dot(u, u), lanes(TINY)), larger(dot(v, v), lanes(TINY)), dot(u, v)
    ur, vr = dot(u, r), dot(v, r)
    s = _share((uv * vr - ur * vv) / larger(uu * vv - uv * uv, lanes(TINY)))
    t = _share((uv * s + vr) / vv)
    # The nearest place to t, which is s again where t is not at an end.
    s = _share((uv * t - ur) / uu)
    apart = axpy(lanes(0.0) - t, v, axpy(s, u, r))
    return dot(apart, apart)


@inlined
def _share(a: Lanes) -> Lanes:
    """Return numbers limited to 0 to 1."""
    return smaller(larger(a, lanes(0.0)), lanes(1.0))


@inlined
def crossing_bits(at: FourPoints, sine: float) -> int:
    """Return bits for pairs that may cross inside, at an angle of which this is less than the sine.

    See `crossing_of` and `is_inner`.
    """
    u, v, w = sub(at.b, at.a), sub(at.d, at.c), sub(at.c, at.a)
    n = cross(u, v)
    square = dot(n, n)
    s, t = dot(cross(w, v), n), dot(cross(w, u), n)
    first = lanes(EDGE_END * (1.0 - 1e-3)) * square
    last = square - first
    is_steep = larger_bits(square, lanes(sine * sine * (1.0 - WIDER)) * (dot(u, u) * dot(v, v)))
    is_behind = larger_bits(smaller(s, t), first)
    return is_steep & is_behind & larger_bits(last, larger(s, t))
