"""Prefilter of near pairs, eight at a time: which may have gone through each other.

The signs of a few products decide for most pairs. The bounds are a little wider than in the test of
one pair (`narrow_phase`), so that rounding makes no difference.
"""

from tissue.contact.edge_edge import EDGE_END
from tissue.contact.pairs import Pairs, eight_corners
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, lanes, square_root, store_lanes
from tissue.core.vec3 import add, cross, dot, sub

_WIDER = 0.5
"""Bounds of the prefilter as a share of those of the test."""


@kernel
def prefilter_points(pairs: Pairs, x: FloatArray, signs: FloatArray) -> None:
    """Write how high nodes are above the planes of near triangles [m], to the first of `signs`."""
    for k in range(0, pairs.n_near, WIDTH):
        a = eight_corners(x, pairs, k, 1)
        ab, ac = sub(eight_corners(x, pairs, k, 2), a), sub(eight_corners(x, pairs, k, 3), a)
        area = cross(ab, ac)
        height = dot(area, sub(eight_corners(x, pairs, k, 0), a))
        store_lanes(signs, k, height / square_root(dot(area, area)))


@kernel
def may_be_under(signs: FloatArray, k: int, tolerance: float) -> bool:
    """Whether near pair `k` may be a node that went through a triangle, by `prefilter_points`."""
    return bool(signs[k] < -_WIDER * tolerance)


@kernel
def prefilter_edges(pairs: Pairs, x: FloatArray, normal: FloatArray, signs: FloatArray) -> None:
    """Write for near pairs of edges what `lines_overlap` and `is_inner` test, to four rows.

    Args:
        pairs: Near pairs come first.
        x: Where the nodes are [m], with room as of `room_for_points`.
        normal: Outward normals of the nodes [m2], with the same room.
        signs: Written, shape (4 * capacity of pairs,).
    """
    n = len(signs) // 4
    for k in range(0, pairs.n_near, WIDTH):
        a, c = eight_corners(x, pairs, k, 0), eight_corners(x, pairs, k, 2)
        ab, cd = sub(eight_corners(x, pairs, k, 1), a), sub(eight_corners(x, pairs, k, 3), c)
        outward = add(eight_corners(normal, pairs, k, 0), eight_corners(normal, pairs, k, 1))
        other = add(eight_corners(normal, pairs, k, 2), eight_corners(normal, pairs, k, 3))
        across, ac = cross(ab, cd), sub(c, a)
        towards = dot(across, outward)
        store_lanes(signs, k, towards * dot(across, other))
        store_lanes(signs, n + k, towards * dot(across, ac))
        square = dot(across, across)
        s = dot(cross(ac, cd), across) / square
        t = dot(cross(ac, ab), across) / square
        store_lanes(signs, 2 * n + k, s * (lanes(1.0) - s))
        store_lanes(signs, 3 * n + k, t * (lanes(1.0) - t))


@kernel
def may_be_crossed(signs: FloatArray, k: int) -> bool:
    """Whether near pair `k` may be edges that went through each other, by `prefilter_edges`."""
    n, inner = len(signs) // 4, _WIDER * EDGE_END
    faces_it, overlaps = signs[k] < 0.0, signs[n + k] < 0.0
    return bool(faces_it & overlaps & (signs[2 * n + k] > inner) & (signs[3 * n + k] > inner))
