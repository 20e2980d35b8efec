"""How much area at rest an anchor cuts while it sweeps an area of the body as it is.

Toughness is an energy per area at rest (Rivlin and Thomas 1953, J. Polym. Sci. 10:291). Tissue
ahead of an edge is squeezed, so that more of it is cut than is swept.
"""

from tissue.blade.anchors import ANCHORED, Anchors
from tissue.blade.edge import BladePose, sample_point
from tissue.blade.material_frame import MOST_STRAIN
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, store, sub, vec3

AVERAGED_OVER = 2.0
"""Distance over which the share is averaged, per `BladeState.reach`: strain jumps from tetrahedron
to tetrahedron. Over four or five node sizes muscle pays for 92 % of the section of its specimen,
over two for 96 %; the ripple at 160 J/m2 and 30 kPa is then 2 and 3 %."""

LARGEST_SHARE = MOST_STRAIN**2
"""Area at rest over area as it is, and the reverse, at most: an anchor slips at rest as if no
tetrahedron were strained by more than `MOST_STRAIN`."""


@kernel
def update_rest_share(
    anchors: Anchors, k: int, way: Vec3, slipped: Vec3, pose: BladePose, reach: float
) -> None:
    """Move the share of area at rest towards what it was where anchor `k` slipped.

    The length of edge at rest is that between the anchors on either side: these draw the surface
    that opens, and a single tetrahedron says less of it.

    Args:
        anchors: The share is written.
        k: The anchor.
        way: How far it slipped at rest [m].
        slipped: How far it slipped in the body as it is [m].
        pose: Pose of the blade.
        reach: `BladeState.reach` [m].
    """
    n = len(anchors.state)
    low, high = max(k - 1, 0), min(k + 1, n - 1)
    low = low if anchors.state[low] == ANCHORED else k
    high = high if anchors.state[high] == ANCHORED else k
    swept = norm(cross(slipped, pose.along))
    if low == high or swept == 0.0:
        return
    spacing = norm(sub(sample_point(pose, high, n), sample_point(pose, low, n)))
    beside = sub(vec3(anchors.rest, high), vec3(anchors.rest, low))
    area = scale(1.0 / (swept * spacing), cross(way, beside))
    size = norm(area)
    if size == 0.0:
        return
    mean = vec3(anchors.rest_area, k)
    if dot(mean, mean) == 0.0:
        mean = scale(anchors.rest_share[k] / size, area)
    # Averaged as a vector: where an anchor is dragged to and fro sideways, no more opens.
    bounded = scale(min(max(size, 1.0 / LARGEST_SHARE), LARGEST_SHARE) / size, area)
    weight = min(norm(slipped) / (AVERAGED_OVER * reach), 1.0)
    mean = axpy(weight, sub(bounded, mean), mean)
    store(anchors.rest_area, k, mean)
    anchors.rest_share[k] = max(norm(mean), 1.0 / LARGEST_SHARE)
