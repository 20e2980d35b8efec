"""Eight pairs of edges at a time inside kernels: how far apart they are, and whether they cross.

What is rounded is so otherwise than in the functions of one pair: who asks leaves what is close to
a bound to those.
"""

from tissue.contact.edge_edge import EDGE_END
from tissue.contact.penalty.eight_contacts import FourPoints, smaller
from tissue.core.jit import inlined
from tissue.core.simd import Lanes, lanes
from tissue.core.simd_gather import larger, larger_bits
from tissue.core.vec3 import axpy, cross, dot, sub

WIDER = 1e-9
"""Share by which bounds are wider here than in the functions of one pair."""

_TINY = 1e-300
"""Stands for 0 where it divides."""


@inlined
def squared_distances(at: FourPoints) -> Lanes:
    """Return the squared distances of the segments ab and cd [m2], see `distance_of_edges`."""
    u, v, r = sub(at.b, at.a), sub(at.d, at.c), sub(at.a, at.c)
    uu, vv, uv = larger(dot(u, u), lanes(_TINY)), larger(dot(v, v), lanes(_TINY)), dot(u, v)
    ur, vr = dot(u, r), dot(v, r)
    s = _share((uv * vr - ur * vv) / larger(uu * vv - uv * uv, lanes(_TINY)))
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
