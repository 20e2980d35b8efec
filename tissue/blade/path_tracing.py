"""The way of the cutting edge through the material: from anchors to the path that is cut.

The path is a chain of material points, one a sample. Samples in the tissue are at their anchors. A
few samples more on either side reach out through the skin, so that the sheet always ends outside
the body or at a real end of the blade; they lie from their anchored neighbour as the blade does.
"""

from tissue.blade.anchors import FREE, LEFT, Anchors, Edge, edge_frame, sample_point
from tissue.blade.engagement import offset_from
from tissue.blade.material_frame import mean_rotation, turned_back
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, scale, store, sub, vec3
from tissue.cutting.blade_path import Path
from tissue.geometry.tetrahedron import Matrix3
from tissue.mesh.body import OUTER, Body, walk

OUTREACH = 6
"""Samples that the chain reaches out beyond the last one in the tissue: a mean node size. With one,
or on coarse meshes with three, a corner of the skin between two samples can stay uncut."""

SMOOTHING = 6
"""Passes of smoothing along the edge; they reach over half a mean node size to either side."""

STEEPEST = 1.0
"""How far the path may go sideways per way ahead. Steeper steps leave tetrahedra uncut."""


@kernel
def trace_path(
    anchors: Anchors, body: Body, edge: Edge, when: float, margin: float, path: Path
) -> None:
    """Write the way of the samples since the last call to `path`. Samples that left are freed.

    Args:
        anchors: The samples at the end of the step.
        body: The tissue.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
        margin: How far outside the skin the sheet begins and ends [m].
        path: Its last end is the new start.
    """
    n = len(anchors.state)
    _, forward, flat = edge_frame(edge, when)
    rotation = mean_rotation(anchors, body)
    ahead = turned_back(rotation, forward)
    sideways = turned_back(rotation, flat)
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
            if anchors.state[k] == LEFT and _advances(edge, forward, k, n):
                _reach_out(body, k, axpy(margin, ahead, vec3(anchors.rest, k)), path)
    for k in range(n):
        if anchors.state[k] == FREE:
            _place_beside(anchors, edge, rotation, when, k, path)
    _smooth(path, sideways)
    for k in range(n):
        if path.member[k]:
            if gone:
                store(path.t1, k, axpy(margin, ahead, vec3(path.t1, k)))
            if path.known[k]:
                _never_back(path, k, sideways)
            elif begun:  # a new member begins outside the skin, behind where it is met now
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
    """Let the next path begin at the next contact."""
    for k in range(len(path.member)):
        path.member[k] = False
        path.known[k] = False


@kernel
def _advances(edge: Edge, forward: Vec3, k: int, n: int) -> bool:
    """Whether the blade moves forward at sample `k` of `n`, rather than backs off."""
    way = sub(sample_point(edge, k, n, 1.0), sample_point(edge, k, n, 0.0))
    return dot(way, forward) > 0.0


@kernel
def _behind(body: Body, p: Vec3, margin: float, ahead: Vec3, seed: int) -> Vec3:
    """Where a sheet begins that is met at `p` [m]: outside the skin, or in a slit that is there.

    In the midst of tissue, where a tip was driven in, it begins at `p` itself.
    """
    behind = axpy(-margin, ahead, p)
    if seed >= 0 and walk(body, behind, seed).inside:
        return p
    return behind


@kernel
def _reach_out(body: Body, k: int, p: Vec3, path: Path) -> None:
    """Let the sheet end at `p` [m] where a sample left the body, if that is outside."""
    at = walk(body, p, path.seed[k])
    if not at.inside and at.link == OUTER:
        store(path.t1, k, p)


@kernel
def _place_beside(
    anchors: Anchors, edge: Edge, rotation: Matrix3, when: float, k: int, path: Path
) -> None:
    """Place a free sample from the nearest samples that are, or just were, in the tissue."""
    n_beside = 0
    p = Vec3(0.0, 0.0, 0.0)
    for distance in range(1, OUTREACH + 1):
        for beside in range(k - distance, k + distance + 1, 2 * distance):
            if 0 <= beside < len(anchors.state) and anchors.state[beside] != FREE:
                n_beside += 1
                offset = offset_from(edge, rotation, when, len(anchors.state), k, beside)
                p = add(p, add(vec3(path.t1, beside), offset))
        if n_beside > 0:
            path.member[k] = True
            store(path.t1, k, scale(1.0 / n_beside, p))
            return


@kernel
def _smooth(path: Path, sideways: Vec3) -> None:
    """Even out how far samples beside each other lie sideways, over about a node size.

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
def _never_back(path: Path, k: int, sideways: Vec3) -> None:
    """Hold a sample that is not ahead of where it has been, or goes more sideways than ahead.

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
