"""Length of edge that each sample stands for: at the skin, as much as is in the tissue.

Samples lie a sixth of a node size apart. If the last one in the tissue stood for as much as the
others, an edge would hold up to half of that too much or too little, wherever it ends in the skin:
up to 5 % at a depth of two node sizes.
"""

from tissue.blade.blade_state import BladeState
from tissue.blade.body_sheets import rotation_of_sheet
from tissue.blade.edge import BladePose
from tissue.blade.edge_anchors import (
    ANCHORED,
    FREE,
    anchor_modulus,
    anchor_position,
    pulling_point,
    stored_energy,
)
from tissue.blade.material_frame import find_sheets, rest_offset
from tissue.core.jit import kernel
from tissue.core.vec3 import add, sub, vec3
from tissue.geometry.tetrahedron import barycentric_in
from tissue.mesh.body import OUTER, Body, walk


@kernel
def measure_held_lengths(blade: BladeState, body: Body, pose: BladePose) -> None:
    """Write the length of edge that each sample stands for, and the stiffness of its spring.

    What that changes in the energy of the springs counts as released: as an edge goes deeper, it
    takes hold of tissue that is bent already.

    Args:
        blade: The anchors and the total are written.
        body: The tissue.
        pose: Pose of the blade.
    """
    anchors, law = blade.anchors, blade.toughness
    n = len(anchors.state)
    find_sheets(anchors, body, blade.reach)
    for k in range(n):
        length = 0.0
        for adjacent in range(k - 1, k + 2, 2):
            if 0 <= adjacent < n:
                length += _length_towards(blade, body, pose, k, adjacent)
        if length == anchors.length[k]:
            continue
        before = after = 0.0
        is_counted = anchors.state[k] == ANCHORED and anchors.pulls[k]
        if is_counted:
            a = anchor_position(anchors, body, body.positions, k)
            stretch = sub(pulling_point(anchors, pose, k), a)
            before = stored_energy(anchors, k, stretch, pose, law)
        anchors.length[k] = length
        anchors.stiffness[k] = anchor_modulus(anchors, k) * length
        if is_counted:
            after = stored_energy(anchors, k, stretch, pose, law)
        blade.totals.released += before - after


@kernel
def _length_towards(blade: BladeState, body: Body, pose: BladePose, k: int, adjacent: int) -> float:
    """Return the length of edge that sample `k` stands for on the side of `adjacent` [m]."""
    anchors = blade.anchors
    half = 0.5 * anchors.spacing
    if anchors.state[k] != ANCHORED or anchors.state[adjacent] != FREE:
        return half
    offset = rest_offset(
        pose, rotation_of_sheet(anchors.sheets, k), len(anchors.state), adjacent, k
    )
    at = vec3(anchors.rest, k)
    p = add(at, offset)
    last = walk(body, p, anchors.tetrahedron[k])
    if last.inside:
        return half
    t = last.tetrahedron
    beyond = barycentric_in(p, body.rest, body.tetrahedra, t)
    here = barycentric_in(at, body.rest, body.tetrahedra, t)
    share = 2.0
    for f in range(4):
        if body.links[t, f] == OUTER and beyond[f] < 0.0:
            depth = max(here[f], 0.0)
            share = min(share, depth / (depth - beyond[f]))
    # An edge that ends at a cut is as long as the others: what is beyond that has been cut.
    return half if share > 1.0 else share * anchors.spacing
