"""The path of the cutting edge through the material: from anchors to the path that is cut.

The path is a chain of material points, one a sample. Samples in the tissue are at their anchors. A
few more samples on either side reach out through the skin, so that the sheet always ends outside
the body or at a real end of the blade; their offset from the anchored neighbour is that on the
blade.
"""

from tissue.blade.anchors import FREE, LEFT, Anchors
from tissue.blade.edge import BladePose, Edge, pose_at, sample_displacement
from tissue.blade.material_frame import mean_rotation, rest_offset
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, scale, store, sub, vec3
from tissue.cutting.blade_path import Path
from tissue.geometry.polar_decomposition import apply_transposed
from tissue.geometry.tetrahedron import Matrix3
from tissue.mesh.body import OUTER, Body, walk

OUTREACH = 6
"""Samples by which the chain extends beyond the last one in the tissue: a mean node size. With one,
or on coarse meshes with three, a corner of the skin between two samples can stay uncut."""

SMOOTHING = 6
"""Passes of smoothing along the edge; they reach over half a mean node size to either side."""

STEEPEST = 1.0
"""Displacement of the path sideways per displacement ahead, at most. Steeper steps leave tetrahedra
uncut."""


@kernel
def trace_path(
    anchors: Anchors, body: Body, edge: Edge, when: float, margin: float, path: Path
) -> None:
    """Write the path of the samples since the last call. Samples that left are freed.

    Args:
        anchors: The samples at the end of the step.
        body: The tissue.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
        margin: How far outside the skin the sheet begins and ends [m].
        path: Written; its last end is the new start.
    """
    n = len(anchors.state)
    pose = pose_at(edge, when)
    rotation = mean_rotation(anchors, body)
    ahead = apply_transposed(rotation, pose.forward)
    sideways = apply_transposed(rotation, pose.normal)
    store(path.sideways, 0, sideways)
    gone = True
    begun = False
    for k in range(n):
        store(path.t0, k, vec3(path.t1, k))
        path.member[k] = anchors.state[k] != FREE
        path.seed[k] = -1
        store(path.forward, k, ahead)
        if path.member[k]:
            gone = gone and anchors.state[k] == LEFT
            begun = begun or anchors.slipped[k]
            path.seed[k] = anchors.tetrahedron[k]
            # A blade that only presses has not cut yet: the path waits outside the skin.
            if anchors.slipped[k]:
                store(path.t1, k, vec3(anchors.rest, k))
            elif not path.known[k]:
                store(path.t1, k, _behind(body, vec3(anchors.rest, k), margin, ahead, path.seed[k]))
            # Where the blade backs off, the sheet does not go on.
            if (
                anchors.state[k] == LEFT
                and dot(sample_displacement(edge, k, n), pose.forward) > 0.0
            ):
                _extend_beyond_skin(body, k, axpy(margin, ahead, vec3(anchors.rest, k)), path)
    for k in range(n):
        if anchors.state[k] == FREE:
            _place_beside(anchors, pose, rotation, k, path)
    _smooth(path, sideways)
    for k in range(n):
        if path.member[k]:
            if gone:
                store(path.t1, k, axpy(margin, ahead, vec3(path.t1, k)))
            if path.known[k]:
                _limit_step(path, k, sideways)
            elif begun:  # a new member begins outside the skin, behind where it is now
                store(path.t0, k, _behind(body, vec3(path.t1, k), margin, ahead, path.seed[k]))
            else:
                store(path.t0, k, vec3(path.t1, k))
    for k in range(n):
        path.known[k] = path.member[k]
        path.linked[k] = k + 1 < n and path.member[k] and path.member[k + 1]
        if anchors.state[k] == LEFT:
            anchors.state[k] = FREE


@kernel
def forget_path(path: Path) -> None:
    """Forget where the edge has been: the next path begins at the next contact."""
    for k in range(len(path.member)):
        path.member[k] = False
        path.known[k] = False


@kernel
def _behind(body: Body, p: Vec3, margin: float, ahead: Vec3, seed: int) -> Vec3:
    """Return where a sheet begins that the edge enters at `p` [m]: outside the skin, or in a slit.

    In the midst of tissue, where a tip was driven in, it begins at `p` itself.
    """
    behind = axpy(-margin, ahead, p)
    if seed >= 0 and walk(body, behind, seed).inside:
        return p
    return behind


@kernel
def _extend_beyond_skin(body: Body, k: int, p: Vec3, path: Path) -> None:
    """End the sheet at `p` [m], where sample `k` left the body, if that is outside."""
    at = walk(body, p, path.seed[k])
    if not at.inside and at.link == OUTER:
        store(path.t1, k, p)


@kernel
def _place_beside(anchors: Anchors, pose: BladePose, rotation: Matrix3, k: int, path: Path) -> None:
    """Place a free sample from the nearest samples that are, or just were, in the tissue."""
    n_beside = 0
    p = Vec3(0.0, 0.0, 0.0)
    for distance in range(1, OUTREACH + 1):
        for beside in range(k - distance, k + distance + 1, 2 * distance):
            if 0 <= beside < len(anchors.state) and anchors.state[beside] != FREE:
                n_beside += 1
                offset = rest_offset(pose, rotation, len(anchors.state), k, beside)
                p = add(p, add(vec3(path.t1, beside), offset))
        if n_beside > 0:
            path.member[k] = True
            store(path.t1, k, scale(1.0 / n_beside, p))
            return


@kernel
def _smooth(path: Path, sideways: Vec3) -> None:
    """Smooth how far samples beside each other lie sideways, over about a node size.

    Anchors in different tetrahedra are dragged sideways by different amounts. The mesh cannot hold
    a fold of the sheet that is finer than its tetrahedra; it would tear along one.
    """
    n = len(path.member)
    for _ in range(SMOOTHING):
        for parity in range(2):
            for k in range(parity, n, 2):
                if not path.member[k]:
                    continue
                here = vec3(path.t1, k)
                n_beside = 0
                distance = 0.0
                for beside in range(k - 1, k + 2, 2):
                    if 0 <= beside < n and path.member[beside]:
                        n_beside += 1
                        distance += dot(sub(vec3(path.t1, beside), here), sideways)
                if n_beside == 2:
                    store(path.t1, k, axpy(0.5 * distance / n_beside, sideways, here))


@kernel
def _limit_step(path: Path, k: int, sideways: Vec3) -> None:
    """Hold a sample back that is not ahead of where it has been, or moves more sideways than ahead.

    The first is in its own cut; the second would fold the sheet.
    """
    start = vec3(path.t0, k)
    step = sub(vec3(path.t1, k), start)
    ahead = dot(step, vec3(path.forward, k))
    if ahead <= 0.0:
        store(path.t1, k, start)
        return
    drift = dot(step, sideways)
    kept = min(max(drift, -STEEPEST * ahead), STEEPEST * ahead)
    store(path.t1, k, axpy(kept - drift, sideways, vec3(path.t1, k)))
