"""The way of the cutting edge through the material: from anchors to the path that is cut.

The path is a chain of material points, one a sample. Samples in the tissue are at their anchors. One
sample more on either side reaches out through the skin, so that the sheet always ends outside the
body or at a real end of the blade; it lies from its anchored neighbour as the blade does.
"""

from tissue.anchors import (
    ANCHORED,
    FREE,
    LEFT,
    Anchors,
    Edge,
    beside_anchor,
    edge_frame,
    to_material,
)
from tissue.body import Body
from tissue.geometry import normalised
from tissue.jit import kernel
from tissue.sheet import Path
from tissue.vec3 import Vec3, add, axpy, scale, store, sub, vec3


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
    _, forward, _ = edge_frame(edge, when)
    for k in range(n):
        path.was_member[k] = path.member[k]
        store(path.t0, k, vec3(path.t1, k))
        path.member[k] = anchors.state[k] != FREE
        path.seed[k] = -1
        if path.member[k]:
            _place_anchored(anchors, body, forward, margin, k, path)
    for k in range(n):
        if anchors.state[k] == FREE:
            _place_beside(anchors, body, edge, when, k, path)
    for k in range(n):
        if path.member[k] and not path.was_member[k]:
            _begin(path, k, margin)
    for k in range(n):
        path.linked[k] = k + 1 < n and path.member[k] and path.member[k + 1]
        if anchors.state[k] == LEFT:
            anchors.state[k] = FREE


@kernel
def forget_path(path: Path) -> None:
    """Let the next path begin at the next contact."""
    for k in range(len(path.member)):
        path.member[k] = False


@kernel
def _place_anchored(
    anchors: Anchors, body: Body, forward: Vec3, margin: float, k: int, path: Path
) -> None:
    t = anchors.tetrahedron[k]
    ahead = normalised(to_material(body, t, forward))
    store(path.forward, k, ahead)
    path.seed[k] = t
    p = vec3(anchors.rest, k)
    store(path.t1, k, axpy(margin, ahead, p) if anchors.state[k] == LEFT else p)


@kernel
def _place_beside(
    anchors: Anchors, body: Body, edge: Edge, when: float, k: int, path: Path
) -> None:
    """Place a free sample from the anchored samples beside it: their mean, if there are two."""
    n_beside = 0
    p = Vec3(0.0, 0.0, 0.0)
    ahead = Vec3(0.0, 0.0, 0.0)
    for beside in range(k - 1, k + 2, 2):
        if 0 <= beside < len(anchors.state) and anchors.state[beside] == ANCHORED:
            n_beside += 1
            p = add(p, beside_anchor(anchors, body, edge, when, k, beside))
            ahead = vec3(path.forward, beside)
    if n_beside > 0:
        path.member[k] = True
        store(path.t1, k, scale(1.0 / n_beside, p))
        store(path.forward, k, ahead)


@kernel
def _begin(path: Path, k: int, margin: float) -> None:
    """Give a new member of the chain a start: beside the nearest old member, or outside the skin."""
    n = len(path.member)
    for distance in range(1, n):
        for old in range(k - distance, k + distance + 1, 2 * distance):
            if 0 <= old < n and path.member[old] and path.was_member[old]:
                offset = sub(vec3(path.t1, k), vec3(path.t1, old))
                store(path.t0, k, add(vec3(path.t0, old), offset))
                return
    store(path.t0, k, axpy(-margin, vec3(path.forward, k), vec3(path.t1, k)))
