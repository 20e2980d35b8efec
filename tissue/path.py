"""The way of the cutting edge through the material: from anchors to the path that is cut.

The path is a chain of material points, one a sample. Samples in the tissue are at their anchors. A few
samples more on either side reach out through the skin, so that the sheet always ends outside the
body or at a real end of the blade; they lie from their anchored neighbour as the blade does.
"""

from tissue.anchors import (
    FREE,
    LEFT,
    Anchors,
    Edge,
    edge_frame,
    mean_rotation,
    offset_from,
    turned_back,
)
from tissue.body import Body
from tissue.geometry import Matrix3
from tissue.jit import kernel
from tissue.sheet import Path
from tissue.vec3 import Vec3, add, axpy, dot, scale, store, sub, vec3


OUTREACH = 3
"""Samples that the chain reaches out beyond the last one in the tissue: half a mean node size. With
one, a corner of the skin between two samples can stay uncut."""


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
    rotation = mean_rotation(anchors, body)
    ahead = turned_back(rotation, forward)
    gone = True
    for k in range(n):
        store(path.t0, k, vec3(path.t1, k))
        path.member[k] = anchors.state[k] != FREE
        path.seed[k] = -1
        store(path.forward, k, ahead)
        if path.member[k]:
            gone = gone and anchors.state[k] == LEFT
            path.seed[k] = anchors.tetrahedron[k]
            store(path.t1, k, vec3(anchors.rest, k))
    for k in range(n):
        if anchors.state[k] == FREE:
            _place_beside(anchors, edge, rotation, when, k, path)
    if gone:
        for k in range(n):
            store(path.t1, k, axpy(margin, vec3(path.forward, k), vec3(path.t1, k)))
    for k in range(n):
        if path.member[k]:
            if not path.known[k]:
                _begin(path, k, margin)
            _never_back(path, k)
    for k in range(n):
        path.known[k] = path.known[k] or path.member[k]
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
def _begin(path: Path, k: int, margin: float) -> None:
    """Give a new member of the chain a start outside the skin, behind where it is met now."""
    store(path.t0, k, axpy(-margin, vec3(path.forward, k), vec3(path.t1, k)))


@kernel
def _never_back(path: Path, k: int) -> None:
    """Let a sample that is not ahead of where it has been stay there: it is in its own cut."""
    start = vec3(path.t0, k)
    if dot(sub(vec3(path.t1, k), start), vec3(path.forward, k)) <= 0.0:
        store(path.t1, k, start)
