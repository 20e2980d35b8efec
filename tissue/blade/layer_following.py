"""Where the edge runs beside a weak layer between two parts of a body, the cut follows the layer.

A crack takes the layer where that is nearer to the edge than half an element: the mesh cannot tell
the two planes apart, and the layer takes less energy. It stays there up to an element. It does so
at an angle up to which a crack turns into an interface: `Gl < cos(a / 2)^4 Gt`, where Gl is the
toughness of the layer and Gt that of the tissue, and the right side the energy that a crack
releases which turns by an angle a (Cotterell and Rice 1980, Int. J. Fract. 16:155); a quarter at a
right angle, as in He and Hutchinson (1989, Int. J. Solids Struct. 25:1053). A blade that is led
leaves the layer behind where it is steeper than the path of a cut can turn aside.

The path of the cut is shifted aside to the layer. What opens are faces between the two parts. Once
the path is there the samples pay for these: toughness of the layer, over the cosine of the angle
between layer and blade, since there is as much more of it than the edge sweeps.
"""

from typing import NamedTuple

from tissue.blade.blade_state import BladeState
from tissue.blade.edge_anchors import FREE, LEFT, Anchors
from tissue.blade.toughness import TOUGHNESS
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, sub, vec3
from tissue.cutting.blade_path import Path
from tissue.geometry.tetrahedron import barycentric_in, node_altitude
from tissue.mesh.body import CUT, INSIDE_TOLERANCE, LONGEST_WALK, OUTER, Body, walk
from tissue.mesh.interfaces import NO_LAYER, is_beside, layer_between

FARTHEST_LAYER = 3.0
"""Distance up to which a layer is looked for, per mean node size: more than half an element."""

FOLLOWED_FROM, FOLLOWED_TO = 0.5, 1.0
"""Distance from which a cut follows a layer, and up to which one stays that follows it, here or at
the next sample; per mean edge of the element's face on it, or mean node size where that is more."""

LEAST_COSINE_FOLLOWED = 0.8
"""Cosine of the angle between a layer and the blade, at least: 37 degrees. A path turns aside by
up to 45 degrees (`tissue.blade.path_tracing.STEEPEST`), and must come nearer to the layer."""

ON_LAYER = 0.3
"""Distance of the path from a layer up to which what opens are its faces, per mean node size: so
near a cut is snapped to nodes."""

KEPT_BESIDE = 0.05
"""Distance from the layer at which the path of the cut runs, per altitude of that element: on the
side of the edge, and not in the plane of faces, where it would cross edges that lie in it."""


AHEAD = 0.25
"""Distance ahead of a sample at which a layer is looked for in the second place, per mean node
size."""


_AT_SKIN = -2
"""In place of a row of `Interfaces`: the skin is beside the sample, and hides what is behind."""


class LayerAhead(NamedTuple):
    """The layer beside a sample of the edge."""

    row: int
    """Row of `Interfaces`, or NO_LAYER or _AT_SKIN."""
    aside: float
    """Distance along the normal of the blade, negative on its other side [m]."""
    cosine: float
    """Cosine of the angle between the layer and the blade."""
    altitude: float
    """Altitude over the layer of the element between the two [m]."""
    edge: float
    """Mean edge of its face on the layer [m]."""


class FaceOfLayer(NamedTuple):
    """A face of a layer, on a straight line."""

    row: int
    """Row of `Interfaces`; NO_LAYER where there is none, _AT_SKIN where the skin is near."""
    tetrahedron: int
    """Tetrahedron that the line leaves there."""
    face: int
    """Its local face."""
    share: float
    """Fraction of the line up to there."""


@kernel
def follow_layers(blade: BladeState, body: Body, path: Path) -> None:
    """Find which samples follow a layer, and how far aside the path is shifted for that.

    Samples beside those bend away from the layer no more steeply than a cut may turn, and samples
    outside the body go with their neighbours.

    Args:
        blade: `layer` of the anchors is written.
        body: The tissue.
        path: As traced in this step, before its ends are shifted. `aside` is written.
    """
    anchors, aside = blade.anchors, path.aside
    n = len(anchors.state)
    for k in range(n):
        path.aside_before[k] = aside[k]
        if anchors.state[k] == LEFT:  # as long as it was in the body
            continue
        aside[k] = 0.0
        if anchors.state[k] == FREE:
            anchors.layer[k] = NO_LAYER
            continue
        found = _layer_beside(blade, body, path, k, _follows(anchors, k))
        anchors.layer[k], anchors.layer_cosine[k] = found.row, found.cosine
        if found.row == _AT_SKIN:
            anchors.layer[k], anchors.layer_cosine[k] = NO_LAYER, 0.0
        elif found.row != NO_LAYER:
            beside = min(abs(found.aside), KEPT_BESIDE * found.altitude)
            side = 1.0 if found.aside >= 0.0 else -1.0
            drift = sub(vec3(path.t1, k), vec3(anchors.rest, k))
            aside[k] = found.aside - side * beside - dot(drift, vec3(path.sideways, k))
    for k in range(1, n):
        if path.linked[k - 1]:
            _carry(anchors, path, k - 1, k)
    for k in range(n - 2, -1, -1):
        if path.linked[k]:
            _carry(anchors, path, k + 1, k)
    for k in range(n):
        if path.known[k]:
            before = aside[k]
            _limit_turn(path, k)
            if abs(aside[k] - before) > ON_LAYER * blade.reach:
                anchors.layer_cosine[k] = 0.0


@kernel
def _follows(anchors: Anchors, k: int) -> bool:
    """Return whether sample `k` or one next to it followed a layer in the step before."""
    layer, last = anchors.layer, len(anchors.layer) - 1
    here: bool = layer[max(k - 1, 0)] != NO_LAYER or layer[k] != NO_LAYER
    return here or layer[min(k + 1, last)] != NO_LAYER


@kernel
def _carry(anchors: Anchors, path: Path, source: int, k: int) -> None:
    """Shift sample `k`, which follows no layer, with its neighbour `source`.

    At the skin, and outside, it is beside the same layer as that.
    """
    is_outside = anchors.state[k] == FREE
    if not is_outside and anchors.layer[k] != NO_LAYER:
        return
    is_hidden = not is_outside and anchors.layer_cosine[k] == 0.0
    shift = path.aside[source]
    left = max(abs(shift) - (0.0 if is_outside or is_hidden else anchors.spacing), 0.0)
    if left > abs(path.aside[k]):
        path.aside[k] = left if shift > 0.0 else -left
    if is_hidden and anchors.layer[source] != NO_LAYER:
        anchors.layer[k] = anchors.layer[source]
        anchors.layer_cosine[k] = anchors.layer_cosine[source]


@kernel
def _limit_turn(path: Path, k: int) -> None:
    """Hold the shift of a sample back where its path would turn aside too steeply."""
    step = sub(vec3(path.t1, k), vec3(path.t0, k))
    ahead, drift = dot(step, vec3(path.forward, k)), dot(step, vec3(path.sideways, k))
    most = max(ahead, 0.0)
    before = path.aside_before[k]
    path.aside[k] = min(max(path.aside[k], before - most - drift), before + most - drift)


@kernel
def shift_to_layers(path: Path) -> None:
    """Shift the path aside, after the shifts of its ends."""
    for k in range(len(path.member)):
        if not path.member[k]:
            path.aside[k] = 0.0
            continue
        shift = scale(path.aside[k], vec3(path.sideways, k))
        for x in range(3):
            path.shift[k, x] += shift[x]
            path.t1[k, x] += shift[x]
            if not path.known[k]:
                path.t0[k, x] += shift[x]


@kernel
def _layer_beside(blade: BladeState, body: Body, path: Path, k: int, follows: bool) -> LayerAhead:
    """Return the layer that sample `k` follows, or none.

    At the skin, which may be turned against the blade, the tissue just ahead shows where it is.

    Args:
        blade: The samples.
        body: The tissue.
        path: Directions of the blade in the body at rest.
        k: The sample.
        follows: Whether it, or one next to it, follows a layer already.
    """
    anchors = blade.anchors
    t, at, reach = anchors.tetrahedron[k], vec3(anchors.rest, k), blade.reach
    found = _nearer_layer(blade, body, path, k, t, at)
    if found.row < 0:
        last = walk(body, axpy(AHEAD * reach, vec3(path.forward, k), at), t)
        if last.inside:
            ahead = axpy(AHEAD * reach, vec3(path.forward, k), at)
            found = _nearer_layer(blade, body, path, k, last.tetrahedron, ahead)
    if found.row == _AT_SKIN:
        return found
    most = FOLLOWED_TO if follows else FOLLOWED_FROM
    is_near = abs(found.aside) <= most * max(found.edge, reach)
    if found.row == NO_LAYER or not is_near or not _turns_into(blade, body, k, found):
        return LayerAhead(NO_LAYER, 0.0, 1.0, 0.0, 0.0)
    return found


@kernel
def _nearer_layer(
    blade: BladeState, body: Body, path: Path, k: int, t: int, start: Vec3
) -> LayerAhead:
    """Return the layer nearest to a point on either side of the blade, as seen by a sample.

    Args:
        blade: The samples.
        body: The tissue.
        path: Directions of the blade in the body at rest.
        k: The sample, in the plane of the blade with the point.
        t: The tetrahedron that holds the point.
        start: The point [m].
    """
    anchors, sideways = blade.anchors, vec3(path.sideways, k)
    reach = FARTHEST_LAYER * blade.reach
    right = _face_along(anchors.layer[k], body, t, start, scale(reach, sideways))
    left = _face_along(anchors.layer[k], body, t, start, scale(-reach, sideways))
    found = right
    if right.row < 0 or (left.row >= 0 and left.share < right.share):
        found = left
    if found.row < 0:
        return LayerAhead(min(left.row, right.row), 0.0, 1.0, 0.0, 0.0)
    normal = _normal(body, found.tetrahedron, found.face)
    across = dot(normal, sideways)
    corner = vec3(body.rest, body.tetrahedra[found.tetrahedron, (found.face + 1) % 4])
    if across == 0.0:
        return LayerAhead(NO_LAYER, 0.0, 1.0, 0.0, 0.0)
    return LayerAhead(
        found.row,
        dot(sub(corner, vec3(anchors.rest, k)), normal) / across,
        abs(across),
        node_altitude(body.rest, body.tetrahedra, found.tetrahedron, found.face),
        _mean_edge(body, found.tetrahedron, found.face),
    )


@kernel
def _turns_into(blade: BladeState, body: Body, k: int, layer: LayerAhead) -> bool:
    """Return whether a crack at sample `k` turns into a layer."""
    if layer.cosine < LEAST_COSINE_FOLLOWED:
        return False
    law, row = blade.toughness, body.material[blade.anchors.tetrahedron[k]]
    tissue = law.relative[row, TOUGHNESS] * law.toughness
    along = body.interfaces.toughness[layer.row] + law.blunt[row]
    # cos(a / 2)^2 = (1 + cos a) / 2
    turned: bool = along < (0.5 * (1.0 + layer.cosine)) ** 2 * tissue
    return turned


@kernel
def _face_along(followed: int, body: Body, t: int, start: Vec3, ray: Vec3) -> FaceOfLayer:
    """Return the first face of a layer on a straight line.

    Args:
        followed: The layer that the cut has followed, or NO_LAYER: faces of it that are open count.
        body: The tissue.
        t: The tetrahedron in which the line begins.
        start: Where it begins [m].
        ray: Vector from there to its end [m].
    """
    labels, stop = body.materials.label, add(start, ray)
    for _ in range(LONGEST_WALK):
        here = barycentric_in(start, body.rest, body.tetrahedra, t)
        there = barycentric_in(stop, body.rest, body.tetrahedra, t)
        through, when = -1, 1.0
        for f in range(4):
            if there[f] < -INSIDE_TOLERANCE and there[f] < here[f]:
                share = max(here[f], 0.0) / (max(here[f], 0.0) - there[f])
                if share < when:
                    through, when = f, share
        if through < 0:
            break
        link, label = body.links[t, through], labels[body.material[t]]
        row = NO_LAYER
        if link >= 0:
            row = layer_between(body.interfaces, label, labels[body.material[link // 4]])
        elif link == CUT and is_beside(body.interfaces, followed, label):
            row = followed
        if row != NO_LAYER:
            return FaceOfLayer(row, t, through, when)
        if link < 0:
            if link == OUTER and FARTHEST_LAYER * when <= FOLLOWED_TO:
                return FaceOfLayer(_AT_SKIN, t, through, when)
            break
        t = link // 4
    return FaceOfLayer(NO_LAYER, 0, 0, 1.0)


@kernel
def _normal(body: Body, t: int, f: int) -> Vec3:
    """Return the unit normal of a face at rest."""
    a = vec3(body.rest, body.tetrahedra[t, (f + 1) % 4])
    b = vec3(body.rest, body.tetrahedra[t, (f + 2) % 4])
    c = vec3(body.rest, body.tetrahedra[t, (f + 3) % 4])
    normal = cross(sub(b, a), sub(c, a))
    return scale(1.0 / norm(normal), normal)


@kernel
def _mean_edge(body: Body, t: int, f: int) -> float:
    """Return the mean edge of a face at rest [m]."""
    a = vec3(body.rest, body.tetrahedra[t, (f + 1) % 4])
    b = vec3(body.rest, body.tetrahedra[t, (f + 2) % 4])
    c = vec3(body.rest, body.tetrahedra[t, (f + 3) % 4])
    return (norm(sub(b, a)) + norm(sub(c, b)) + norm(sub(a, c))) / 3.0
