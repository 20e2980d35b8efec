"""First look at near pairs, eight at a time: which of them may have gone through each other.

Signs of a few products tell it for most. They are held a little less tightly than by the second
look, at one pair, so that rounding makes no difference.
"""

from tissue.contact.edge_edge import END
from tissue.contact.pairs import N_NEAR, Pairs, eight_corners
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, lanes, square_root, store_lanes
from tissue.core.vec3 import add, cross, dot, sub

LESS = 0.5
"""By how much less tightly, as a share of each bound."""


@kernel
def look_at_points(pairs: Pairs, x: FloatArray, signs: FloatArray) -> None:
    """Write how high nodes are above the planes of near triangles [m], to the first of `signs`."""
    for k in range(0, pairs.counts[N_NEAR], WIDTH):
        a = eight_corners(x, pairs, k, 1)
        ab, ac = sub(eight_corners(x, pairs, k, 2), a), sub(eight_corners(x, pairs, k, 3), a)
        area = cross(ab, ac)
        height = dot(area, sub(eight_corners(x, pairs, k, 0), a))
        store_lanes(signs, k, height / square_root(dot(area, area)))


@kernel
def may_be_under(signs: FloatArray, k: int, touch: float) -> bool:
    """Whether near pair `k` may be a node that went through a triangle, by `look_at_points`."""
    return signs[k] < -LESS * touch


@kernel
def look_at_edges(pairs: Pairs, x: FloatArray, normal: FloatArray, signs: FloatArray) -> None:
    """Write for near pairs of edges what `do_overlap` and `is_inner` look at, to four rows."""
    n = len(signs) // 4
    for k in range(0, pairs.counts[N_NEAR], WIDTH):
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
    """Whether near pair `k` may be edges that went through each other, by `look_at_edges`."""
    n, inner = len(signs) // 4, LESS * END
    faces_it, overlaps = signs[k] < 0.0, signs[n + k] < 0.0
    return faces_it & overlaps & (signs[2 * n + k] > inner) & (signs[3 * n + k] > inner)
