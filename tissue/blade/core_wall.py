"""Rigid cores as walls for the edge: what it would cut next is in a core, so it presses on it.

Tissue yields to the edge where its pull exceeds the toughness; a core does not, however hard the
edge presses. An anchor at a core stays, and pulls on its material point by its whole stretch, until
the edge backs off or goes on past the core.
"""

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import BladePose
from tissue.blade.edge_anchors import stored_energy, surplus_stretch
from tissue.blade.material_frame import displacement_at_rest
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, norm, vec3
from tissue.mesh.body import Body, walk


@kernel
def hold_at_core(blade: BladeState, body: Body, k: int, stretch: Vec3, pose: BladePose) -> None:
    """Note whether a core holds anchor `k`, where it would slip otherwise.

    Args:
        blade: Anchors are written, and what they hold more or less is counted.
        body: The tissue.
        k: The anchor.
        stretch: Vector from it to the point of the blade that pulls on it [m].
        pose: Pose of the blade.
    """
    anchors, totals, law = blade.anchors, blade.totals, blade.toughness
    was_held = anchors.at_core[k]
    before = stored_energy(anchors, k, stretch, pose, law)
    anchors.at_core[k] = False
    slip = surplus_stretch(anchors, k, stretch, pose, law)
    anchors.at_core[k] = norm(slip) > 0.0 and _leads_into_core(blade, body, k, slip, pose)
    if anchors.at_core[k] != was_held:
        totals.released += before - stored_energy(anchors, k, stretch, pose, law)


@kernel
def _leads_into_core(blade: BladeState, body: Body, k: int, step: Vec3, pose: BladePose) -> bool:
    """Return whether anchor `k` is in a core, or would be after a slip [m] in the body as it is."""
    anchors = blade.anchors
    t = anchors.tetrahedron[k]
    if body.is_rigid[t]:
        return True
    moved = displacement_at_rest(anchors, body, k, step, pose.normal, blade.reach)
    to = walk(body, add(vec3(anchors.rest, k), moved), t)
    return bool(to.inside and body.is_rigid[to.tetrahedron])
